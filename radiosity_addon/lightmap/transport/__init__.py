"""How light gets from texel to texel: gather points, stored hits, and sweeps along them.

Each ray is traced once.
"""

from __future__ import annotations

from .gather_links import GatherLinks
from .gather_points import STARTS, KeptPoints, gather_footprints, gather_texels, sample_of
from .gather_settings import GatherSettings
from .hit_table import HitTable, TableRows
from .more_rays import with_more_rays
from .ray_runs import number_of_points
from .sub_cells import SubCellHits, SubCellLinks, SubCells, gather_sub_cells
from .sweeps import (
    RelightableTexels,
    SmoothingChoice,
    TexelLight,
    TexelTransport,
    estimated_noise,
    relative_error,
    sweep,
)
from .traced_texels import GatherPointLayout, LightingRecord
from .warm_start import WarmStart

__all__ = [
    "STARTS",
    "GatherLinks",
    "GatherPointLayout",
    "GatherSettings",
    "HitTable",
    "KeptPoints",
    "LightingRecord",
    "RelightableTexels",
    "SmoothingChoice",
    "SubCellHits",
    "SubCellLinks",
    "SubCells",
    "TableRows",
    "TexelLight",
    "TexelTransport",
    "WarmStart",
    "estimated_noise",
    "gather_footprints",
    "gather_sub_cells",
    "gather_texels",
    "number_of_points",
    "relative_error",
    "sample_of",
    "sweep",
    "with_more_rays",
]
