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
    relight,
    same_light,
    shown,
)
from .light_groups import are_wanted, check_groups, group_of, group_pages
from .responses import Responses
from .scene_digest import as_fingerprint, check_same, fingerprint
from .source_strengths import strengths_in

__all__ = [
    "DAMAGED",
    "HierarchyReport",
    "IncrementalState",
    "KeptBake",
    "Responses",
    "are_wanted",
    "as_fingerprint",
    "check_groups",
    "check_same",
    "damaged",
    "differs_in_strength_alone",
    "fingerprint",
    "group_of",
    "group_pages",
    "relight",
    "same_light",
    "shown",
    "strengths_in",
]
