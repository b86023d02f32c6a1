"""Conjugate gradients on the symmetrized system (Hestenes and Stiefel 1952; handout §3.4)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...base import SILENT, Progress, UsageError
from ...numerics import Array
from ...scene import Scene
from ..equations import LinearSystem
from ..settings import SolverSettings
from ..state import SolverState
from .matrix import Iterate, solve_matrix


def conjugate_gradient(system: LinearSystem, start: Array | None = None) -> Iterator[Iterate]:
    """Iterate on (A/ρ − A F) B = A E/ρ, one system per channel, until no improvement is possible.

    Preconditioned by the diagonal A/ρ. Rows with ρ = 0 are eliminated: they have B = E and
    stand on the right side. See `jacobi.jacobi` for what is yielded.

    start (n, 3): None starts from B = E.
    Raises UsageError if the system is not reciprocal, so that scaling does not make it symmetric.
    """
    if system.mass is not None or not system.reciprocal:
        raise UsageError(
            "conjugate gradients need a symmetric system, so reciprocal form factors: "
            "take the galerkin assembly, or the method jacobi or gauss-seidel"
        )
    return _iterate(system, start)


def _iterate(system: LinearSystem, start: Array | None) -> Iterator[Iterate]:
    reflects = system.reflectance > 0
    weight = np.where(reflects, system.area[:, None], 0.0)
    weight /= np.where(reflects, system.reflectance, 1.0)
    """A/ρ, 0 in the rows that are eliminated"""
    radiosity = np.where(reflects, system.emission if start is None else start, system.emission)
    # Preconditioned, the residual A/ρ (E − K B) of the symmetric system is E − K B itself.
    residual = np.where(reflects, system.residual(radiosity), 0.0)
    direction = residual
    energy = (weight * residual * residual).sum(axis=0)
    while True:
        yield radiosity, system.area @ np.abs(residual)
        if not energy.any():
            return
        reflected = np.where(reflects, system.reflectance * system.gather(direction), 0.0)
        applied = direction - reflected
        curvature = (weight * direction * applied).sum(axis=0)
        length = np.divide(energy, curvature, out=np.zeros(3), where=curvature > 0)
        radiosity = radiosity + length * direction
        residual = residual - length * applied
        before, energy = energy, (weight * residual * residual).sum(axis=0)
        ratio = np.divide(energy, before, out=np.zeros(3), where=before > 0)
        direction = residual + ratio * direction


def solve(scene: Scene, settings: SolverSettings, progress: Progress = SILENT) -> SolverState:
    """Return the solved state; `progress` receives it on the way.

    Raises UsageError if the assembly is not galerkin.
    """
    if settings.assembly != "galerkin":
        raise UsageError(
            "conjugate gradients need reciprocal form factors, which the "
            f"{settings.assembly} assembly does not give: take galerkin, or the method jacobi or gauss-seidel"
        )
    return solve_matrix(scene, settings, progress, conjugate_gradient, copies=2)
