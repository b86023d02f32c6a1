"""What happens to the open file, and who acts on it: all handlers that are there while the extension is.

A running job has two more, which come and go with it (`file_watch.py`, `live_view.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.handlers import persistent

from .files import ownership
from .operators import cleaning, edit_guard
from .overlays import overlay_view
from .relight import lightmap_versions
from .session import facts, state
from .settings import properties

REPORTS_APPENDING = hasattr(bpy.app.handlers, "blend_import_post")
"""Blender 4.2 does not: there the next bake has all of a file look alike."""

ALWAYS: tuple[tuple[str, Callable[..., None]], ...] = (
    ("load_pre", ownership.forget_unsaved),
    ("load_pre", lightmap_versions.forget),
    ("load_pre", state.forget_file),
    ("load_post", properties.read_earlier),
    ("load_post", lightmap_versions.check),
    ("load_post", cleaning.look_at_file),
    *((("blend_import_post", properties.unite_looks),) if REPORTS_APPENDING else ()),
    ("save_pre", lightmap_versions.before_saving),
    ("undo_post", lightmap_versions.follow_undo),
    ("undo_post", overlay_view.forget),
    ("redo_post", lightmap_versions.follow_undo),
    ("redo_post", overlay_view.forget),
    ("depsgraph_update_post", state.note_change),
)
"""Which function is called at which event, in this order."""

WITH_A_WINDOW: tuple[tuple[str, Callable[..., None]], ...] = (
    ("load_pre", edit_guard.forget),
    ("load_post", facts.outdate),
    ("undo_post", facts.outdate),
    ("redo_post", facts.outdate),
    ("depsgraph_update_post", facts.outdate),
    ("depsgraph_update_post", overlay_view.note_change),
    ("depsgraph_update_post", edit_guard.note),
)
"""In the background nothing is drawn, and nobody would see a message."""


def register() -> None:
    """Listen to the file's events."""
    for event, function in (*ALWAYS, *(() if bpy.app.background else WITH_A_WINDOW)):
        _listeners(event).append(persistent(function))


def unregister() -> None:
    """Listen to nothing any more, and forget what belongs to the open file."""
    for event, function in (*ALWAYS, *WITH_A_WINDOW):
        if function in _listeners(event):
            _listeners(event).remove(function)
    edit_guard.forget()
    lightmap_versions.forget()
    state.forget_file()


def _listeners(event: str) -> list[Any]:
    found: list[Any] = getattr(bpy.app.handlers, event)
    return found
