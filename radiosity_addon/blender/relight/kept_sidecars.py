"""Whether a scene's bake can be relit: in memory, or from the sidecar next to its lightmaps."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...files import FileNames
from ..files.lightmap_reports import bake_kept_by, report_of
from . import kept_bakes

NO_BAKE = "the scene shows no kept bake: bake with Keep for Relighting"
NO_DATA = "the bake is no longer in memory and has no sidecar: bake again"


def sidecar_of(mark: str) -> Path | None:
    """Return the sidecar next to a bake's lightmaps, if there is one."""
    images = kept_bakes.images_of(mark)
    if not images or images[min(images)].packed_file is not None:
        return None
    report = report_of(images[min(images)])
    path = report.with_name(FileNames.of_report(report.name).sidecar)
    return path if path.is_file() else None


def why_not_relit(scene: bpy.types.Scene) -> str:
    """Return why the scene's bake cannot be relit; empty if it is in memory or in a sidecar of its own."""
    mark = kept_bakes.mark_of(scene)
    if not mark:
        return NO_BAKE
    if kept_bakes.find(scene) is not None:
        return ""
    if sidecar_of(mark) is None:
        return NO_DATA
    images = kept_bakes.images_of(mark)
    return "" if bake_kept_by(report_of(images[min(images)])) in ("", mark) else NO_DATA
