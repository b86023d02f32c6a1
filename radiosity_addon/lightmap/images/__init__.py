"""From texels to images: dilation, seams, encoding, statistics.

No rays, no solver.
"""

from __future__ import annotations

from .dilate import fill as fill_uncovered
from .encode import encode_png16, png16_scale, presentable, to_quantity
from .irradiance_statistics import LightStatistics, light_statistics, lit_texels
from .page import LightmapPage
from .page_assembly import texel_pages
from .seams import Seams, find_seams
from .surface_tiles import SurfaceTiles, lay_out_again, lay_out_surfaces

__all__ = [
    "LightStatistics",
    "LightmapPage",
    "Seams",
    "SurfaceTiles",
    "encode_png16",
    "fill_uncovered",
    "find_seams",
    "lay_out_again",
    "lay_out_surfaces",
    "light_statistics",
    "lit_texels",
    "png16_scale",
    "presentable",
    "texel_pages",
    "to_quantity",
]
