"""The section *Relight*: the lights of a kept bake with their colors and strengths."""

from __future__ import annotations

from typing import Any

import bpy

from ..operators.panel_facts import LightRow, kept_lights
from .sections import Section


class RelightSection(Section):
    """Lights of the kept bake."""

    name = "radiosity_relight"
    label = "Relight"
    folded = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it while a bake is kept."""
        return bool(kept_lights(context)[0])

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw each light's color and strength."""
        rows, hidden = kept_lights(context)
        for light in rows:
            draw_light(layout, light)
        if hidden:
            layout.label(text=f"and {hidden} more", translate=False)


def draw_light(layout: Any, light: LightRow) -> None:
    """Draw a name and the values that can be set; they can be keyframed where they are drawn."""
    row = layout.row(align=True)
    row.label(text=light.name, icon=light.icon, translate=False)
    for place in light.places:
        owner = place.owner()
        if owner is not None:
            row.prop(owner, place.attribute, text="")
