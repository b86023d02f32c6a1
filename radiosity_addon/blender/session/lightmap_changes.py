"""Lightmaps on objects have changed: whoever draws or caches them is called."""

from __future__ import annotations

from collections.abc import Callable

listeners: list[Callable[[], None]] = []


def announce() -> None:
    """Call all listeners."""
    for listener in listeners:
        listener()
