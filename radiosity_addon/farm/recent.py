"""What was used last."""

from __future__ import annotations

from typing import Generic, TypeVar

T = TypeVar("T")

MOST = 512
"""Entries: some calls of kernels hold a hundred objects and arrays, most of them those of the call before."""


class Recent(Generic[T]):
    """A dictionary that forgets what was not used for long."""

    def __init__(self, most: int = MOST) -> None:
        self._most, self._entries = most, dict[str, T]()

    def get(self, key: str) -> T | None:
        """Return an entry, if it is known."""
        entry = self._entries.pop(key, None)
        if entry is not None:
            self._entries[key] = entry
        return entry

    def put(self, key: str, entry: T) -> T:
        """Add an entry; return it."""
        self._entries[key] = entry
        if len(self._entries) > self._most:
            del self._entries[next(iter(self._entries))]
        return entry
