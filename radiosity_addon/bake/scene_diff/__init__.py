"""Two exports of a scene compared: what differs between them, part by part.

Plans of bakes, relighting, Live and sidecars all ask here.
"""

from __future__ import annotations

from .diff import RELIGHTABLE, Part, SceneDiff, compare
from .light_summary import LightSummary, as_light_summaries, changed_lights, light_summaries
from .lights import aligned, dark, differs_in_strength_alone
from .record import (
    OF_NO_CONSEQUENCE,
    SceneRecord,
    as_object_records,
    light_digest,
    rounded_digest,
    scene_record,
)

__all__ = [
    "OF_NO_CONSEQUENCE",
    "RELIGHTABLE",
    "LightSummary",
    "Part",
    "SceneDiff",
    "SceneRecord",
    "aligned",
    "as_light_summaries",
    "as_object_records",
    "changed_lights",
    "compare",
    "dark",
    "differs_in_strength_alone",
    "light_digest",
    "light_summaries",
    "rounded_digest",
    "scene_record",
]
