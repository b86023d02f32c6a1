"""Emissive faces as lamps, and the sources of light whose strength can be changed alone.

From afar, many faces send like one rectangle.
"""

from __future__ import annotations

from .emitters import EmitterGroup
from .light_sources import NO_SOURCE, LightSources
from .textured_emitters import emitter_groups

__all__ = [
    "NO_SOURCE",
    "EmitterGroup",
    "LightSources",
    "emitter_groups",
]
