"""Find points near a surface by hashing: a grid of cells over the world, one per way of facing."""

from __future__ import annotations

import numpy as np

from ..solver.arrays import Array
from ..solver.sampling import orthonormal_basis

PER_CELL = 2
"""Points taken from a cell: on a lattice as wide as the cells there are hardly more."""

_SPOTS = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)], dtype=np.float64)


class PointGrid:
    """Points in cubic cells.

    Parameters
    ----------
    position, normal : (p, 3) float64
    numbers : (p,) int32
        What a look-up answers with.
    size : float
        Edge of the cells [m].
    """

    def __init__(self, position: Array, normal: Array, numbers: Array, size: float) -> None:
        self._size = size
        keys = self._keys(position, normal)
        order = np.argsort(keys, kind="stable")
        self._sorted, self._numbers = keys[order], numbers[order]

    def near(self, position: Array, normal: Array) -> Array:
        """Return (n, 18) int32: points that face alike in the nine cells around, −1 for none.

        The cells are those under a 3 × 3 grid in the tangent plane; a point may come twice.
        """
        tangent, bitangent = orthonormal_basis(normal)
        steps = self._size * (
            _SPOTS[:, :1] * tangent[:, None].astype(np.float64) + _SPOTS[:, 1:] * bitangent[:, None]
        )
        spots = position[:, None] + steps
        facing = np.broadcast_to(normal[:, None], spots.shape)
        keys = self._keys(spots.reshape(-1, 3), facing.reshape(-1, 3))
        start = np.searchsorted(self._sorted, keys)
        found = np.full((len(keys), PER_CELL), -1, dtype=np.int32)
        for which in range(PER_CELL if len(self._sorted) else 0):
            slot = np.minimum(start + which, len(self._sorted) - 1)
            same = (self._sorted[slot] == keys) & (start + which < len(self._sorted))
            found[same, which] = self._numbers[slot[same]]
        return found.reshape(len(position), -1)

    def _keys(self, position: Array, normal: Array) -> Array:
        """Hash cells and the axis the normal is nearest to; a rare clash only offers a far point."""
        cell = np.floor(position / self._size).astype(np.int64)
        axis = np.abs(normal).argmax(axis=1)
        facing = 2 * axis + (normal[np.arange(len(normal)), axis] < 0)
        primes = np.array([73856093, 19349663, 83492791], dtype=np.int64)
        return np.asarray((cell * primes).sum(axis=1) * 8 + facing)
