"""Find points near a surface by hashing: grids of cells over the world, one per way of facing and per scale.

Where texels are larger, points lie farther apart, and so cells are larger: cells of one size would hold
hundreds of points of a finely mapped object next to a coarsely mapped ground, and hand out two of them.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array, Scratch, orthonormal_basis, places_in, tiles

PER_CELL = 2
"""Points taken from a cell: on a lattice as wide as the cells there are hardly more."""

CHUNK = 1 << 16
"""Points whose cells are found at once; bounds the temporaries to about 10 MB."""

NONE = -1
"""Stands where a cell has no more points."""

_SPOTS = [(i, j) for i in (-1.0, 0.0, 1.0) for j in (-1.0, 0.0, 1.0)]
_PRIMES = tuple(np.int64(8 * prime) for prime in (73856093, 19349663, 83492791))
_SCALE_PRIME = np.int64(8 * 67867979)


class PointGrid:
    """Points in cubic cells.

    position, normal (n, 3): Of surfaces on which the points lie.
    rows (p,) int: Which of these the points are.
    scale (p,) int: Cells around points are 2^scale times as wide.
    first: What a look-up answers with for the first of them; the others follow.
    size: Edge of the cells of scale 0 [m].
    scratch: Makes the arrays.
    """

    def __init__(
        self,
        position: Array,
        normal: Array,
        rows: Array,
        scale: Array,
        first: int,
        size: float,
        scratch: Scratch,
    ) -> None:
        self._size = size
        keys = scratch.empty(len(rows), np.int64)
        for tile in tiles(len(rows), CHUNK):
            point, scales = rows[tile], scale[tile]
            place = position[point] / self._widths(scales)[:, None]
            keys[tile] = _hash(place.T) + _facing(normal[point]) + _SCALE_PRIME * scales
        order = np.argsort(keys, kind="stable")
        # Looked up past its end, the last cell answers that it has no more.
        end = PER_CELL if len(rows) else 0
        self._sorted = scratch.empty(len(rows) + end, np.int64)
        self._numbers = scratch.empty(len(rows) + end, np.int32)
        for tile in tiles(len(rows)):
            self._sorted[tile], self._numbers[tile] = keys[order[tile]], first + order[tile]
        if end:
            self._sorted[-end:], self._numbers[-end:] = keys[order[-1]], NONE

    def near(self, position: Array, normal: Array, scale: Array) -> Array:
        """Return (n, 18) int32: points that face alike in the nine cells around, each once; NONE for none.

        The cells are those of a scale (n,) under a 3 × 3 grid in the tangent plane.
        """
        found = np.full((len(position), len(_SPOTS) * PER_CELL), NONE, dtype=np.int32)
        if not len(self._sorted):
            return found
        tangent, bitangent = (np.ascontiguousarray(axis.T) for axis in orthonormal_basis(normal))
        middle = np.ascontiguousarray((position / self._widths(scale)[:, None]).T)
        facing = _facing(normal) + _SCALE_PRIME * scale
        keys = np.stack([_hash(middle + i * tangent + j * bitangent) + facing for i, j in _SPOTS])
        starts = places_in(self._sorted, keys.ravel()).reshape(keys.shape)
        for spot, (key, start) in enumerate(zip(keys, starts, strict=True)):
            # In a tilted plane two of the nine may lie in one cell.
            again = (keys[:spot] == key).any(axis=0)
            for which in range(PER_CELL):
                slot = np.minimum(start + which, len(self._sorted) - 1)
                same = (self._sorted.take(slot) == key) & ~again
                found[:, spot * PER_CELL + which] = np.where(same, self._numbers.take(slot), NONE)
        return found

    def _widths(self, scale: Array) -> Array:
        return np.asarray(self._size * 2.0**scale)


def _hash(place: Array) -> Array:
    """Return (n,) int64 a number for the cells of places (3, n); a rare clash only offers a far point."""
    key = np.zeros(place.shape[1], dtype=np.int64)
    for coordinate, prime in zip(place, _PRIMES, strict=True):
        key += np.floor(coordinate).astype(np.int64) * prime
    return key


def _facing(normal: Array) -> Array:
    """Return (n,) int64 0 … 5: the half axis each normal is nearest to."""
    x, y, z = np.abs(normal).T
    axis = np.where((x >= y) & (x >= z), 0, np.where(y >= z, 1, 2))
    along = np.take_along_axis(normal, axis[:, None], axis=1)[:, 0]
    return np.asarray(2 * axis + (along < 0), dtype=np.int64)
