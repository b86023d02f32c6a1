"""Texels over which direct light changes: an edge of sunlight runs over them, or a lamp is near."""

from __future__ import annotations

import numpy as np

from ...numerics import Array, tiles
from .texel_geometry import NO_TEXEL, TexelGeometry

CONTRAST = 1.5
"""Neighbors of which one has so many times the light of another differ, …"""

COUNTS = 0.25
"""… if by this part of the mean of all texels."""

BAND = 256
"""Rows of a page looked at once; bounds the temporaries to about 20 bytes a pixel of it."""


def uneven_texels(geometry: TexelGeometry, lamps: Array) -> Array:
    """Return (n,) bool: texels whose direct light differs from that of one of their eight neighbors.

    lamps (n, 3): Irradiance straight from lamps and emissive faces [W/m²].
    """
    uneven = np.zeros(len(geometry), dtype=bool)
    total = sum(float(lamps[rows].sum()) for rows in tiles(len(lamps)))
    least = COUNTS * total / max(lamps.size, 1)
    for numbers in geometry.index:
        for start in range(0, len(numbers), BAND):
            first, stop = max(start - 1, 0), min(start + BAND, len(numbers))
            around = numbers[first : stop + 1]
            there = around != NO_TEXEL
            light = np.zeros(around.shape, dtype=np.float32)
            light[there] = lamps[around[there]].mean(axis=1)
            high = _largest_around(np.where(there, light, -np.inf))
            low = -_largest_around(np.where(there, -light, -np.inf))
            differs = there & (high - low > least) & (high > CONTRAST * low)
            own = slice(start - first, start - first + stop - start)
            uneven[around[own][differs[own]]] = True
    return uneven


def _largest_around(values: Array) -> Array:
    """Return (h, w) the largest of each pixel and its neighbors."""
    padded = np.pad(values, 1, constant_values=-np.inf)
    rows = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return np.asarray(np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:]))
