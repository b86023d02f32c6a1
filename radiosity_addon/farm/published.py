"""Arrays that were published once are not read again to find their digests, and leave the spool when they are
no longer needed.

They are made read-only for this: had they changed, what was published would be wrong. An array whose memory
is free cannot be read by a later call; a bake that is started again writes what it needs.
"""

from __future__ import annotations

import time
import weakref
from collections import deque
from typing import Any

import numpy as np
import numpy.typing as npt

from .spool import Spool

Array = npt.NDArray[Any]

WORTH_KNOWING = 1 << 16
"""Bytes of arrays whose digests are remembered: those of smaller ones take no time."""

GRACE = 20.0
"""Seconds that an array stays in the spool at least: a worker may still be at a task of the last call."""


class PublishedArrays:
    """A spool that remembers what it was given; see `objects.Store`."""

    def __init__(self, spool: Spool) -> None:
        self._spool = spool
        self._digests: dict[tuple[Any, ...], tuple[weakref.ref[Array], str]] = {}
        self._of_call: list[Array] = []
        self._gone: deque[tuple[float, str]] = deque()
        """When arrays' memory was freed, and their digests."""

    def put_object(self, digest: str, text: str) -> None:
        """See `Store`."""
        self._spool.put_object(digest, text)

    def object(self, digest: str) -> str:
        """See `Store`."""
        return self._spool.object(digest)

    def array(self, digest: str) -> Array:
        """See `Store`."""
        return self._spool.array(digest)

    def put_array(self, array: Array) -> str:
        """See `Store`."""
        if array.nbytes < WORTH_KNOWING:
            return self._spool.put_array(array)
        root = _root(array)
        key = (id(root), array.__array_interface__["data"][0], array.shape, array.strides, array.dtype.str)
        known = self._digests.get(key)
        self._of_call.append(root)
        if known is not None and known[0]() is root and not root.flags.writeable:
            return known[1]
        digest = self._spool.put_array(array)
        root.flags.writeable = array.flags.writeable = False
        freed = weakref.ref(root, lambda _: self._gone.append((time.monotonic(), digest)))
        self._digests[key] = freed, digest
        return digest

    def end_call(self) -> None:
        """Let go of the arrays of a call, some of which were made for it alone."""
        self._of_call.clear()

    def remove_unused(self) -> None:
        """Remove arrays from the spool whose memory is free, also those that an interrupted bake has left."""
        late = time.monotonic() - GRACE
        if not self._gone or self._gone[0][0] > late:
            return
        self._digests = {key: known for key, known in self._digests.items() if known[0]() is not None}
        used = {digest for _, digest in self._digests.values()}
        while self._gone and self._gone[0][0] <= late:
            _, digest = self._gone.popleft()
            if digest not in used:
                self._spool.remove_array(digest, others=self._spool.is_prepared())


def _root(array: Array) -> Array:
    """Return the array that owns the memory of a view, or the first over memory of another kind."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array
