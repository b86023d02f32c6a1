"""Texels: their triangles, positions and materials, and the geometry that divides them.

No light yet.
"""

from __future__ import annotations

from .cells import TexelCells
from .occlusion import CORNERS, Crossings, below_hood, find_crossings
from .rasterization import FOOTPRINT, coverage_sum, rasterize
from .shared_texels import is_collapsed, texel_areas
from .states import DIVIDED, ENCLOSED, NO_TEXEL_HERE, OCCLUDED, TOUCHED
from .surface_materials import texel_materials
from .terminator import SmoothLift
from .texel_geometry import NO_TEXEL, TexelGeometry
from .uneven import uneven_texels

__all__ = [
    "CORNERS",
    "DIVIDED",
    "ENCLOSED",
    "FOOTPRINT",
    "NO_TEXEL",
    "NO_TEXEL_HERE",
    "OCCLUDED",
    "TOUCHED",
    "Crossings",
    "SmoothLift",
    "TexelCells",
    "TexelGeometry",
    "below_hood",
    "coverage_sum",
    "find_crossings",
    "is_collapsed",
    "rasterize",
    "texel_areas",
    "texel_materials",
    "uneven_texels",
]
