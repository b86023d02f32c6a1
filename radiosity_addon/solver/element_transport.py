"""The hierarchy's links, kept to solve them again for other light without tracing a ray.

Links, and what keeps their light conserved, are of geometry and reflectance alone; only how finely the
hierarchy was refined, and where, came from the light that it was solved for.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from ..base import UsageError
from ..numerics import Array
from .emitters import LightSources
from .gather import LocalPass
from .links import LightLinks, join_light_links, link_lights
from .methods import HierarchicalState
from .state import Anderson, SolverState, bounce

MAX_ITERATIONS = 100
"""At most: accelerated, a digit takes some three."""


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
        From all lights, dark ones too, as they could be lit.
    """

    state: HierarchicalState
    sources: LightSources
    light_links: LightLinks

    @staticmethod
    def of(state: SolverState, sources: LightSources) -> ElementTransport:
        """Link lamps that were dark as well.

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
        missing = (dark | ~linked).astype(np.float64)
        further = link_lights(
            hierarchy,
            sources.lights,
            state.caster,
            0.0,
            np.inf,
            settings.seed,
            settings.threads,
            as_if=missing,
        )
        return ElementTransport(state, sources, join_light_links(state.light_links, further))

    def irradiance(self, strengths: Array) -> Array:
        """Solve for (s, 3) strengths of the sources: (e, 3) area means over every element [W/m²]."""
        state, hierarchy = self.state, self.state.hierarchy
        triangle = hierarchy.faces.triangle[hierarchy.face]
        emission = self.sources.emission(hierarchy.emission, triangle, strengths)
        own = {entry.name: getattr(state, entry.name) for entry in fields(HierarchicalState)}
        relit = _Relit(**{**own, "history": [], "own_emission": emission, "iterations": 0})
        relit.reset()
        given = strengths[: len(self.sources.lights)]
        lights = self.light_links.at_leaves(hierarchy, given)
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
    def of(state: SolverState, emitter: Array | None = None) -> Relightable:
        """Keep a state; `emitter` as for `LightSources`, errors as of `ElementTransport.of`."""
        sources = LightSources(state.scene, state.hierarchy.faces, state.caster, emitter)
        return Relightable(sources, ElementTransport.of(state, sources), LocalPass.of(state, sources))
