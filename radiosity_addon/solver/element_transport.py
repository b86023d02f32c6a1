"""The hierarchy's links, kept to solve them again for other light without tracing a ray.

Links, and what keeps their light conserved, are of geometry and reflectance alone; only how finely the
hierarchy was refined, and where, came from the light that it was solved for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np

from ..base import UsageError
from ..lights import Emitter, Light
from ..numerics import Array
from .emitters import LightSources
from .gather import LocalPass, part_of_rays
from .links import LightLinks, join_light_links, link_lights
from .methods import HierarchicalState
from .state import Anderson, SolverState, bounce

MAX_ITERATIONS = 100
"""At most: accelerated, a digit takes some three."""

MAX_LINKED = 1 << 30
"""Lamps are never many."""

NO_LIGHT = -1
"""What stands for a group in the place of a light's number."""


@dataclass
class _Relit(HierarchicalState):
    """A solved state with another emission."""

    own_emission: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(e, 3) float64 [W/m²]"""

    @property
    def emission(self) -> Array:
        """(e, 3) float64: own emission of every element [W/m²]."""
        return self.own_emission


@dataclass(frozen=True, eq=False)
class ElementTransport:
    """How light gets from the sources to the elements, and from element to element.

    Attributes
    ----------
    state : HierarchicalState
        What was solved.
    sources : LightSources
    light_links : LightLinks
        From all lights, dark ones too, as they could be lit; of many lamps none: what these bring elements is
        known from the points that are on them.
    """

    state: HierarchicalState
    sources: LightSources
    light_links: LightLinks

    @staticmethod
    def of(state: SolverState, sources: LightSources, many: bool = False) -> ElementTransport:
        """Link lamps that were dark as well; if they are `many`, none of them.

        Raises
        ------
        UsageError
            If another method than the refined hierarchy solved it.
        """
        if not isinstance(state, HierarchicalState):
            raise UsageError(
                f"the {state.settings.method} method keeps no links for relighting; "
                "use the hierarchical method"
            )
        hierarchy, settings = state.hierarchy, state.settings
        # Lamps that were dark have no links yet; elements stay as they are for them.
        dark = np.array([not light.strength.any() for light in sources.lights], dtype=bool)
        linked = np.bincount(state.light_links.light, minlength=len(dark)) > 0
        missing = dark | ~linked
        links = state.light_links
        if many:
            lamps = np.array([isinstance(light, Emitter) for light in sources.lights], dtype=bool)
            missing &= ~lamps
            links = links.take(~lamps[links.light])
        further = link_lights(
            hierarchy,
            sources.lights,
            state.caster,
            0.0,
            np.inf,
            settings.seed,
            settings.threads,
            as_if=missing.astype(np.float64),
        )
        return ElementTransport(state, sources, join_light_links(links, further))

    @property
    def unlinked(self) -> Array:
        """(l,) bool: the lights without links to elements."""
        return np.bincount(self.light_links.light, minlength=len(self.sources.lights)) == 0

    def irradiance(self, strengths: Array, more: Array | None = None) -> Array:
        """Solve for (s, 3) strengths of the sources: (e, 3) area means over every element [W/m²].

        more (e, 3): What lights without links bring the leaves [W/m²].
        """
        state, hierarchy = self.state, self.state.hierarchy
        triangle = hierarchy.faces.triangle[hierarchy.face]
        emission = self.sources.emission(hierarchy.emission, triangle, strengths)
        own = {entry.name: getattr(state, entry.name) for entry in fields(HierarchicalState)}
        relit = _Relit(**{**own, "history": [], "own_emission": emission, "iterations": 0})
        relit.reset()
        given = strengths[: len(self.sources.lights)]
        lights = self.light_links.at_leaves(hierarchy, given)
        lights = lights if more is None else lights + more
        leaves = hierarchy.leaves
        area = hierarchy.area[leaves]
        entering = emission[leaves] + hierarchy.reflectance[leaves] * lights[leaves]
        relit.power = float((area @ entering).max(initial=0.0))
        if relit.power <= 0.0:
            relit.irradiance = lights
            return lights
        least, mixer = emission[leaves], Anderson(area)
        for _ in range(MAX_ITERATIONS):
            before = relit.radiosity[leaves]
            bounce(relit, state.links, lights, state.sent, relit.cluster_links, relit.cut)
            if relit.residual < state.settings.tolerance:
                break
            relit.radiosity[leaves] = np.maximum(mixer.next(before, relit.radiosity[leaves]), least)
        return relit.irradiance


@dataclass(frozen=True, eq=False)
class Relightable:
    """A solved scene that can be relit.

    Attributes
    ----------
    sources : LightSources
    elements : ElementTransport
    local : LocalPass
        Asks for every light apart.
    """

    sources: LightSources
    elements: ElementTransport
    local: LocalPass

    @staticmethod
    def of(
        state: SolverState,
        emitter: Array | None = None,
        lights: Sequence[Light] | None = None,
        most: int = MAX_LINKED,
    ) -> Relightable:
        """Keep a state; `emitter` as for `LightSources`, errors as of `ElementTransport.of`.

        lights: The scene's, if it was solved with groups of them.
        most: More lamps than these are many: they have no links, and share rays.
        """
        lights = state.scene.lights if lights is None else lights
        lamps = sum(isinstance(light, Emitter) for light in lights)
        many = lamps > most
        if many:
            state = _apart(state, lights)
        sources = LightSources(state.scene, state.hierarchy.faces, state.caster, emitter)
        elements = ElementTransport.of(state, sources, many)
        part = part_of_rays(lamps, most) if many else 0.0
        return Relightable(sources, elements, LocalPass.of(state, sources, part))


def _apart(state: SolverState, lights: Sequence[Light]) -> SolverState:
    """Return a state with its scene's lights as they are, and the links of those that are in no group."""
    number = {id(light): row for row, light in enumerate(lights)}
    rows = np.array([number.get(id(light), NO_LIGHT) for light in state.scene.lights], dtype=np.int32)
    light = rows[state.light_links.light]
    links = replace(state.light_links, light=light).take(light != NO_LIGHT)
    return replace(state, scene=state.scene.with_lights(lights), light_links=links)
