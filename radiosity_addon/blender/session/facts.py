"""Values that panels show: worked out on a timer once a panel wants them, never while it is drawn."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

import bpy

from .redraw import redraw_sidebars
from .state import session

T = TypeVar("T")

AT_LEAST_APART = 0.25
"""Seconds between two turns, however often the scene changes."""

OUTDATED_AFTER = 1.0
"""Seconds after which values are worked out again if they are still drawn: not every change is reported."""

NOT_WANTED_AFTER = 10.0
"""Seconds after which a value that no panel draws any more is left alone."""


def fact(unknown: Any) -> Callable[[Callable[[bpy.types.Context], T]], Callable[[bpy.types.Context], T]]:
    """Make a function of the context return the value it had last, `unknown` at first.

    Without a window nothing is drawn: the function is then called at once.
    """

    def kept(work: Callable[[bpy.types.Context], T]) -> Callable[[bpy.types.Context], T]:
        @wraps(work)
        def last_value(context: bpy.types.Context) -> T:
            if bpy.app.background:
                return work(context)
            key = work, context.scene.name_full
            now = time.monotonic()
            session.wanted_facts[key] = now
            if key not in session.facts or now - session.facts_made > OUTDATED_AFTER:
                _schedule()
            value: T = session.facts.get(key, unknown)
            return value

        return last_value

    return kept


def outdate(*_: object) -> None:
    """Have the values that panels draw worked out again soon: something has changed."""
    if session.wanted_facts and not session.running.active:
        _schedule()


def refresh() -> None:
    """Work out again what panels draw, and redraw them if anything differs."""
    if not session.wanted_facts:
        return
    differ = False
    manager = bpy.context.window_manager
    for window in manager.windows if manager is not None else ():
        scene = window.scene.name_full
        with bpy.context.temp_override(window=window):
            for key in session.wanted_facts:
                if key[1] == scene:
                    value: Any = key[0](bpy.context)
                    differ |= key not in session.facts or session.facts[key] != value
                    session.facts[key] = value
    session.facts_made = time.monotonic()
    if differ:
        redraw_sidebars()


def stop() -> None:
    """Work nothing out any more: the extension is switched off."""
    if bpy.app.timers.is_registered(_turn):
        bpy.app.timers.unregister(_turn)


def _schedule() -> None:
    """Work them out in a moment. Persistent, for undo takes other timers away."""
    if not bpy.app.timers.is_registered(_turn):
        wait = session.facts_made + AT_LEAST_APART - time.monotonic()
        bpy.app.timers.register(_turn, first_interval=max(0.0, wait), persistent=True)


def _turn() -> None:
    if session.running.active:
        return
    now = time.monotonic()
    for key in [key for key, asked in session.wanted_facts.items() if now - asked > NOT_WANTED_AFTER]:
        del session.wanted_facts[key]
    refresh()
