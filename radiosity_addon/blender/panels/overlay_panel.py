"""The section *Overlays*, and the same in the popover *Overlays* of the 3D viewport."""

from __future__ import annotations

from typing import Any

import bpy

from ..operators.panel_facts import light_on_active, overlay_message
from ..overlays import overlay_properties as kinds
from ..overlays.overlay_properties import overlay_of
from ..session.state import session
from .sections import Section
from .wrapped_text import draw_text

_SETTINGS = {
    kinds.FALSE_COLOR: ("unit",),
    kinds.CHECKER: ("squares",),
    kinds.LINKS: ("links_of", "most_links"),
    kinds.ERROR: ("error_of",),
}

POPOVER_WIDTH = 260


class OverlaySection(Section):
    """Overlays, and figures of the active object."""

    name = "radiosity_overlays"
    label = "Overlays"

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw the overlay's settings, and numbers of the active object."""
        settings = overlay_of(context)
        if not draw_overlay_settings(layout, context, None):
            return
        kept = session.kept_details.get(context.scene.name_full)
        if settings.show in kinds.OF_THE_BAKE and kept is not None:
            layout.label(text=f"{kept.megabytes:.1f} MiB in memory", icon="MEMORY", translate=False)
        if settings.show == kinds.FALSE_COLOR:
            _draw_statistics(layout, context)


class RADIOSITY_PT_overlay(bpy.types.Panel):
    """The overlay among Blender's own."""

    bl_idname = "RADIOSITY_PT_overlay"
    bl_label = "Radiosity"
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_parent_id = "VIEW3D_PT_overlay"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the overlay's settings."""
        layout = self.layout
        layout.active = context.space_data.overlay.show_overlays
        draw_overlay_settings(layout, context, POPOVER_WIDTH)


def draw_overlay_settings(layout: Any, context: bpy.types.Context, width: float | None) -> bool:
    """Draw the choice and its settings; False where the overlay cannot be shown, which is then explained."""
    layout.use_property_split, layout.use_property_decorate = True, False
    settings = overlay_of(context)
    layout.prop(settings, "show")
    if settings.show == kinds.NONE:
        return False
    reason = overlay_message(context)
    if reason:
        draw_text(layout.box(), reason, "INFO", context, width)
        return False
    column = layout.column()
    for name in _SETTINGS.get(settings.show, ()):
        column.prop(settings, name)
    if settings.show == kinds.FALSE_COLOR and settings.unit == "LUX":
        column.prop(settings, "efficacy")
    if settings.show not in (kinds.CHECKER, kinds.TEXELS, kinds.ELEMENTS):
        column = layout.column()
        column.prop(settings, "automatic")
        by_hand = column.column(align=True)
        by_hand.enabled = not settings.automatic
        by_hand.prop(settings, "low")
        by_hand.prop(settings, "high")
    return True


def _draw_statistics(layout: Any, context: bpy.types.Context) -> None:
    """Draw the active object's numbers."""
    rows = light_on_active(context)
    if not rows or context.active_object is None:
        return
    column = layout.column(align=True)
    column.label(text=context.active_object.name, icon="OBJECT_DATA", translate=False)
    for name, text in rows:
        split = column.split(factor=0.45)
        split.label(text=name)
        split.label(text=text, translate=False)


CLASSES = (RADIOSITY_PT_overlay,)
