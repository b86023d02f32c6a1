"""Redraw viewports and sidebars."""

from __future__ import annotations

import bpy


def redraw_viewports() -> None:
    """Have every 3D viewport drawn again."""
    manager = bpy.context.window_manager
    for window in manager.windows if manager is not None else ():
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "WINDOW":
                        region.tag_redraw()


def redraw_sidebars(context: bpy.types.Context) -> None:
    """Have the panel drawn again in every 3D viewport."""
    if context.window_manager is None:
        return
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
