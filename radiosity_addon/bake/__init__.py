"""The bake: unwrap, rasterize, solve, light the texels, encode. Plain arrays, no Blender.

`pipeline.py` reads as prose.
"""

from __future__ import annotations

from .estimate import Estimate, LightmappedObject, estimate_bake
from .keep import KeepOptions, can_keep, moves_alone, run_pipeline
from .stages import timed
from .texel_memory import pages_of, refuse_too_large

__all__ = [
    "Estimate",
    "KeepOptions",
    "LightmappedObject",
    "can_keep",
    "estimate_bake",
    "moves_alone",
    "pages_of",
    "refuse_too_large",
    "run_pipeline",
    "timed",
]
