"""A kept bake: its lightmaps for other strengths of its lights, without rays; light groups."""

from __future__ import annotations

from .kept_bake import (
    DAMAGED,
    HierarchyReport,
    IncrementalState,
    KeptBake,
    damaged,
    estimated_errors,
    held_values,
    noise_warnings,
    relight_pages,
)
from .light_groups import are_wanted, check_groups, group_of, group_pages
from .responses import Responses
from .source_strengths import strengths_in

__all__ = [
    "DAMAGED",
    "HierarchyReport",
    "IncrementalState",
    "KeptBake",
    "Responses",
    "are_wanted",
    "check_groups",
    "damaged",
    "estimated_errors",
    "group_of",
    "group_pages",
    "held_values",
    "noise_warnings",
    "relight_pages",
    "strengths_in",
]
