"""Light at any point of a solved scene: direct light with soft shadows, and rays that gather the rest.

Also the residual, and rays traced again after something moved.
"""

from __future__ import annotations

from .boxes import Boxes
from .bright_patches import AimedRays
from .direct_light import DirectLight, LightQuery
from .element_cells import ElementCells
from .element_lookup import ElementLookup
from .final_gather import MOST_TINT, GatheredHits
from .footprints import Footprints
from .gather_rays import Gather
from .hit_numbers import NOTHING, UNNUMBERED, Resolver, lowest_number, table_end, values_of
from .light_gains import CompactGains, LightGains, alike
from .local_pass import LocalPass
from .lone_shadows import part_of_rays
from .residual import Residual
from .retracing import Before, MovedGeometry
from .run_gains import MOST_RUNS, RunGains, joined_gains

__all__ = [
    "MOST_RUNS",
    "MOST_TINT",
    "NOTHING",
    "UNNUMBERED",
    "AimedRays",
    "Before",
    "Boxes",
    "CompactGains",
    "DirectLight",
    "ElementCells",
    "ElementLookup",
    "Footprints",
    "Gather",
    "GatheredHits",
    "LightGains",
    "LightQuery",
    "LocalPass",
    "MovedGeometry",
    "Residual",
    "Resolver",
    "RunGains",
    "alike",
    "joined_gains",
    "lowest_number",
    "part_of_rays",
    "table_end",
    "values_of",
]
