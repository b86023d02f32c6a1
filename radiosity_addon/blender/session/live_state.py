"""Whether Live is on, and what it has to say: light to import, for panels and operators."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy


@dataclass(eq=False, repr=False)
class State:
    """Of this session.

    Attributes
    ----------
    live : LiveRelight or None
        What follows the lights now.
    message : str
        Why it is off, if not because somebody switched it off.
    """

    live: Any = None
    message: str = ""


state = State()


def stop(message: str = "") -> None:
    """Follow no lights any more, and say why, if there is a reason; harmless where none are followed."""
    live, state.live = state.live, None
    state.message = message
    if live is None:
        return
    live.close()
    manager = bpy.context.window_manager
    if manager is not None and getattr(manager, "radiosity_live", False):
        manager.radiosity_live = False


def note(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Tell Live, if it is on, that something has changed; nothing may be raised."""
    try:
        if state.live is not None:
            state.live.note(scene, depsgraph)
    except Exception as error:  # noqa: BLE001 (Blender would print it at every change)
        stop(f"Live is off: {type(error).__name__}: {error}")


def stop_with_the_file(*_: Any) -> None:
    """Another file is being opened."""
    stop()
