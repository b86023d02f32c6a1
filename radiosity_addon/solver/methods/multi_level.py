"""The multi-level hierarchy: refine by form factors, then iterate (handout §4.2).

BasicHierarchicalRad(F_ε): every face is the root of a quadtree; RefinePatch links every
ordered pair of faces, or of elements below them, as Oracle1 decides; then Gather and
PushPull alternate until the residual is small. There is no matrix, and nothing is refined
for the light that flows: `hierarchical` does that.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array
from ...scene import Scene, shares
from ..equations import RefinePatch, exchange_areas, source_factor_bounds
from ..hierarchy import Hierarchy
from ..links import Links, elements_by_level, leaves_by_level, links_by_level, no_links
from ..settings import SolverSettings
from ..state import SolverState, begin, bounce, link_closure, refuse_beyond

PAIR_BYTES = 64
"""Memory a pair takes while it is refined, measured and sorted."""

CHUNK = 1 << 18
"""Pairs measured between two reports of progress."""


@dataclass
class MultiLevelState(SolverState):
    """State of the multi-level hierarchy."""

    links: Links = field(default_factory=no_links)
    """In float64, with visibility in the factor: F_rs V_rs."""

    @property
    def n_links(self) -> int:
        """Links between elements, and from lamps."""
        return len(self.links) + len(self.light_links)

    def closure(self) -> Array:
        """Return (f,) the area mean over each face's leaves of ΣFV over own and inherited links."""
        return link_closure(self.hierarchy, self.links)


def solve(scene: Scene, settings: SolverSettings, progress: Progress = SILENT) -> MultiLevelState:
    """Return the solved state; `progress` receives it on the way.

    Raises UsageError if the pairs of faces alone, before anything is refined, exceed the memory limit.
    """
    state = begin(scene, settings, MultiLevelState)
    hierarchy = state.hierarchy
    refuse_too_many_faces(len(hierarchy.faces), settings.memory_limit)
    progress.at(0.02, state)
    if not state.has_light:
        return state
    budget = min(settings.max_links, int(settings.memory_limit * 2**30 / PAIR_BYTES))
    min_area = settings.min_area * float(hierarchy.faces.area.sum())
    refinement = RefinePatch(hierarchy, settings.form_factor_error, min_area, budget)
    while refinement.generation():
        progress.at(0.1, state)
    state.reset()
    state.link_lights_to_leaves()
    progress.at(0.15, state)

    receiver, source = refinement.pairs()
    exchange = []
    unordered, of_pair = distinct_pairs(receiver, source, hierarchy.n_elements)
    for start in range(0, len(unordered), CHUNK):
        one, other = unordered[start : start + CHUNK].T
        exchange.append(exchange_areas(hierarchy, state.caster, one, other, settings.seed, settings.threads))
        progress.at(0.15 + 0.65 * start / len(unordered), state)
    state.links = link(hierarchy, receiver, source, np.concatenate([np.zeros(0), *exchange])[of_pair])
    add_details(state)
    state.note()
    progress.at(0.8, state)

    lights, scale = state.direct(), overlap_scale(hierarchy, state.links)
    while state.iterations < settings.max_iterations:
        bounce(state, state.links, lights, scale)
        state.note()
        if state.residual < settings.tolerance:
            break
        progress.at(0.8 + 0.2 * _converged(state), state)
    state.over_budget = power_over(state, refinement.unrefined)
    return state


def refuse_too_many_faces(count: int, memory_limit: float) -> None:
    """Refuse scenes whose initial pairs, O(k²) of k faces, do not fit into `memory_limit` GiB."""
    pairs = count * (count - 1)
    what = f"multi-level, which begins with {pairs:,} pairs of {count:,} faces,"
    advice = "use the method hierarchical, or raise the limit"
    refuse_beyond(memory_limit, pairs * PAIR_BYTES, what, advice)


def distinct_pairs(receiver: Array, source: Array, count: int) -> tuple[Array, Array]:
    """Return the (u, 2) unordered pairs among (l,) links of `count` elements, and (l,) each link's own."""
    low, high = np.minimum(receiver, source), np.maximum(receiver, source)
    keys, of_pair = np.unique(low.astype(np.int64) * count + high, return_inverse=True)
    return np.stack([keys // count, keys % count], axis=1), of_pair.reshape(-1)


def link(hierarchy: Hierarchy, receiver: Array, source: Array, exchange: Array) -> Links:
    """Make links of pairs (handout §4.2, Link), leaving out those that exchange nothing.

    receiver, source (n,) int: Elements, sorted by receiver.
    exchange (n,): A_r F_rs V_rs [m²].
    Returns links: float64; visibility 1 and error estimate 0, since F_rs V_rs is one number; equal quarters,
        as in the handout: all leaves below an element get the same share of its gathered light.
    """
    kept = exchange > 0
    receiver, source = receiver[kept].astype(np.int32), source[kept].astype(np.int32)
    count = len(receiver)
    whole, quarters = np.broadcast_to(1.0, count), np.broadcast_to(1.0, (count, 4))
    return Links(
        receiver,
        (hierarchy.n_clusters + source).astype(np.int32),
        exchange[kept] / hierarchy.area[receiver],
        whole,
        np.broadcast_to(0.0, count),
        quarters,
        quarters,
    )


def overlap_scale(hierarchy: Hierarchy, links: Links) -> Array | None:
    """Return (e, 2) factors on leaves' radiosity where faces coincide, or None.

    A leaf's ΣFV may rightly be half too large, inheriting its ancestors' means; that of a whole
    face may not.
    """
    scale = np.ones((hierarchy.n_elements, 2))
    of_face = shares(link_closure(hierarchy, links))
    scale[hierarchy.leaves] = of_face[hierarchy.face[hierarchy.leaves], None]
    return scale if (scale < 1.0).any() else None


def power_over(state: MultiLevelState, pairs: Array) -> float:
    """Return the largest power, relative to Φ, that (n, 2) pairs of receiver and source may carry.

    B_s A_s F_sr with the bound of Oracle1: what is misplaced at most where the budget of links
    kept a pair from being refined; 0 without pairs.
    """
    receiver, source = pairs.T
    bound = source_factor_bounds(state.hierarchy, receiver, source)
    sent = state.radiosity[source].max(axis=1, initial=0.0) * state.hierarchy.area[source]
    return float((sent * bound).max(initial=0.0)) / state.power


def add_details(state: MultiLevelState) -> None:
    """Add the elements and links per level to the report."""
    hierarchy, links = state.hierarchy, state.links
    state.details["multi_level"] = {
        "form_factor_error": state.settings.form_factor_error,
        "elements_by_level": elements_by_level(hierarchy),
        "leaves_by_level": leaves_by_level(hierarchy),
        "links_by_level": links_by_level(hierarchy, links.receiver, links.source),
    }


def _converged(state: MultiLevelState) -> float:
    """Return the progress of the residual toward the tolerance, by its logarithm."""
    goal = np.log(max(state.settings.tolerance, 1e-16))
    return float(np.clip(np.log(max(state.residual, 1e-300)) / goal, 0.0, 1.0)) if goal < 0 else 1.0
