"""A curve that fills space: what is near on it is near in space."""

from __future__ import annotations

import numpy as np

from .arrays import Array

BITS = 10
"""Bits a coordinate."""


def along_curve(places: Array) -> Array:
    """Return (n,) int64 below 2^30: where places (n, 3) lie along a Z-order curve through their box."""
    if len(places) == 0:
        return np.zeros(0, dtype=np.int64)
    low = places.min(axis=0)
    width = float((places.max(axis=0) - low).max())
    code = np.zeros(len(places), dtype=np.int64)
    if width == 0.0:
        return code
    for axis in range(3):
        cell = ((places[:, axis] - low[axis]) * (((1 << BITS) - 1) / width)).astype(np.int64)
        for bit in range(BITS):
            code |= ((cell >> bit) & 1) << (3 * bit + axis)
    return code
