"""Edits that a stand-in cannot take over are refused at once: what modifiers or instances make is made again.

Blender says after every change what it concerns. That is only noted; a timer looks at it, puts stand-ins back
and says what to do. Edits by scripts are kept nevertheless (`edits.py`).
"""

from __future__ import annotations

from typing import Any

import bpy
from mathutils import Matrix

from ..datablocks.bake_record import is_made
from ..datablocks.edit_modes import leave_edit_mode_of
from ..session.state import session

DELAY = 0.05
"""Seconds after a change until it is looked at."""


def note(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Note which stand-ins an update is of."""
    for update in depsgraph.updates:
        block = update.id
        if isinstance(block, bpy.types.Object) and block.library is None and _is_guarded(block.original):
            session.edited.add(block.name)
    if session.edited and not bpy.app.timers.is_registered(_look):
        bpy.app.timers.register(_look, first_interval=DELAY)


def _is_guarded(obj: bpy.types.Object) -> bool:
    if is_made(obj):
        return True
    from ..stand_ins.stand_ins import EVALUATED, stand_in_of

    known = stand_in_of(obj.data) if isinstance(obj.data, bpy.types.Mesh) else None
    return known is not None and known.kind == EVALUATED


def _look() -> None:
    """Undo what was noted, and say so in the window."""
    if session.running.active:
        return
    messages = refuse(bpy.context)
    if messages:
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            bpy.context.window_manager.popup_menu(_drawn(messages), title="Lightmap", icon="INFO")


def refuse(context: bpy.types.Context) -> list[str]:
    """Put stand-ins back that were noted as changed; returns what to say of each."""
    from ..stand_ins.stand_ins import moved_place, placed

    names, messages = sorted(session.edited), []
    session.edited.clear()
    for name in names:
        obj = bpy.data.objects.get((name, None))
        if obj is None or not _is_guarded(obj):
            continue
        if obj.mode != "OBJECT":
            leave_edit_mode_of(context, obj)
            messages.append(
                f"'{name}' shows modifiers or instances as baked: press Restore before editing it"
            )
        place = placed(obj)
        if is_made(obj) and place is not None and moved_place(obj) is not None:
            obj.matrix_basis = Matrix(place)
            messages.append(f"'{name}' stands in for an instance: press Restore before moving it")
    return messages


def _drawn(messages: list[str]) -> Any:
    def draw(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
        for message in messages:
            menu.layout.label(text=message, translate=False)

    return draw


def forget(*_: Any) -> None:
    """Look after nothing that was noted: another file is being opened, or the extension is switched off."""
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    session.edited.clear()
