"""Texels: the triangle of each, its place in the world, what reflects there, what cuts it.

No light yet.
"""

from __future__ import annotations

from .cells import TexelCells
from .nearest_uncut import whole_neighbour
from .occlusion import LIFT, Crossings, below_hood, crossing_steps
from .rasterize import FOOTPRINT, coverage_sum, overlapping_pairs, rasterise
from .states import DIVIDED, HOODED, NO_TEXEL_HERE, SHUT_IN, TOUCHED
from .surface_materials import texel_materials
from .terminator import SmoothLift
from .texel_geometry import NO_TEXEL, TexelGeometry

__all__ = [
    "DIVIDED",
    "FOOTPRINT",
    "HOODED",
    "LIFT",
    "NO_TEXEL",
    "NO_TEXEL_HERE",
    "SHUT_IN",
    "TOUCHED",
    "Crossings",
    "SmoothLift",
    "TexelCells",
    "TexelGeometry",
    "below_hood",
    "coverage_sum",
    "crossing_steps",
    "overlapping_pairs",
    "rasterise",
    "texel_materials",
    "whole_neighbour",
]
