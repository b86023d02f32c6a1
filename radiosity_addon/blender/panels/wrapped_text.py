"""Text in panels and pop-ups, over as many lines as it takes: Blender's labels are cut off."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import blf
import bpy

MARGIN = 60
"""What a layout's frame and a label's icon take of its width [px], at a scale of the interface of 1."""

TABS = 32
"""What a sidebar's tabs and its own frame take besides."""


def draw_text(
    layout: Any, text: str, icon: str, context: bpy.types.Context, width: float | None = None
) -> None:
    """Draw a text over as many lines as the width asks for.

    Parameters
    ----------
    layout : UILayout
    text : str
    icon : str
        Before the first line.
    context : Context
    width : float or None
        Of the layout [px]; None takes the region's.
    """
    scale = context.preferences.system.ui_scale
    if width is None:
        width = (context.region.width if context.region is not None else 280) - TABS * scale
    blf.size(_FONT, context.preferences.ui_styles[0].widget.points * scale)
    column = layout.column(align=True)
    column.scale_y = 0.85
    for number, line in enumerate(wrapped(text, width - MARGIN * scale, _width)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1", translate=False)


_FONT = 0
"""The interface's own."""


def _width(text: str) -> float:
    return float(blf.dimensions(_FONT, text)[0])


def wrapped(text: str, width: float, measure: Callable[[str], float]) -> list[str]:
    """Break a text at spaces into lines no wider than `width`, as `measure` has it."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and measure(longer) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines
