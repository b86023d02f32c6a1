"""Linear systems for the tests of what assembles, measures and solves them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver import Scene
from radiosity_addon.solver.equations.assembly import collocation, galerkin, linear
from radiosity_addon.solver.equations.fixed_elements import subdivide_evenly
from radiosity_addon.solver.equations.linear_basis import vertex_basis
from radiosity_addon.solver.equations.linear_system import LinearSystem
from radiosity_addon.solver.hierarchy.basis import Basis, constant_basis
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.cornell import cornell_box
from tests.published import shining_cube


def assembled(scene: Scene, elements: int, assembly: str) -> tuple[Hierarchy, Basis, LinearSystem]:
    """Divide a scene into elements and assemble its system, lamps left out."""
    hierarchy = Hierarchy(scene)
    subdivide_evenly(hierarchy, elements)
    caster = EmbreeCaster(scene.triangles)
    if assembly == "linear":
        basis = vertex_basis(hierarchy)
        return hierarchy, basis, linear(hierarchy, caster, basis)
    make = {"galerkin": galerkin, "collocation": collocation}[assembly]
    return hierarchy, constant_basis(hierarchy), make(hierarchy, caster)


@cache
def cornell_system(assembly: str = "galerkin", elements: int = 200) -> LinearSystem:
    """The Cornell box, blocks and all, in three different channels."""
    return assembled(cornell_box(), elements, assembly)[2]


@cache
def cube_system(assembly: str = "galerkin", elements: int = 192) -> LinearSystem:
    """A closed unit cube, ρ = 0.5, its ceiling shining."""
    return assembled(shining_cube(), elements, assembly)[2]


def with_reflectance(system: LinearSystem, value: float) -> LinearSystem:
    """Return the system with one reflectance everywhere."""
    return replace(system, reflectance=np.full((len(system), 3), value))


def side_by_side(one: LinearSystem, other: LinearSystem) -> LinearSystem:
    """Return one system of two that do not see each other, their rows interleaved at random."""
    count = len(one) + len(other)
    exchange = np.zeros((count, count))
    exchange[: len(one), : len(one)] = one.exchange
    exchange[len(one) :, len(one) :] = other.exchange
    both = LinearSystem(
        exchange,
        *(np.concatenate([getattr(one, n), getattr(other, n)]) for n in ("reflectance", "emission", "area")),
        reciprocal=one.reciprocal and other.reciprocal,
    )
    return both.take(np.random.default_rng(5).permutation(count))


def iterate(iterates: Iterator[tuple[np.ndarray, np.ndarray]], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return iterate number `count`, or the last one, and the residual powers up to it, (k + 1, 3)."""
    residuals = []
    for number, (radiosity, residual) in enumerate(iterates):
        residuals.append(residual)
        last = radiosity
        if number == count:
            break
    return last, np.array(residuals)
