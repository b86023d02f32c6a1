"""The buttons *Relight* and *Live*, wherever they are drawn."""

from __future__ import annotations

from typing import Any

import bpy

from ..relight import kept_bakes


def draw_relight_buttons(layout: Any, context: bpy.types.Context) -> None:
    """Draw both side by side, where the scene shows a bake that was kept."""
    if not kept_bakes.mark_of(context.scene):
        return
    row = layout.row(align=True)
    row.operator("radiosity.relight", icon="OUTLINER_OB_LIGHT")
    row.prop(context.window_manager, "radiosity_live", toggle=True, icon="REC")
