"""Lightmap UVs: charts packed into pages.

Our own packer; see `docs/decisions/0005-our-own-packer.md`.
"""

from __future__ import annotations

from .atlas import Atlas, AtlasObject, build_atlas
from .atlas_input import AtlasInput, AtlasOptions
from .dominant_object import greedy_object, share_of
from .level_uvs import uvs_of_level
from .packing import Limits, padding_for, page_size
from .page_assignment import ChartTotals, assign_pages

__all__ = [
    "Atlas",
    "AtlasInput",
    "AtlasObject",
    "AtlasOptions",
    "ChartTotals",
    "Limits",
    "assign_pages",
    "build_atlas",
    "greedy_object",
    "padding_for",
    "page_size",
    "share_of",
    "uvs_of_level",
]
