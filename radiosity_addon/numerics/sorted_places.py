"""Looking numbers up in long sorted arrays."""

from __future__ import annotations

import numpy as np

from .arrays import Array

LONG = 1 << 18
"""Entries that do not fit into a processor's cache."""


def places_in(ascending: Array, values: Array) -> Array:
    """Return (n,) int64 `np.searchsorted(ascending, values)` of values (n,) in any order.

    Looked up in order, values share the entries that are in the cache: in millions of entries that takes a
    fifth of the time.
    """
    if len(ascending) < LONG:
        return np.searchsorted(ascending, values)
    order, places = np.argsort(values), np.empty(len(values), dtype=np.int64)
    places[order] = np.searchsorted(ascending, values[order])
    return places
