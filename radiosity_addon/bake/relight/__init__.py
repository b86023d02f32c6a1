"""A kept bake: its lightmaps for other strengths of its lights, without rays; light groups.

Also digests that tell whether a scene is still the one that was baked.
"""

from __future__ import annotations

from .kept_bake import (
    DAMAGED,
    HierarchyReport,
    IncrementalState,
    KeptBake,
    damaged,
    differs_in_strength_alone,
    relight_pages,
    same_light,
    shown,
)
from .light_groups import are_wanted, check_groups, group_of, group_pages
from .responses import Responses
from .scene_digest import as_scene_digests, check_same, scene_digests
from .source_strengths import strengths_in

__all__ = [
    "DAMAGED",
    "HierarchyReport",
    "IncrementalState",
    "KeptBake",
    "Responses",
    "are_wanted",
    "as_scene_digests",
    "check_groups",
    "check_same",
    "damaged",
    "differs_in_strength_alone",
    "group_of",
    "group_pages",
    "relight_pages",
    "same_light",
    "scene_digests",
    "shown",
    "strengths_in",
]
