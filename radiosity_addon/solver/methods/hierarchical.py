"""Refined hierarchical radiosity: refine and iterate in turn (handout §4.2.1).

HierarchicalRad: link the lights, link every face coarsely to the roots of the cluster
tree, then alternate Gather and PushPull with RefineLink while BF_ε falls, until no link is
refined and the residual is small.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..arrays import Array
from ..conservation import Conservation
from ..embree import EmbreeCaster
from ..first_links import first_links
from ..hierarchy import Hierarchy
from ..light_links import LightLinks, light_strengths, link_lights, no_light_links
from ..links import Links, join, measure_links, no_links
from ..oracle import children_of_links, misplaced_power
from ..power import light_power
from ..scene import Scene
from ..settings import SolverSettings
from ..transport import gather, push, push_pull
from ..visibility import RayCaster

COARSENING = (64.0, 16.0, 4.0, 1.0)
"""BF_ε of the rounds, in units of the final one: start coarse, tighten (our addition)."""

LIGHT_SHARE = 0.25
"""BF_ε of light links, in units of the links': they are few, and every bounce starts with them."""

MAX_ITERATIONS = 1000


@dataclass
class HierarchicalState:
    """What the solver works on; complete when `solve_steps` is exhausted."""

    scene: Scene
    settings: SolverSettings
    hierarchy: Hierarchy
    caster: RayCaster
    light_links: LightLinks
    links: Links
    conservation: Conservation
    power: float
    """The light's power Φ [W], the largest channel: the unit of BF_ε."""
    irradiance: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(e, 3) float64: area means over every element [W/m²]."""
    radiosity: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(e, 3) float64 [W/m²]"""
    iterations: int = 0
    residual: float = 0.0
    """Σ A |E + ρ K B − B| over the leaves, relative to the light's power."""
    over_budget: float = 0.0
    """Largest misplaced power left unrefined for want of links, relative to Φ; 0 if none."""


def solve_steps(scene: Scene, settings: SolverSettings) -> Iterator[tuple[float, HierarchicalState]]:
    """Solve step by step: yields (fraction done, state) so that a caller may show or cancel.

    The last state yielded is the solution.
    """
    caster = EmbreeCaster(scene.triangles, settings.threads)
    hierarchy = Hierarchy(scene)
    state = HierarchicalState(
        scene=scene,
        settings=settings,
        hierarchy=hierarchy,
        caster=caster,
        light_links=no_light_links(),
        links=no_links(),
        conservation=Conservation(caster, settings.seed),
        power=light_power(scene, hierarchy.faces),
    )
    min_area = settings.min_area * float(hierarchy.faces.area.sum())
    yield 0.02, state
    if state.power == 0.0 or len(hierarchy.faces) == 0:
        _reset(state)
        yield 1.0, state
        return
    state.light_links = link_lights(
        hierarchy, scene.lights, caster, LIGHT_SHARE * settings.error * state.power, min_area, settings.seed
    )
    yield 0.1, state
    state.links = first_links(hierarchy, caster, settings)
    _reset(state)
    yield 0.3, state

    for done, coarsening in enumerate(COARSENING):
        threshold = coarsening * settings.error * state.power
        while True:
            iterate(state, settings.tolerance if coarsening == 1.0 else 0.03)
            refined = refine(state, threshold, min_area)
            yield 0.3 + 0.65 * (done + 0.5) / len(COARSENING), state
            if not refined:
                break
    iterate(state, settings.tolerance)
    yield 1.0, state


def refine(state: HierarchicalState, threshold: float, min_area: float) -> int:
    """Replace every link that may misplace more than `threshold` watts; return how many."""
    hierarchy, links = state.hierarchy, state.links
    errors = misplaced_power(hierarchy, links, state.radiosity)
    chosen = np.flatnonzero(errors > threshold)
    room = max((state.settings.max_links - len(links)) // 3, 0)
    if len(chosen) > room:
        order = np.argsort(errors[chosen], kind="stable")[::-1]
        state.over_budget = float(errors[chosen[order[room:]]].max(initial=0.0)) / state.power
        chosen = np.sort(chosen[order[:room]])
    if len(chosen) == 0:
        return 0
    before = hierarchy.n_elements
    candidates = links.take(chosen)
    receiver, source, replaced = children_of_links(hierarchy, candidates, min_area)
    if not replaced.any():
        return 0
    kept = np.ones(len(links), dtype=bool)
    kept[chosen[replaced]] = False
    settings = state.settings
    new = measure_links(hierarchy, state.caster, receiver, source, settings.seed, settings.threads)
    state.links = join([links.take(kept), new]).sorted_by_receiver()
    # Children start with their parent's radiosity; a batch only ever adds one level.
    parents = hierarchy.parent[before:]
    state.radiosity = np.concatenate([state.radiosity, state.radiosity[parents]])
    state.irradiance = np.concatenate([state.irradiance, state.irradiance[parents]])
    return int(replaced.sum())


def iterate(state: HierarchicalState, tolerance: float) -> None:
    """Gather and push-pull in Jacobi order until the residual is below `tolerance`."""
    hierarchy = state.hierarchy
    leaves = hierarchy.leaves
    area = hierarchy.area[leaves][:, None]
    reflectance = hierarchy.faces.reflectance[hierarchy.face]
    emission = hierarchy.faces.emission[hierarchy.face]
    lights = push(
        hierarchy,
        state.light_links.irradiance(light_strengths(state.scene.lights), hierarchy.n_elements),
    )
    scale = state.conservation.factors(hierarchy, state.links)
    for _ in range(MAX_ITERATIONS):
        gathered = push(hierarchy, gather(hierarchy, state.links, state.radiosity, scale))
        irradiance, radiosity = push_pull(hierarchy, lights, gathered, emission, reflectance)
        # One Jacobi step is the residual at the leaves: E + ρ K B − B.
        change = np.abs(radiosity[leaves] - state.radiosity[leaves])
        state.residual = float((area * change).sum(axis=0).max()) / state.power
        state.irradiance, state.radiosity = irradiance, radiosity
        state.iterations += 1
        if state.residual < tolerance:
            break


def _reset(state: HierarchicalState) -> None:
    """Start from what the surfaces emit themselves."""
    hierarchy = state.hierarchy
    state.irradiance = np.zeros((hierarchy.n_elements, 3))
    state.radiosity = hierarchy.faces.emission[hierarchy.face].copy()
