"""Redraw viewports and sidebars."""

from __future__ import annotations

import bpy


def redraw_viewports() -> None:
    """Have every 3D viewport drawn again."""
    _tag("WINDOW")


def redraw_sidebars() -> None:
    """Have the panel drawn again in every 3D viewport."""
    _tag("UI")


def _tag(kind: str) -> None:
    manager = bpy.context.window_manager
    for window in manager.windows if manager is not None else ():
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == kind:
                        region.tag_redraw()
