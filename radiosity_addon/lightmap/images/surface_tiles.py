"""Layout of textured triangles in the image of their surface.

Triangles lie two by two in tiles, as right-angled ones with legs of n texels: the first in the
lower left corner, its partner turned by half a turn in the upper right. Texel (i, j) of a
triangle, i + j < n, holds the point with weights ((i + 1/3)/n, (j + 1/3)/n) of its second and
third corner: all of them inside, and their centroid that of the triangle. Bilinear look-ups
read one more diagonal, i + j = n, which gets the mean of its neighbors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics import Array, run_numbers

MAX_LEG = 4096
_FILLED = 0.9
"""The share of the allowed texels that tiles take; the rest is for gaps in the shelves."""


@dataclass(frozen=True)
class SurfaceTiles:
    """A layout of triangles.

    width, height: Of the image in texels.
    leg (t,) int32: Texels along a triangle's legs; 1 is a single texel for all of it.
    corner (t, 2) int32: The column and row of its first corner's texel.
    turned (t,) bool: Whether its legs go left and down instead of right and up.
    """

    width: int
    height: int
    leg: Array
    corner: Array
    turned: Array

    def texels(self) -> tuple[Array, Array, Array, Array, Array]:
        """Return every texel that is sampled.

        Returns triangle, row, column (n,) int64.
        Returns weights (n, 2): Of the triangle's second and third corner, at the sample.
        """
        i, j, triangle = _steps(self.leg)
        column, row = self._at(triangle, i, j)
        leg = self.leg[triangle]
        return triangle, row, column, (i + 1 / 3) / leg, (j + 1 / 3) / leg

    def coordinates(self) -> Array:
        """Return (t, 3, 2) float64 the look-up coordinates of each triangle's corners, in [0, 1]."""
        reach = self.leg - 1
        zero = np.zeros_like(reach)
        return self._corners(np.stack([zero, reach, zero], 1), np.stack([zero, zero, reach], 1))

    def drawn_triangles(self) -> tuple[Array, Array]:
        """Return triangles that cover the centers of their texels, to be drawn into the image.

        Returns coordinates (t, 3, 2): Their corners in the image.
        Returns weights (t, 3, 2): The weights of the triangle's own second and third corner there; they reach
            a little beyond it.
        """
        half = np.full(len(self.leg), -0.5)
        reach = self.leg.astype(float)
        along, across = np.stack([half, reach, half], 1), np.stack([half, half, reach], 1)
        weights = (np.stack([along, across], axis=2) + 1 / 3) / self.leg[:, None, None]
        return self._corners(along, across), weights

    def fill_diagonals(self, values: Array) -> None:
        """Set the texels beyond the diagonals to the mean of their neighbors, in place.

        values (height, width, k).
        """
        wide = np.flatnonzero(self.leg > 1)
        i = run_numbers(self.leg[wide] - 1) + 1
        triangle = np.repeat(wide, self.leg[wide] - 1)
        j = self.leg[triangle] - i
        column, row = self._at(triangle, i, j)
        (left, row_left), (below_column, below) = self._at(triangle, i - 1, j), self._at(triangle, i, j - 1)
        values[row, column] = 0.5 * (values[row_left, left] + values[below, below_column])

    def _corners(self, i: Array, j: Array) -> Array:
        """Return where the centers of texels (t, 3) are in the image, (t, 3, 2)."""
        sign = np.where(self.turned, -1.0, 1.0)[:, None]
        place = np.stack([i * sign, j * sign], axis=2) + self.corner[:, None, :] + 0.5
        return np.asarray(place / (self.width, self.height))

    def _at(self, triangle: Array, i: Array, j: Array) -> tuple[Array, Array]:
        sign = np.where(self.turned[triangle], -1, 1)
        return self.corner[triangle, 0] + sign * i, self.corner[triangle, 1] + sign * j


def lay_out_surfaces(area: Array, group: Array, side: int) -> SurfaceTiles:
    """Give each triangle texels by its area, about side² in all, and a place.

    area (t,): In the world [m²]; 0 for a triangle that takes no more than one texel.
    group (t,) int: Triangles of different groups have no texel in common, not even in look-ups.
    side: Width of the image.
    """
    return _placed(_legs(area, side), group, side)


def lay_out_again(tiles: SurfaceTiles, triangles: Array) -> SurfaceTiles:
    """Give some triangles of a layout an image of their own, about square, in which they are as large.

    `texels` lists the same texels of each triangle for both, in the same order.

    triangles (n,) int: Not empty.
    """
    leg = tiles.leg[triangles]
    taken = np.where(leg > 1, 0.5 * (leg + 1.0) * (leg + 2.0), 1.0).sum()
    side = max(int(np.ceil(np.sqrt(taken / _FILLED))), int(leg.max()) + 1)
    return _placed(leg, np.zeros(len(leg), dtype=np.int32), side)


def _placed(leg: Array, group: Array, side: int) -> SurfaceTiles:
    """Put tiles onto shelves, the largest of each group first."""
    corner = np.zeros((len(leg), 2), dtype=np.int32)
    turned = np.zeros(len(leg), dtype=bool)
    order = np.lexsort((-leg, group))
    top, x, shelf, last = 0, 0, 0, None
    position = 0
    while position < len(order):
        first = order[position]
        if last is not None and group[first] != last:
            # A free row between: look-ups of single texels touch what is next to them.
            top, x, shelf = top + shelf + 1, 0, 0
        last = group[first]
        size = int(leg[first])
        pair = size > 1 and position + 1 < len(order)
        second = order[position + 1] if pair else first
        pair = pair and leg[second] > 1 and group[second] == last
        columns, rows = (1, 1) if size == 1 else (size + 1, size + 2)
        if x + columns > side:
            top, x, shelf = top + shelf, 0, 0
        corner[first] = x, top
        if pair:
            corner[second] = x + columns - 1, top + rows - 1
            turned[second] = True
        x, shelf = x + columns, max(shelf, rows)
        position += 2 if pair else 1
    return SurfaceTiles(side, max(top + shelf, 1), leg, corner, turned)


def _legs(area: Array, side: int) -> Array:
    """Return (t,) int32 the legs with which all tiles together have about side² texels."""
    allowed = _FILLED * side * side
    longest = min(side - 2, MAX_LEG)
    low, high = 0.0, float(side) * side / max(float(area[area > 0].min(initial=np.inf)), 1e-30)
    if not (area > 0).any() or not np.isfinite(high):
        return np.ones(len(area), dtype=np.int32)
    # Bisection on texels a square meter, in the exponent: areas differ by many orders.
    low = np.log(high) - 100.0
    high = np.log(high)
    for _ in range(50):
        middle = 0.5 * (low + high)
        legs = _legs_at(area, np.exp(middle), longest)
        taken = np.where(legs > 1, 0.5 * (legs + 1) * (legs + 2), 1).sum()
        low, high = (middle, high) if taken <= allowed else (low, middle)
    return _legs_at(area, np.exp(low), longest)


def _legs_at(area: Array, density: float, longest: int) -> Array:
    legs = np.floor(np.sqrt(2.0 * area * density) - 1.5)
    return np.asarray(np.clip(legs, 1, longest).astype(np.int32))


def _steps(leg: Array) -> tuple[Array, Array, Array]:
    """Return i, j and the triangle of every texel with i + j < leg."""
    count = leg.astype(np.int64)
    row_triangle = np.repeat(np.arange(len(leg)), count)
    row_j = run_numbers(count)
    length = count[row_triangle] - row_j
    return run_numbers(length), np.repeat(row_j, length), np.repeat(row_triangle, length)
