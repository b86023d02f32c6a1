"""End a job whose file is no longer the one that it began in: another window may undo, or open another.

Between two steps of a job a second window is free. Edits there are survived, or noticed by the step that they
affect; but an undo replaces everything at once, and the window may show another scene.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeVar

import bpy
from bpy.app.handlers import persistent

from ...base import BakeError

T = TypeVar("T")
R = TypeVar("R")

UNDONE = "stopped: the file was changed by Undo or Redo meanwhile; nothing was baked, start again"
LOADED = "stopped: another file was opened meanwhile; nothing was baked"
OTHER_SCENE = "stopped: the scene was removed, or the window shows another one now; nothing was baked"


def guarded(steps: Generator[T, None, R], context: bpy.types.Context) -> Generator[T, None, R]:
    """Advance steps as long as the file and the scene are those they began in.

    steps: Closed if they are not, which must leave everything as it was.
    Yields what the steps yield.
    Raises BakeError: Instead of the next step, if something was undone, another file was opened or the scene
        is another.
    """
    scene = context.scene
    found: list[str] = []

    @persistent
    def undone(*_: object) -> None:
        found.append(UNDONE)

    @persistent
    def loaded(*_: object) -> None:
        found.append(LOADED)

    handlers = bpy.app.handlers
    watches = ((handlers.undo_post, undone), (handlers.redo_post, undone), (handlers.load_pre, loaded))
    for handler, watch in watches:
        handler.append(watch)
    try:
        while True:
            if found:
                raise BakeError(found[0])
            if context.scene != scene:
                raise BakeError(OTHER_SCENE)
            try:
                progress = next(steps)
            except StopIteration as done:
                result: R = done.value
                return result
            yield progress
    finally:
        for handler, watch in watches:
            if watch in handler:
                handler.remove(watch)
        steps.close()
