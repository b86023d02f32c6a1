"""Light at texels: direct light, gather points, and sweeps along stored hits.

Needs a solved scene; traces each ray once.
"""

from __future__ import annotations

from .accuracy import light_within
from .error_picture import residual_summary, texel_residual
from .gather_links import GatherLinks
from .gather_settings import GatherSettings
from .hit_table import HitTable, TableRows
from .partial_light import LightSoFar
from .reconstruction import STARTS, gather_at, gather_footprints, on_lattice, reconstruct, sample_of
from .relighting import kept_bytes, relight_texels
from .sub_cells import SubCellHits, SubCellLinks, SubCells, gather_sub_cells
from .sweeps import RelightableTexels, TexelLight, TexelTransport, sweep
from .traced_texels import GatherPointLayout, LightingRecord
from .warm_start import WarmStart

__all__ = [
    "STARTS",
    "GatherLinks",
    "GatherPointLayout",
    "GatherSettings",
    "HitTable",
    "LightSoFar",
    "LightingRecord",
    "RelightableTexels",
    "SubCellHits",
    "SubCellLinks",
    "SubCells",
    "TableRows",
    "TexelLight",
    "TexelTransport",
    "WarmStart",
    "gather_at",
    "gather_footprints",
    "gather_sub_cells",
    "kept_bytes",
    "light_within",
    "on_lattice",
    "reconstruct",
    "relight_texels",
    "residual_summary",
    "sample_of",
    "sweep",
    "texel_residual",
]
