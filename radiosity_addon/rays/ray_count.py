"""How many rays a caster has traced, also those that other processes traced with copies of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Lock

_apart: ContextVar[dict[str, int] | None] = ContextVar("apart", default=None)
"""Rays of a task in this thread, by the names of their counts."""


class RayCount:
    """The rays of one caster; may be added to by any thread.

    name: The same of all copies of a caster; "" if it has none elsewhere.
    """

    def __init__(self) -> None:
        self.rays, self.name = 0, ""
        self._adding = Lock()

    def add(self, rays: int) -> None:
        """Count rays; of a task that counts its own, there."""
        apart = _apart.get()
        if apart is not None and self.name:
            apart[self.name] = apart.get(self.name, 0) + rays
            return
        with self._adding:
            self.rays += rays


@contextmanager
def counted_apart() -> Iterator[dict[str, int]]:
    """Count the rays of this thread by the names of their counts, which may take them later."""
    rays: dict[str, int] = {}
    before = _apart.set(rays)
    try:
        yield rays
    finally:
        _apart.reset(before)
