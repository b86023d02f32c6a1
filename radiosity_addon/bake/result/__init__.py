"""What a bake yields: pages, objects, details for overlays, progress, the report.

Plain records and files, nothing that bakes.
"""

from __future__ import annotations

from .details import MEANS, More, more_of, statistics
from .progress import LitSurfaces, Picture, Progress, TexelPicture
from .report import BakeReport, LightmapFile, solver_part
from .result import BakeDetails, BakedObject, BakeResult, LightGroup, PageDetails
from .texel_pictures import TexelPictures

__all__ = [
    "MEANS",
    "BakeDetails",
    "BakeReport",
    "BakeResult",
    "BakedObject",
    "LightGroup",
    "LightmapFile",
    "LitSurfaces",
    "More",
    "PageDetails",
    "Picture",
    "Progress",
    "TexelPicture",
    "TexelPictures",
    "more_of",
    "solver_part",
    "statistics",
]
