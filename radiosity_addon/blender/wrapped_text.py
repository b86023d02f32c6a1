"""Text in panels and pop-ups, over as many lines as it takes: Blender's labels are cut off."""

from __future__ import annotations

from typing import Any

import bpy

LETTER = 6.2
"""Mean width of a letter [px], at a scale of the interface of 1."""


def draw_text(
    layout: Any, text: str, icon: str, context: bpy.types.Context, width: float | None = None
) -> None:
    """Draw a text over as many lines as the width asks for.

    Parameters
    ----------
    layout : UILayout
    text : str
        In the user's language already.
    icon : str
        Before the first line.
    context : Context
    width : float or None
        Of the layout [px]; None takes the region's.
    """
    if width is None:
        width = context.region.width if context.region is not None else 280
    scale = context.preferences.system.ui_scale
    per_line = max(16, int((width / scale - 60) / LETTER))
    column = layout.column(align=True)
    column.scale_y = 0.85
    for number, line in enumerate(wrapped(text, per_line)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1", translate=False)


def wrapped(text: str, width: int) -> list[str]:
    """Break a text at spaces into lines of at most `width` characters."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append(word)
        else:
            lines[-1] = f"{lines[-1]} {word}".strip()
    return lines
