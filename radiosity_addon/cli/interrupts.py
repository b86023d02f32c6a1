"""Ctrl-C as a request that no Blender callback can swallow."""

from __future__ import annotations

import signal
import threading
from types import FrameType


class Interrupts:
    """While entered, SIGINT raises KeyboardInterrupt and is remembered.

    Blender prints and drops an exception raised in its own Python callbacks (a Cycles
    render, an importer), crashes on one that is raised while it is imported, and in the
    background installs a handler of its own that never reaches Python. So the request is
    also kept in `requested`: loops call `check`, and while `deferred` is set, as it is at
    first, nothing is raised, so that work that must not be interrupted is finished first.
    """

    def __init__(self) -> None:
        self.requested = False
        self.deferred = True
        self._previous: object = None

    def check(self) -> None:
        """Raise KeyboardInterrupt if SIGINT has come in meanwhile."""
        if self.requested:
            raise KeyboardInterrupt

    def __enter__(self) -> Interrupts:
        if threading.current_thread() is threading.main_thread():
            self._previous = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        if threading.current_thread() is threading.main_thread():
            # None: the handler was not Python's and cannot be put back.
            previous = signal.default_int_handler if self._previous is None else self._previous
            signal.signal(signal.SIGINT, previous)  # type: ignore[arg-type]

    def _handle(self, _signum: int, _frame: FrameType | None) -> None:
        self.requested = True
        if not self.deferred:
            raise KeyboardInterrupt
