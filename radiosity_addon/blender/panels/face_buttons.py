"""Above warnings of faces that show their backs: buttons to select and flip them, and what to do then."""

from __future__ import annotations

from typing import Any

import bpy

from ..operators.panel_facts import FacesToFlip
from .wrapped_text import draw_text


def draw_face_buttons(layout: Any, faces: FacesToFlip, again: str, context: bpy.types.Context) -> None:
    """Draw the buttons if there is anything to flip, and a hint if meshes have changed since.

    again: What to do then.
    """
    if faces.found:
        row = layout.row(align=True)
        row.operator("radiosity.flip_turned_faces", icon="NORMALS_FACE")
        row.operator("radiosity.select_turned_faces", text="Select", icon="RESTRICT_SELECT_OFF")
    if faces.changed:
        count = len(faces.changed)
        of = f"'{faces.changed[0]}'" if count == 1 else f"{count} objects"
        draw_text(layout.box(), f"Faces of {of} were flipped or edited since: {again}", "INFO", context)
