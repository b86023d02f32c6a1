"""The local pass over a solution: light at any point, of which elements are too coarse to show the detail."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...numerics import Array
from ...rays import RayCaster
from ..emitters import LightSources
from ..state import SolverState
from .direct_light import DirectLight
from .element_lookup import ElementLookup
from .gather_rays import Gather


@dataclass(frozen=True, eq=False)
class LocalPass:
    """What finds light at points of one solved scene.

    elements: What rays and points meet, with the solution's light.
    direct: Light straight from lamps and emissive surfaces.
    gather: Rays for the rest.
    """

    elements: ElementLookup
    direct: DirectLight
    gather: Gather

    @staticmethod
    def of(state: SolverState, sources: LightSources | None = None, part: float = 0.0) -> LocalPass:
        """Return that of a solved state; `sources` and `part` as for `DirectLight`."""
        elements = ElementLookup(state)
        return LocalPass(elements, DirectLight(state, sources, part), Gather(elements))

    @property
    def caster(self) -> RayCaster:
        """Casts this scene's rays."""
        return self.elements.caster

    @property
    def threads(self) -> int:
        """0 means all cores."""
        return self.elements.threads

    def with_irradiance(self, irradiance: Array) -> LocalPass:
        """Return the same with other light at the elements, (e, 3) [W/m²]."""
        state = replace(self.elements.state, irradiance=irradiance)
        return LocalPass.of(state, self.direct.sources, self.direct.part)
