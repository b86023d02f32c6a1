"""Rows of the panel for the options of a bake, made from the table."""

from __future__ import annotations

from typing import Any

import bpy

from ...options import OPTIONS, Option, sections_of
from ..settings.option_properties import shown
from ..settings.preferences import PREFERRED, preferences


def draw_options(layout: Any, part: str, context: bpy.types.Context, in_header: str = "") -> None:
    """Draw the options of a part of the panel that have an effect as the others are chosen, by sections.

    Parameters
    ----------
    in_header : str
        Name of an option that the part's header shows already.
    """
    settings = context.scene.radiosity
    for section in sections_of(part):
        options = [option for option in OPTIONS.values() if option.section == section]
        rows = [option for option in options if shown(option, settings) and option.name != in_header]
        if not rows:
            continue
        # Only next to a check box there is room for a heading.
        column = layout.column(heading=section if rows[0].kind is bool else "")
        for option in rows:
            if option.automatic:
                _draw_automatic(column, option, settings)
            else:
                column.prop(settings, option.identifier)
            if option.name in PREFERRED and not settings.is_property_set(option.identifier):
                preferred = getattr(preferences(context), option.name)
                draw_preferred(column, preferred, getattr(settings, option.identifier))


def _draw_automatic(layout: Any, option: Option, settings: Any) -> None:
    """Draw a number that the quality sets: a button until it has a value, then the value and a way back."""
    if getattr(settings, option.identifier):
        row = layout.row(align=True)
        row.prop(settings, option.identifier)
        row.operator("radiosity.set_option", text="", icon="LOOP_BACK").option = option.name
        return
    assert option.panel is not None
    row = layout.split(factor=0.4)
    name = row.row()
    name.alignment = "RIGHT"
    name.label(text=option.panel.label)
    row.operator("radiosity.set_option", text="set by quality").option = option.name


def draw_preferred(layout: Any, preferred: Any, own: Any) -> None:
    """Say that the preferences' value counts where the scene has none of its own."""
    if preferred != own:
        layout.label(text=f"From the preferences: {preferred}", icon="INFO", translate=False)
