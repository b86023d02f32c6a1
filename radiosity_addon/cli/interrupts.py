"""Ctrl-C, and what queues end jobs with, as a request that no Blender callback can swallow."""

from __future__ import annotations

import signal
import threading
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupts:
    """While entered, SIGINT and SIGTERM raise KeyboardInterrupt and are remembered.

    Blender prints and drops an exception raised in its own Python callbacks (a Cycles
    render, an importer), crashes on one that is raised while it is imported, and in the
    background installs a handler of its own that never reaches Python. So the request is
    also kept in `requested`: loops call `check`, and while `deferred` is set, as it is at
    first, nothing is raised, so that work that must not be interrupted is finished first.
    """

    def __init__(self) -> None:
        self.requested = False
        self.deferred = True
        self._previous: list[object] = []

    def check(self) -> None:
        """Raise KeyboardInterrupt if a signal has come in meanwhile."""
        if self.requested:
            raise KeyboardInterrupt

    def __enter__(self) -> Interrupts:
        if threading.current_thread() is threading.main_thread():
            self._previous = [signal.signal(each, self._handle) for each in SIGNALS]
        return self

    def __exit__(self, *_: object) -> None:
        if threading.current_thread() is threading.main_thread():
            usual = (signal.default_int_handler, signal.SIG_DFL)
            for each, previous, otherwise in zip(SIGNALS, self._previous, usual, strict=True):
                # None: the handler was not Python's and cannot be put back.
                signal.signal(each, otherwise if previous is None else previous)  # type: ignore[arg-type]

    def _handle(self, _signum: int, _frame: FrameType | None) -> None:
        self.requested = True
        if not self.deferred:
            raise KeyboardInterrupt
