"""Two-level hierarchy: large patches send, small elements inside them receive (handout §4.1).

1. Faces are divided into patches, and patches into elements: inner nodes and leaves of one
   hierarchy.
2. Form factors F_qj from every element q to every patch j: an n × m matrix.
3. From patch to patch by area averages, F_ij = Σ_{q∈i} F_qj A_q / A_i (4.1).
4. Patches are solved directly, B_i = E_i + ρ_i Σ_j F_ij B_j (4.2).
5. Elements gather once from the patches: B_q = E_q + ρ_q Σ_j F_qj B_j (4.3).
6. Where neighboring elements differ too much they are split; only the new elements' rows are
   computed, and (4.3) is applied to them with the patch radiosities of step 4.

E holds the lamps' light as E + ρ H_direct. Sources stay constant over each patch, so the
result is one gather from the patch solution, not the solution of the elements' own system.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array
from ...scene import Scene, arriving, shares
from ..equations import exchange_areas, subdivide_evenly
from ..hierarchy import LEAF, neighbors
from ..settings import SolverSettings
from ..state import SolverState, begin, refuse_beyond

MIN_ELEMENT_SHARE = 1.0 / 64
"""Adaptive subdivision makes no element smaller than this part of the mean of step 1: three levels."""

BLOCK_PAIRS = 1 << 19
"""Pairs measured between two reports of progress; their numbers take 8 MB."""


@dataclass
class TwoLevelState(SolverState):
    """State of the two-level method: m patches, l elements."""

    patches: Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(m,) int: nodes of the hierarchy."""
    leaves: Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(l,) int: the elements, in the order of `hierarchy.leaves`."""
    patch_of: Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(l,) int: the row of each element's patch in `patches`."""
    factors: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """(l, m) float64: F_qj V_qj from element q to patch j."""
    patch_radiosity: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(m, 3) float64: the solution of step 4 [W/m²]."""
    sends: Array = field(default_factory=lambda: np.zeros((0, 1)))
    """(m, 1) float64: the share of its radiosity that each patch sends, see `overlaps`."""
    limit: float = np.inf
    """Difference between neighbors above which they are split [W/m²]."""
    smallest: float = 0.0
    """Area that subdivision must leave to every element [m²]."""

    @property
    def n_links(self) -> int:
        """Pairs of an element and a patch that exchange light."""
        return int(np.count_nonzero(self.factors))

    def closure(self) -> Array:
        """Return (f,) the area mean over each face of ΣFV: 1 in a closed scene."""
        faces = self.hierarchy.faces
        if not len(self.leaves):
            return np.zeros(len(faces))
        sums = arriving(self.factors, self.hierarchy.opacity[self.patches])
        weight = self.hierarchy.area[self.leaves] * sums * shares(sums)
        per_face = np.bincount(self.hierarchy.face[self.leaves], weight, minlength=len(faces))
        return np.asarray(per_face / faces.area)


def solve(scene: Scene, settings: SolverSettings, progress: Progress = SILENT) -> TwoLevelState:
    """Return the solved state; `progress` receives it on the way.

    About `settings.patches` patches, at most one for each of about `settings.elements`
    elements. `state.residual` is that of the patches' system (4.2), with the form factors that
    the elements of the last round average to: rounding at first, then how far the new rows
    disagree with the patch radiosities, which are kept.

    Raises UsageError if the n × m matrix would not fit into the memory limit.
    """
    state = begin(scene, settings, TwoLevelState)
    progress.at(0.01, state)
    if not state.has_light:
        return state
    refuse_large_matrix(len(state.hierarchy.faces), settings)
    divide(state)
    state.link_lights_to_leaves()
    progress.at(0.05, state)
    add_rows(state, state.leaves, progress.part(0.05, 0.6))
    solve_patches(state)
    gather_elements(state)
    _start_comparing(state)
    progress.at(0.62, state)
    rounds = progress.part(0.62, 1.0).turns(0.5)
    while len(new := split(state)):
        part = next(rounds)
        add_rows(state, new, part)
        gather_elements(state)
        part.at(1.0, state)
    _finish(state)
    return state


def divide(state: TwoLevelState) -> None:
    """Divide surfaces into patches, and these into elements (step 1)."""
    hierarchy, settings = state.hierarchy, state.settings
    subdivide_evenly(hierarchy, min(settings.patches, settings.elements))
    state.patches = hierarchy.leaves
    subdivide_evenly(hierarchy, settings.elements)
    state.reset()
    state.leaves = hierarchy.leaves
    state.factors = np.zeros((0, len(state.patches)))
    state.details["two_level"] = {"patches": len(state.patches), "elements": [], "rows": []}


def add_rows(state: TwoLevelState, new: Array, progress: Progress = SILENT) -> None:
    """Compute the rows F_qj of elements `new`, the last of the leaves (step 2)."""
    hierarchy, patches = state.hierarchy, state.patches
    state.leaves = hierarchy.leaves
    kept = len(state.leaves) - len(new)
    rows = np.zeros((len(state.leaves), len(patches)))
    rows[:kept] = state.factors[:kept]
    state.factors = rows
    state.patch_of = _patch_of(state)
    step = max(BLOCK_PAIRS // len(patches), 1)
    for start in range(0, len(new), step):
        block = new[start : start + step]
        one, other = np.repeat(block, len(patches)), np.tile(patches, len(block))
        exchange = exchange_areas(
            hierarchy, state.caster, one, other, state.settings.seed, state.settings.threads
        )
        target = kept + start + np.arange(len(block))
        state.factors[target] = exchange.reshape(len(block), -1) / hierarchy.area[block][:, None]
        progress.at((start + len(block)) / len(new), state)
    state.details["two_level"]["elements"].append(len(state.leaves))
    state.details["two_level"]["rows"].append(len(new))


def solve_patches(state: TwoLevelState) -> None:
    """Average the factors over patches (4.1) and solve (4.2), a channel at a time (steps 3, 4)."""
    factors = patch_factors(state)
    state.sends = shares(arriving(factors, state.hierarchy.opacity[state.patches]))[:, None]
    factors *= state.sends.T
    emission = _emission(state)
    reflectance = state.reflectance[state.patches]
    state.patch_radiosity = np.empty_like(emission)
    for channel in range(3):
        matrix = np.eye(len(factors)) - reflectance[:, channel, None] * factors
        state.patch_radiosity[:, channel] = np.linalg.solve(matrix, emission[:, channel])


def gather_elements(state: TwoLevelState) -> None:
    """Let every element gather once from the patches (4.3), and pull up its light (step 5)."""
    leaves = state.leaves
    irradiance = state.direct()[leaves] + state.factors @ (state.sends * state.patch_radiosity)
    state.set_leaves(irradiance, state.emission[leaves] + state.reflectance[leaves] * irradiance)
    state.residual = patch_residual(state)
    state.iterations += 1
    state.note()


def patch_factors(state: TwoLevelState) -> Array:
    """Return (m, m) F_ij = Σ_{q∈i} F_qj A_q / A_i (4.1)."""
    return _over_patches(state, state.factors)


def patch_residual(state: TwoLevelState) -> float:
    """Return Σ A |E + ρ F B − B| / Φ over the patches, the largest channel, with F from (4.1) now.

    By (4.1) and (4.3), E + ρ F B of a patch is the mean of its elements' radiosities.
    """
    mean = state.radiosity[state.patches]
    difference = state.hierarchy.area[state.patches] @ np.abs(mean - state.patch_radiosity)
    return float(difference.max()) / state.power


def contrasts(state: TwoLevelState) -> tuple[Array, Array]:
    """Return (k, 2) pairs of neighboring elements and (k,) how much their light differs [W/m²].

    Their reflected radiosity under the mean reflectance of the two, the largest channel: so
    lamps and seams between two materials, which no subdivision smooths, do not count.
    """
    pairs = neighbors(state.hierarchy, state.caster)
    reflectance = state.reflectance[pairs].mean(axis=1)
    difference = np.abs(state.irradiance[pairs[:, 0]] - state.irradiance[pairs[:, 1]])
    return pairs, (reflectance * difference).max(axis=1, initial=0.0)


def split(state: TwoLevelState) -> Array:
    """Split neighbors that differ by more than the limit, both, and return the new elements (step 6).

    None that would fall below `state.smallest`, and no more than the memory limit has room
    for, the largest differences first.
    """
    hierarchy = state.hierarchy
    pairs, difference = contrasts(state)
    differing = np.zeros(hierarchy.n_elements)
    np.maximum.at(differing, pairs.ravel(), np.repeat(difference, 2))
    chosen = state.leaves[differing[state.leaves] > state.limit]
    chosen = chosen[hierarchy.area[chosen] >= 4.0 * state.smallest]
    room = (_most_elements(len(state.patches), state.settings.memory_limit) - len(state.leaves)) // 3
    if len(chosen) > room:
        order = np.argsort(-differing[chosen], kind="stable")
        chosen = np.sort(chosen[order[: max(room, 0)]])
    kept = ~np.isin(state.leaves, chosen)
    before = hierarchy.n_elements
    hierarchy.subdivide(chosen)
    state.factors = state.factors[kept]
    state.link_lights_to_leaves()
    # Until they have their own, children have their parents' values.
    parents = hierarchy.parent[before:]
    state.radiosity = np.concatenate([state.radiosity, state.radiosity[parents]])
    state.irradiance = np.concatenate([state.irradiance, state.irradiance[parents]])
    return np.arange(before, hierarchy.n_elements)


def _start_comparing(state: TwoLevelState) -> None:
    """Fix the limit of differences before subdivision changes the light it is measured by."""
    hierarchy, leaves = state.hierarchy, state.leaves
    area = hierarchy.area[leaves]
    mean = area @ (state.reflectance[leaves] * state.irradiance[leaves]) / area.sum()
    state.limit = state.settings.contrast * float(mean.max())
    state.smallest = MIN_ELEMENT_SHARE * float(area.mean())


def _finish(state: TwoLevelState) -> None:
    """Add the remaining differences to the report."""
    _, difference = contrasts(state)
    state.details["two_level"] |= {
        "limit_W_m2": state.limit,
        "neighbours_above_limit": int((difference > state.limit).sum()),
    }


def _emission(state: TwoLevelState) -> Array:
    """Return (m, 3) E' = E + ρ H_direct of the patches [W/m²]."""
    direct = _over_patches(state, state.direct()[state.leaves])
    return np.asarray(state.emission[state.patches] + state.reflectance[state.patches] * direct)


def _over_patches(state: TwoLevelState, values: Array) -> Array:
    """Return (m, k) the area means over patches of (l, k) values of elements."""
    area = state.hierarchy.area
    order = np.argsort(state.patch_of, kind="stable")
    first = np.searchsorted(state.patch_of[order], np.arange(len(state.patches)))
    weight = area[state.leaves[order]] / area[state.patches[state.patch_of[order]]]
    means = np.empty((len(state.patches), values.shape[1]))
    for column in range(values.shape[1]):  # one at a time: the matrix must not be copied
        means[:, column] = np.add.reduceat(values[order, column] * weight, first)
    return means


def _patch_of(state: TwoLevelState) -> Array:
    """Return (l,) the row of each leaf's patch."""
    hierarchy = state.hierarchy
    row = np.full(hierarchy.n_elements, -1, dtype=np.int64)
    row[state.patches] = np.arange(len(state.patches))
    above = state.leaves.copy()
    while True:
        below = np.flatnonzero(row[above] < 0)
        if len(below) == 0:
            return np.asarray(row[above])
        above[below] = hierarchy.parent[above[below]]
        assert (above != LEAF).all()  # patches tile the faces


def _most_elements(patches: int, memory_limit: float) -> int:
    """Return how many elements' rows fit into the limit next to the patches' own matrices.

    Rows are held twice while others are added to them.
    """
    room = memory_limit * 2**30 - 3 * 8 * patches**2
    return int(max(room, 0.0) / (2 * 8 * patches))


def refuse_large_matrix(faces: int, settings: SolverSettings) -> None:
    """Refuse, before anything is allocated, a system that does not fit into the memory limit.

    Faces are the least that patches and elements can be.
    """
    elements = max(faces, settings.elements)
    patches = max(faces, min(settings.patches, settings.elements))
    what = f"two-level with {elements} elements and {patches} patches"
    instead = "the method hierarchical, or shooting, which needs no matrix"
    advice = f"use fewer elements or patches, or take {instead}"
    refuse_beyond(settings.memory_limit, 8 * (2 * elements * patches + 3 * patches**2), what, advice)
