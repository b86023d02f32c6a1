"""Rows of the panel for the options of a bake, made from the table."""

from __future__ import annotations

from typing import Any

import bpy

from ...options import Option, sections_of
from ..settings.option_properties import PREFERRED, PROPERTIES, automatic_source, is_shown
from ..settings.preferences import preferences


def draw_options(layout: Any, part: str, context: bpy.types.Context, in_header: str = "") -> None:
    """Draw the options of a part of the panel that have an effect as the others are chosen, by sections.

    in_header: Name of an option that the part's header shows already.
    """
    settings = context.scene.radiosity
    for section in sections_of(part):
        options = [option for option in PROPERTIES if option.section == section]
        rows = [option for option in options if is_shown(option, settings) and option.name != in_header]
        if not rows:
            continue
        # Only next to a check box there is room for a heading.
        column = layout.column(heading=section if rows[0].kind is bool and section != part else "")
        for option in rows:
            _draw_option(column, option, context)


def _draw_option(layout: Any, option: Option, context: bpy.types.Context) -> None:
    """Draw one option, and whether the preferences' value is used instead."""
    row = option.panel
    assert row is not None
    group = getattr(context.scene, row.group)
    if row.expand:
        # Over the whole width: next to a label the choices would not fit.
        buttons = layout.row(align=True)
        buttons.use_property_split = False
        buttons.prop(group, option.identifier, expand=True)
    elif option.automatic:
        _draw_automatic(layout, option, group)
        return
    else:
        layout.prop(group, option.identifier)
    if option.name in PREFERRED and not group.is_property_set(option.identifier):
        preferred = getattr(preferences(context), option.name)
        if preferred != getattr(group, option.identifier):
            layout.label(text=f"From the preferences: {preferred}", icon="INFO", translate=False)


def _draw_automatic(layout: Any, option: Option, settings: Any) -> None:
    """Draw a number that may be left unset: a button until it has a value, then the value and a way back."""
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
    row.operator("radiosity.set_option", text=f"set by {automatic_source(option)}").option = option.name
