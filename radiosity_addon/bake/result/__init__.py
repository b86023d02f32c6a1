"""What a bake yields: pages, objects, details for overlays, progress, the report.

Plain records and files, nothing that bakes.
"""

from __future__ import annotations

from .details import MEANS, More, baked_with_figures, more_of, statistics
from .history_plot import write_history
from .pictures import Picture, TexelPicture, TexelSurfaces
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
    "More",
    "PageDetails",
    "Picture",
    "TexelPicture",
    "TexelPictures",
    "TexelSurfaces",
    "baked_with_figures",
    "more_of",
    "solver_part",
    "statistics",
    "write_history",
]
