"""Arrays that were published once are not read again to find their digests.

They are made read-only for this: had they changed, what was published would be wrong.
"""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
import numpy.typing as npt

from .spool import Spool

Array = npt.NDArray[Any]

WORTH_KNOWING = 1 << 16
"""Bytes of arrays whose digests are remembered: those of smaller ones take no time."""


class PublishedArrays:
    """A spool that remembers what it was given; see `objects.Store`."""

    def __init__(self, spool: Spool) -> None:
        self._spool = spool
        self._digests: dict[tuple[Any, ...], tuple[weakref.ref[Array], str]] = {}

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
        if known is not None and known[0]() is root and not root.flags.writeable:
            return known[1]
        digest = self._spool.put_array(array)
        root.flags.writeable = array.flags.writeable = False
        self._digests[key] = weakref.ref(root), digest
        return digest


def _root(array: Array) -> Array:
    """Return the array that owns the memory of a view, or the first over memory of another kind."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array
