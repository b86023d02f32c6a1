"""Common part of the matrix methods: elements, memory, assembly, independent blocks, and results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from ...base import Progress
from ...numerics import Array
from ...scene import OVERLAP, Scene, arriving
from ..equations import (
    LinearSystem,
    collocation,
    describe_sets,
    galerkin,
    independent_sets,
    linear,
    matrix_properties,
    share_overlaps,
    subdivide_evenly,
    vertex_basis,
    with_lamps,
)
from ..hierarchy import Basis, constant_basis
from ..links import lamp_irradiance
from ..settings import SolverSettings
from ..state import SolverState, begin, refuse_beyond

Iterate = tuple[Array, Array]
"""Radiosity (n, 3) [W/m²], and its residual power Σ A |E − K B| (3,) [W]."""

Solver = Callable[[LinearSystem], Iterator[Iterate]]
"""Yields the iterates from iteration 0 on; ends when there is no better one."""

ASSEMBLERS = {"galerkin": galerkin, "collocation": collocation, "linear": linear}

GIB = float(1 << 30)

ASSEMBLY_SHARE = 0.8
"""Share of assembly in the progress."""


@dataclass
class MatrixState(SolverState):
    """State of a matrix method."""

    entries: int = 0
    """Form factors that are not 0."""
    share: Array = field(default_factory=lambda: np.zeros(0))
    """(f,) ΣFV of every face, an area mean"""
    basis: Basis | None = None
    """The basis of the unknowns."""
    values: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(n, 3) B of the unknowns [W/m²]; `basis.evaluate` gives B̂ at points."""

    @property
    def n_links(self) -> int:
        """Form factors that are not 0."""
        return self.entries

    def approximation(self) -> tuple[Basis, Array]:
        """Return the basis and the unknowns: hats at vertices where the elements are linear."""
        return super().approximation() if self.basis is None else (self.basis, self.values)

    def closure(self) -> Array:
        """Return (f,) the area mean over each face of ΣFV: 1 in a closed scene."""
        return self.share if len(self.share) else super().closure()


def solve_matrix(
    scene: Scene, settings: SolverSettings, progress: Progress, solver: Solver, copies: int
) -> MatrixState:
    """Assemble the system of a scene, solve it block by block, and set the state.

    progress: Is shown the state, the same one all along.
    solver: Iterates on one block.
    copies: Matrices of n × n numbers that the method holds at once, the system's own included.
    Raises UsageError if the system would need more than the memory limit; nothing is allocated then.
    """
    state = begin(scene, settings, MatrixState)
    progress.at(0.0, state)
    if not state.has_light:
        return state
    is_linear = settings.assembly == "linear"
    # With more faces than requested elements, the faces are the elements. A mesh of triangles
    # has half as many vertices at least.
    faces = len(state.hierarchy.faces)
    elements = max(faces, settings.elements)
    check_memory(elements // 2 if is_linear else elements, copies, settings, faces)
    subdivide_evenly(state.hierarchy, settings.elements)
    state.link_lights_to_leaves()
    basis = state.basis = vertex_basis(state.hierarchy) if is_linear else constant_basis(state.hierarchy)
    needed = check_memory(len(basis), copies + is_linear, settings, faces)
    state.reset()
    progress.at(0.02, state)

    system, direct = _assemble(state, basis, progress)
    opacity = state.hierarchy.opacity[basis.elements()]
    overlapping = np.count_nonzero(arriving(system.exchange, opacity) > OVERLAP * system.area)
    system, sends = share_overlaps(system, opacity)
    sets, alone = independent_sets(system)
    _describe(state, basis, system, sends, sets, alone, needed)
    state.details["matrix"]["overlapping"] = int(overlapping)
    # Correct for isolated unknowns; the blocks of the others have their own first iterate.
    state.values = system.emission / system.diagonal()
    blocks = [_Block(rows, system.take(rows), sends[rows, None]) for rows in sets]
    # A block is a copy, so the whole matrix can be released.
    del system
    progress.at(ASSEMBLY_SHARE, state)
    _solve_blocks(state, basis, blocks, solver, progress.part(ASSEMBLY_SHARE, 1.0))
    _finish(state, basis, blocks, direct)
    return state


def check_memory(unknowns: int, copies: int, settings: SolverSettings, faces: int) -> float:
    """Return the GiB that `copies` matrices of a system take; refuse more than the limit.

    faces: The scene's; the minimum number of elements.
    Raises UsageError: Names the size, what it would need, the limit and the methods that do without.
    """
    needed = copies * 8.0 * float(unknowns) ** 2
    fewer = "use fewer elements, or " if settings.elements > faces else ""
    advice = f"{fewer}take the method hierarchical, or shooting, which needs no matrix"
    refuse_beyond(settings.memory_limit, needed, f"{settings.method} with {unknowns} unknowns", advice)
    return needed / GIB


def _assemble(state: MatrixState, basis: Basis, progress: Progress) -> tuple[LinearSystem, Array]:
    """Return the system with the lamps' light in it, and that, (n, 3) [W/m²]."""
    settings, assemble = state.settings, ASSEMBLERS[state.settings.assembly]
    part = progress.part(0.02, ASSEMBLY_SHARE)
    system = assemble(state.hierarchy, state.caster, basis, settings.seed, settings.threads, part)
    direct = _lamps(state, basis)
    return with_lamps(system, direct), direct


def _lamps(state: MatrixState, basis: Basis) -> Array:
    """Return (n, 3) the lamps' irradiance: area means of constant elements, or at the nodes."""
    if basis.is_constant:
        return state.direct()[basis.leaf]
    normals = state.hierarchy.faces.normal[basis.faces(state.hierarchy)]
    points = basis.points(state.hierarchy)
    settings = state.settings
    return lamp_irradiance(state.scene.lights, points, normals, state.caster, settings.seed, settings.threads)


def _describe(
    state: MatrixState,
    basis: Basis,
    system: LinearSystem,
    sends: Array,
    sets: list[Array],
    alone: Array,
    needed: float,
) -> None:
    """Add the matrix's properties and its independent sets to the report."""
    hierarchy = state.hierarchy
    state.entries = int(np.count_nonzero(system.exchange))
    opacity = hierarchy.opacity[basis.elements()]
    from_node = np.asarray(sends * arriving(system.exchange, opacity) / system.area)
    on_leaf = basis.leaf_means(from_node[:, None])[:, 0]
    face = hierarchy.face[basis.leaf]
    power = np.bincount(face, on_leaf * hierarchy.area[basis.leaf], minlength=len(hierarchy.faces))
    state.share = power / hierarchy.faces.area
    state.details["matrix"] = {
        "assembly": state.settings.assembly,
        **matrix_properties(system).report(),
        "memory_GiB": needed,
        "blocks": len(sets),
        "alone": len(alone),
    }
    triangle = hierarchy.faces.triangle[face]
    area = hierarchy.area[basis.leaf]
    state.details["independent_sets"] = describe_sets(sets, area, basis.corner[:, 0], triangle)


@dataclass
class _Block:
    """One independent set and the state of its solution."""

    rows: Array
    """(k,) int: its unknowns."""
    system: LinearSystem
    sends: Array
    """(k, 1) the share of its radiosity that each sends, by which the system's unknowns differ from B."""
    residual: Array = field(default_factory=lambda: np.zeros(3))


def _solve_blocks(
    state: MatrixState, basis: Basis, blocks: list[_Block], solver: Solver, progress: Progress
) -> None:
    """Run the solver on all independent sets side by side until the residual is small enough."""
    settings = state.settings
    # Each block may keep its share of the allowed residual, in proportion to its light.
    light = np.array([(block.system.area @ block.system.emission).max() for block in blocks])
    allowed = settings.tolerance * state.power * light / max(float(light.sum()), 1e-300)
    waiting = [(block, solver(block.system), limit) for block, limit in zip(blocks, allowed, strict=True)]
    first = 0.0
    while True:
        waiting = [entry for entry in waiting if _advance(state, *entry)]
        residual = sum((block.residual for block in blocks), np.zeros(3))
        state.residual = float(residual.max()) / state.power
        means = basis.leaf_means(state.values)
        state.set_leaves(np.zeros_like(means), means)
        state.note()
        first = first or state.residual
        if not waiting or state.iterations >= settings.max_iterations:
            break
        progress.at(_converged(first, state.residual, settings.tolerance), state)
        state.iterations += 1
    state.details["matrix"]["converged"] = not waiting


def _advance(state: MatrixState, block: _Block, iterates: Iterator[Iterate], allowed: float) -> bool:
    """Take a block's next iterate; return whether it needs another one."""
    following = next(iterates, None)
    if following is None:
        return False
    unknowns, block.residual = following
    state.values[block.rows] = unknowns / block.sends
    return bool(block.residual.max() > allowed)


def _finish(state: MatrixState, basis: Basis, blocks: list[_Block], direct: Array) -> None:
    """Transfer the unknowns' radiosities and irradiances to the elements."""
    irradiance = direct.copy()
    for block in blocks:
        irradiance[block.rows] += block.system.gather(block.sends * state.values[block.rows])
    # A hat may fall below 0 between its node and the boundary; light does not.
    means = np.maximum(basis.leaf_means(basis.from_nodes(irradiance)), 0.0)
    state.set_leaves(means, np.maximum(basis.leaf_means(state.values), 0.0))


def _converged(first: float, now: float, last: float) -> float:
    """Return the progress of a residual from `first` to `last`, on a logarithmic scale."""
    if not 0.0 < last < first:
        return 0.0
    return float(np.clip(np.log(first / max(now, last)) / np.log(first / last), 0.0, 1.0))
