"""Parts of the panel that fold, drawn in the panel's own layout.

Blender moves registered sub-panels only after it has drawn them where they were: when the panel above grows,
they lie over it until the next redraw, or longer. A part of the panel's layout is placed before it is drawn.
"""

from __future__ import annotations

from typing import Any

import bpy


class Section:
    """A part of the panel that folds."""

    name = ""
    """Under which Blender keeps whether it is open."""

    label = ""

    folded = True
    """Whether it is closed until somebody opens it."""

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Return whether to show it."""
        return True

    @classmethod
    def draw_header(cls, header: Any, _context: bpy.types.Context) -> None:
        """Draw what is seen of it when it is folded too."""
        header.label(text=cls.label)

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw what is in it."""
        raise NotImplementedError


def draw_sections(layout: Any, sections: tuple[type[Section], ...], context: bpy.types.Context) -> None:
    """Draw sections below each other at the end of `layout`, which has the panel's full width."""
    layout.use_property_split = layout.use_property_decorate = False  # as in a panel of their own
    for section in sections:
        if not section.poll(context):
            continue
        header, body = layout.panel(section.name, default_closed=section.folded)
        section.draw_header(header, context)
        if body is not None:
            section.draw(body, context)
