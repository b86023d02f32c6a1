"""Light at any point of a solved scene: direct light with soft shadows, and rays that gather the rest.

Also the residual, and rays traced again after something moved.
"""

from __future__ import annotations

from .boxes import Boxes
from .bright_patches import AimedRays
from .final_gather import NOTHING, Gathered, Resolver
from .footprints import Footprints
from .light_gains import LightGains
from .local_pass import LightQuery, LocalPass, values_of
from .residual import Residual
from .retracing import STALE, Before, Moved

__all__ = [
    "NOTHING",
    "STALE",
    "AimedRays",
    "Before",
    "Boxes",
    "Footprints",
    "Gathered",
    "LightGains",
    "LightQuery",
    "LocalPass",
    "Moved",
    "Residual",
    "Resolver",
    "values_of",
]
