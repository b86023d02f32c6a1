"""Refined hierarchical radiosity: refine and iterate in turn (handout §4.2.1).

HierarchicalRad: link the lights, link every face coarsely to the roots of the cluster
tree, then alternate Gather and PushPull with RefineLink while BF_ε falls, until no link is
refined and the residual is small.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array
from ...scene import Scene
from ..balance import Conservation, received_by_faces
from ..hierarchy import ClusterCut, NodeShapes
from ..links import (
    ClusterLinks,
    Links,
    children_of_cluster_links,
    children_of_links,
    elements_by_level,
    first_links,
    join,
    join_cluster_links,
    leaves_by_level,
    link_lights,
    linked_leaves,
    links_by_level,
    measure_cluster_links,
    measure_links,
    misplaced_at_clusters,
    misplaced_power,
    no_cluster_links,
    no_links,
)
from ..settings import SolverSettings
from ..state import (
    Anderson,
    SolverState,
    begin,
    bounce,
    link_budget,
    link_closure,
    most_light_elements,
    refinable,
    reflect,
    refuse_large_scene,
    relative_residual,
)

COARSENING = (64.0, 16.0, 4.0, 1.0)
"""BF_ε of the rounds, in units of the final one: start coarse, tighten (our addition)."""

ROUGH = 0.03
"""Residual of the rounds before the last one: enough to decide which links matter."""

MIN_REFINED_SHARE = 1e-3
"""A smaller share of refined links is not worth a gather: their children are evaluated before it, and
what else it would show is left to the next round, if there is one."""

LIGHT_SHARE = 0.25
"""BF_ε of light links, in units of the links': they are few, and every bounce starts with them."""


STALLED = 100
"""The iteration ends if the residual has not fallen by a tenth in this many iterations.

What a cluster's gradients take from faces below 0 is not taken (`bounce`): where few small faces shine into
each other, that keeps the residual from falling, or would let plain iteration grow."""


@dataclass
class HierarchicalState(SolverState):
    """State of the refined hierarchy."""

    STORED = ("settings", "hierarchy", "links", "cluster_links", "sent")

    links: Links = field(default_factory=no_links)
    """To elements, sorted by receiver."""
    cluster_links: ClusterLinks = field(default_factory=no_cluster_links)
    faint: float = 0.0
    """Above 0, initial links had to be coarser (see `first_links`)."""
    cut: ClusterCut | None = None
    """The clusters that the links use."""
    conservation: Conservation | None = None
    sent: Array | None = None
    """(e, 2) What leaves' radiosity is scaled with over links at the end (`Conservation.factors`)."""

    @property
    def n_links(self) -> int:
        """Links between elements and clusters, and from lamps."""
        return len(self.links) + len(self.cluster_links) + len(self.light_links)

    def linked_cut(self) -> ClusterCut:
        """Return the part of the cluster tree that the current links use."""
        links, cluster_links = self.links, self.cluster_links
        return ClusterCut(self.hierarchy, links.source, cluster_links.receiver, cluster_links.source)

    def closure(self) -> Array:
        """Return (f,) the area mean over each face's leaves of ΣFV over own and inherited links."""
        return link_closure(self.hierarchy, self.links, self.cluster_links)

    def balanced_closure(self) -> Array:
        """Return (f,) ΣFV of the light exchange at the end, scaled (see `conservation`)."""
        if self.sent is None or self.cut is None:
            return self.closure()
        return received_by_faces(self.hierarchy, self.cut, self.links, self.cluster_links, self.sent)


def solve(scene: Scene, settings: SolverSettings, progress: Progress = SILENT) -> HierarchicalState:
    """Return the solved state; `progress` receives it on the way.

    Raises UsageError if the scene does not fit into the memory limit; nothing is allocated then.
    """
    refuse_large_scene(scene, settings)
    state = begin(scene, settings, HierarchicalState)
    hierarchy, caster = state.hierarchy, state.caster
    min_area = settings.min_area * float(hierarchy.faces.area.sum())
    state.conservation = Conservation(caster, min_area, settings.seed, settings.threads)
    progress.at(0.02, state)
    if not state.has_light:
        return state
    light_threshold = LIGHT_SHARE * settings.error * state.power
    state.light_links = link_lights(
        hierarchy,
        scene.lights,
        caster,
        light_threshold,
        min_area,
        settings.seed,
        settings.threads,
        most_light_elements(hierarchy, settings),
    )
    state.keep_lamps_within_power()
    progress.at(0.2, state)
    shapes = NodeShapes(hierarchy)
    state.links, state.cluster_links, state.faint = first_links(
        hierarchy, shapes, caster, settings, link_budget(hierarchy, settings, len(state.light_links))
    )
    state.reset()
    progress.at(0.4, state)

    rounds: list[dict[str, float]] = []
    for done, coarsening in enumerate(COARSENING):
        error = coarsening * settings.error
        links_refined = 0
        while True:
            iterate(state, settings.tolerance if coarsening == 1.0 else ROUGH)
            refined = 0 if exhausted(state) else settle(state, shapes, error * state.power, min_area)
            links_refined += refined
            progress.at(0.4 + 0.55 * (done + 0.5) / len(COARSENING), state)
            if not refined or (coarsening > 1.0 and refined <= MIN_REFINED_SHARE * state.n_links):
                break
        rounds.append({"error": error, "links_refined": links_refined, "links": len(state.links)})
    iterate(state, settings.tolerance, last=True)
    add_details(state, rounds)
    hierarchy.clusters.forget_shapes()
    if state.cut is not None:
        state.cut.kept = None  # as large as the links, and quickly made again
    return state


def settle(state: HierarchicalState, shapes: NodeShapes, threshold: float, min_area: float) -> int:
    """Refine links, and the children of few links too, by the current radiosity; return how many."""
    total = 0
    while True:
        refined = refine(state, shapes, threshold, min_area)
        total += refined
        if refined == 0 or refined > MIN_REFINED_SHARE * state.n_links:
            return total
        state.cut = state.linked_cut()


def refine(state: HierarchicalState, shapes: NodeShapes, threshold: float, min_area: float) -> int:
    """Replace every link that may misplace more than `threshold` watts; return how many.

    Links to clusters come first, as theirs may become links to elements.
    """
    hierarchy, settings = state.hierarchy, state.settings
    seed, threads = settings.seed, settings.threads
    chosen = _over(
        state, misplaced_at_clusters(hierarchy, state.cluster_links, state.radiosity, state.cut), threshold
    )
    refined = len(chosen)
    new: list[Links] = []
    if refined:
        receiver, source = children_of_cluster_links(hierarchy, state.cluster_links.take(chosen))
        single = receiver >= hierarchy.n_clusters
        to_element = receiver[single] - hierarchy.n_clusters
        new.append(measure_links(hierarchy, state.caster, to_element, source[single], seed, threads))
        others = measure_cluster_links(
            hierarchy, shapes, state.caster, receiver[~single], source[~single], seed, threads
        )
        kept = np.delete(np.arange(len(state.cluster_links)), chosen)
        state.cluster_links = join_cluster_links([state.cluster_links.take(kept), others])

    errors = misplaced_power(hierarchy, state.links, state.radiosity, state.cut)
    chosen = _over(state, errors, threshold)
    if len(chosen):
        before = hierarchy.n_elements
        receiver, source, replaced = children_of_links(hierarchy, state.links.take(chosen), min_area)
        new.append(measure_links(hierarchy, state.caster, receiver, source, seed, threads))
        kept = np.delete(np.arange(len(state.links)), chosen[replaced])
        state.links = state.links.take(kept)
        refined += int(replaced.sum())
        # Children start with their parent's radiosity; a batch only ever adds one level.
        parents = hierarchy.parent[before:]
        state.radiosity = np.concatenate([state.radiosity, state.radiosity[parents]])
        state.irradiance = np.concatenate([state.irradiance, state.irradiance[parents]])
    if new:
        state.links = join([state.links, *new]).sorted_by_receiver()
    return refined


def _over(state: HierarchicalState, errors: Array, threshold: float) -> Array:
    """Return the rows of the links above the threshold, the worst of them if the budget is short."""
    chosen = np.flatnonzero(errors > threshold)
    light_links = len(state.light_links)
    room = refinable(state.hierarchy, state.settings, state.n_links - light_links, light_links)
    if len(chosen) > room:
        order = np.argsort(errors[chosen], kind="stable")[::-1]
        left = float(errors[chosen[order[room:]]].max(initial=0.0)) / state.power
        state.over_budget = max(state.over_budget, left)
        chosen = np.sort(chosen[order[:room]])
    return chosen


def iterate(state: HierarchicalState, tolerance: float, last: bool = False) -> None:
    """Gather and push-pull, accelerated, until the residual is below `tolerance` or no longer falls.

    Each step yields the residual of the radiosity before it; that of the `last` one is measured
    for the radiosity that is left in the state.
    """
    hierarchy, links, cluster_links = state.hierarchy, state.links, state.cluster_links
    assert state.conservation is not None  # set when the state was made
    state.cut = state.sent = None  # as large as what replaces them
    lights = state.direct()
    state.cut = state.linked_cut()
    state.sent = state.conservation.factors(hierarchy, state.cut, links, cluster_links)
    cut, scale = state.cut, state.sent
    leaves = hierarchy.leaves
    mixer = Anderson(hierarchy.area[leaves])
    best, best_at = np.inf, state.iterations
    while not exhausted(state):
        before = state.radiosity[leaves]
        bounce(state, links, lights, scale, cluster_links, cut)
        state.note()
        if state.residual < 0.9 * best:
            best, best_at = state.residual, state.iterations
        if state.residual < tolerance or exhausted(state) or state.iterations - best_at > STALLED:
            break
        # Values of a mixture below the emission are not radiosities.
        mixed = mixer.next(before, state.radiosity[leaves])
        del before
        state.radiosity[leaves] = np.maximum(mixed, state.emission[leaves])
        del mixed
    if last:
        _, after = reflect(state, links, lights, scale, cluster_links, cut)
        state.residual = relative_residual(state, after)
        state.history[-1:] = [replace(entry, residual=state.residual) for entry in state.history[-1:]]


def exhausted(state: HierarchicalState) -> bool:
    """Whether all allowed iterations are done; elements that are not lit by then may not be evaluated."""
    return state.iterations >= state.settings.max_iterations


def add_details(state: HierarchicalState, rounds: list[dict[str, float]]) -> None:
    """Add to the report how BF_ε fell, and the elements and links per level.

    rounds list of {"error", "links_refined", "links"}: For each BF_ε, as a share of the light's power: how
        many links were refined for it, and how many there were afterward.
    """
    hierarchy, links = state.hierarchy, state.links
    n_links = len(links) + len(state.cluster_links)
    state.details["hierarchical"] = {
        "rounds": rounds,
        "first_faint": state.faint,
        "closure": closure_figures(state),
        "links_per_leaf": n_links / max(linked_leaves(hierarchy, links, state.cluster_links), 1),
        "elements_by_level": elements_by_level(hierarchy),
        "leaves_by_level": leaves_by_level(hierarchy),
        "links_by_level": links_by_level(hierarchy, links.receiver, links.source),
    }


def closure_figures(state: HierarchicalState) -> dict[str, dict[str, float]]:
    """Return the deviation of ΣFV from 1 on lit faces from which nothing escapes.

    Of the "links" as they were measured, and "balanced", as their light was scaled: the area
    "mean", the root of the mean "square" of what is missing, and the share of the area that is
    more than a percent "off".
    """
    hierarchy = state.hierarchy
    faces = len(hierarchy.faces)
    assert state.conservation is not None  # set when the state was made
    held = state.conservation.closed(hierarchy) & (state.irradiance[:faces].max(axis=1) > 0)
    weight = hierarchy.faces.area * held
    weight /= max(float(weight.sum()), 1e-300)
    return {
        name: {
            "mean": float(weight @ sums),
            "rms": float(np.sqrt(weight @ (sums - 1.0) ** 2)),
            "off": float(weight @ (np.abs(sums - 1.0) > 0.01)),
        }
        for name, sums in (("links", state.closure()), ("balanced", state.balanced_closure()))
    }
