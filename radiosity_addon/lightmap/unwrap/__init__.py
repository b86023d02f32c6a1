"""Lightmap UVs: charts packed into pages.

Our own packer; see `docs/decisions/0005-our-own-packer.md`.
"""

from __future__ import annotations

from .atlas import Atlas, AtlasInput, AtlasOptions, build_atlas
from .dominant_object import greedy_object, share_of
from .packing import Limits, padding_for
from .page_assignment import assign_pages, least_pages

__all__ = [
    "Atlas",
    "AtlasInput",
    "AtlasOptions",
    "Limits",
    "assign_pages",
    "build_atlas",
    "greedy_object",
    "least_pages",
    "padding_for",
    "share_of",
]
