"""The section *Overlays*: what to draw over the objects, and the light on the active object in numbers."""

from __future__ import annotations

from typing import Any

import bpy

from ..overlays import overlay_properties as kinds
from ..overlays.overlay_properties import overlay_of
from ..session.kept_details import details_of
from .sections import Section
from .wrapped_text import draw_text

_SETTINGS = {
    kinds.FALSE_COLOR: ("unit",),
    kinds.CHECKER: ("squares",),
    kinds.LINKS: ("links_of", "most_links"),
    kinds.ERROR: ("error_of",),
}


class OverlaySection(Section):
    """What is drawn over the objects."""

    name = "radiosity_overlays"
    label = "Overlays"

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw the choice, what belongs to it, and numbers of the active object."""
        from ..overlays.overlay_pictures import missing

        layout.use_property_split = True
        settings = overlay_of(context)
        layout.prop(settings, "show")
        reason = missing(context)
        if reason:
            draw_text(layout.box(), reason, "INFO", context)
            return
        column = layout.column()
        for name in _SETTINGS.get(settings.show, ()):
            column.prop(settings, name)
        if settings.show == kinds.FALSE_COLOR and settings.unit == "LUX":
            column.prop(settings, "efficacy")
        if settings.show not in (kinds.NONE, kinds.CHECKER, kinds.TEXELS, kinds.ELEMENTS):
            column = layout.column()
            column.prop(settings, "automatic")
            by_hand = column.column(align=True)
            by_hand.enabled = not settings.automatic
            by_hand.prop(settings, "low")
            by_hand.prop(settings, "high")
        kept = details_of(context.scene)
        if settings.show in kinds.OF_THE_BAKE and kept is not None:
            text = f"{kept.details.nbytes / 2**20:.1f} MiB in memory"
            layout.label(text=text, icon="MEMORY", translate=False)
        if settings.show == kinds.FALSE_COLOR:
            _draw_statistics(layout, context)


def _draw_statistics(layout: Any, context: bpy.types.Context) -> None:
    """Draw the active object's numbers."""
    from ..overlays.lightmap_values import lightmap_of, object_statistics

    obj, settings = context.active_object, overlay_of(context)
    if obj is None or lightmap_of(obj) is None:
        return
    found = object_statistics(obj, context.scene, settings.unit, settings.efficacy)
    if found is None:
        return
    of, unit = found
    column = layout.column(align=True)
    column.label(text=obj.name, icon="OBJECT_DATA")
    uniformity = "–" if of.uniformity is None else f"{of.uniformity:.2f}"
    for name, text in (
        ("Minimum", f"{of.minimum:.4g} {unit}"),
        ("Mean", f"{of.mean:.4g} {unit}"),
        ("Maximum", f"{of.maximum:.4g} {unit}"),
        ("Uniformity", uniformity),
    ):
        split = column.split(factor=0.45)
        split.label(text=name)
        split.label(text=text)
