"""Texels that geometry cuts in two: a wall's foot on a floor, the rim of what a box covers.

Such a texel shows the mean of both sides, as it should. Light that comes back from it must
not be the mean: a ray from inside a closed box would then see the lit floor outside. A hit
on a crossed texel is looked up in a whole neighbour that the hit point can see.
"""

from __future__ import annotations

import numpy as np

from ..solver.arrays import Array
from ..solver.local_pass import NOTHING
from ..solver.visibility import RayCaster
from .texel_geometry import NO_TEXEL, TexelGeometry

CHUNK = 1 << 16
"""Texels or hits tested at once; bounds the temporaries to about 60 MB."""

LIFT = 2.0
"""Segments run this many surface offsets above the surface."""

INSET = 0.96
"""Corners are drawn in to this part: a texel that ends at a wall is not crossed by it."""

_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], dtype=np.float32)
_SEGMENTS = np.array([[0, 2], [1, 3], [0, 1], [1, 2], [2, 3], [3, 0]])
_AROUND = np.array([[r, c] for r in (-1, 0, 1) for c in (-1, 0, 1) if r or c])


class Crossings:
    """Which texels are crossed, and where their hits are looked up instead."""

    def __init__(self, geometry: TexelGeometry, caster: RayCaster) -> None:
        self._geometry, self._caster = geometry, caster
        self.crossed = np.zeros(len(geometry), dtype=bool)
        """(n,) bool"""
        for first in range(0, len(geometry), CHUNK):
            rows = np.arange(first, min(first + CHUNK, len(geometry)))
            # The whole texel: hits land all over it, though its light comes from the middle.
            corners = geometry.sample(rows, np.broadcast_to(_CORNERS, (len(rows), 4, 2)), 1.0)
            centre = geometry.position[rows][:, None]
            corners = centre + INSET * (corners - centre)
            corners += LIFT * caster.surface_offset * geometry.surface_normal[rows][:, None]
            start, end = corners[:, _SEGMENTS[:, 0]], corners[:, _SEGMENTS[:, 1]]
            self.crossed[rows] = ~self._free(start, end).all(axis=1)

    def _free(self, start: Array, end: Array) -> Array:
        """Return (n, k) whether segments between (n, k, 3) points meet nothing."""
        along = (end - start).reshape(-1, 3)
        length = np.linalg.norm(along, axis=1)
        directions = along / np.maximum(length, 1e-300)[:, None]
        free = self._caster.visible(start.reshape(-1, 3), directions, length)
        return free.reshape(start.shape[:2])

    def look_up(self, texel: Array, position: Array) -> Array:
        """Replace crossed texels by whole neighbours on the hit's own side.

        Parameters
        ----------
        texel : (h,) int32
            NO_TEXEL is left alone.
        position : (h, 3) float64
            Where the rays hit.

        Returns
        -------
        texel : (h,) int32
            NOTHING where no whole neighbour can be seen.
        """
        result = texel.copy()
        rows = np.flatnonzero((texel != NO_TEXEL) & self.crossed[texel])
        for first in range(0, len(rows), CHUNK):
            chunk = rows[first : first + CHUNK]
            result[chunk] = self._neighbour(texel[chunk], position[chunk])
        return result

    def _neighbour(self, texel: Array, position: Array) -> Array:
        """Return (h,) the nearest whole neighbour visible from each hit, or NOTHING."""
        geometry = self._geometry
        around = np.full((len(texel), len(_AROUND)), NO_TEXEL, dtype=np.int32)
        for page, numbers in enumerate(geometry.index):
            mine = np.flatnonzero(geometry.page[texel] == page)
            row = geometry.row[texel[mine]][:, None] + _AROUND[:, 0]
            column = geometry.column[texel[mine]][:, None] + _AROUND[:, 1]
            inside = (row >= 0) & (row < len(numbers)) & (column >= 0) & (column < len(numbers))
            last = len(numbers) - 1
            near = numbers[np.clip(row, 0, last), np.clip(column, 0, last)]
            around[mine] = np.where(inside, near, NO_TEXEL)
        whole = (around != NO_TEXEL) & ~self.crossed[around]
        normal = geometry.surface_normal[texel]
        # The same surface only: a chart's neighbour on the page may lie anywhere.
        along = geometry.position[around] - position[:, None]
        size = np.linalg.norm(along, axis=2)
        whole &= np.abs(np.einsum("hak,hk->ha", along, normal)) <= 0.1 * size
        whole &= np.einsum("hak,hk->ha", geometry.surface_normal[around], normal) > 0.9
        lift = LIFT * self._caster.surface_offset
        start = np.repeat((position + lift * normal)[:, None], len(_AROUND), axis=1)
        end = geometry.position[around] + lift * geometry.surface_normal[around]
        seen = np.zeros(whole.shape, dtype=bool)
        hit, which = np.nonzero(whole)
        seen[hit, which] = self._free(start[hit, which][:, None], end[hit, which][:, None])[:, 0]
        size = np.where(seen, size, np.inf)
        best = size.argmin(axis=1)
        every = np.arange(len(texel))
        return np.where(np.isfinite(size[every, best]), around[every, best], NOTHING)
