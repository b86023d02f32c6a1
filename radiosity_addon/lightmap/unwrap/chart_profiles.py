"""What the packer knows of a chart: its extent and its four profiles, in whole cells.

The bottom profile of a chart holds, for each column of cells, the lowest cell it reaches, the top
profile one past the highest; left and right are the same for rows. From them follow the
profiles of the chart turned by quarter turns. Charts are never mirrored.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...numerics import numbered, run_numbers

Float = NDArray[np.float64]
Int = NDArray[np.int64]

_ROUNDING = 1e-6
"""Cells; an edge on a cell's border must not claim the next cell for a rounding error."""


@dataclass(frozen=True)
class Shapes:
    """All charts at one scale, as ragged arrays.

    width, height (count,) int64: Cells each chart's bounding box takes.
    column_start, row_start (count + 1,) int64: Where a chart's columns and rows begin in the profiles.
    bottom, top (columns in all,) int64.
    left, right (rows in all,) int64.
    boxy (count,) bool: Whether the chart fills its bounding box; half a turn then changes nothing.
    """

    width: Int
    height: Int
    column_start: Int
    row_start: Int
    bottom: Int
    top: Int
    left: Int
    right: Int
    boxy: NDArray[np.bool_]

    def turned(self, chart: int, quarter: int) -> tuple[Int, Int, int]:
        """Return (bottom, top, height) of a chart turned by quarter turns counter-clockwise."""
        width, height = int(self.width[chart]), int(self.height[chart])
        if quarter % 2 == 0:
            part = slice(self.column_start[chart], self.column_start[chart + 1])
            low, high = self.bottom[part], self.top[part]
        else:
            part = slice(self.row_start[chart], self.row_start[chart + 1])
            low, high = self.left[part], self.right[part]
        if quarter == 0:
            return low, high, height
        if quarter == 1:
            return low[::-1], high[::-1], width
        if quarter == 2:
            return height - high[::-1], height - low[::-1], height
        return width - high, width - low, width


def outline(uv: Float, chart: Int) -> tuple[Float, Int]:
    """Return (e, 2, 2) edges that bound the charts of (n, 3, 2) triangles, and each edge's chart."""
    edges = np.stack((uv, np.roll(uv, -1, axis=1)), axis=2).reshape(-1, 2, 2)
    owner = np.repeat(chart, 3)
    corners = np.column_stack((np.repeat(chart, 3), uv.reshape(-1, 2)))
    corner = numbered(corners).reshape(-1, 3)
    ends = np.sort(np.stack((corner, np.roll(corner, -1, axis=1)), axis=-1).reshape(-1, 2), axis=1)
    key = ends[:, 0] * (int(corner.max()) + 1) + ends[:, 1]
    _, first, times = np.unique(key, return_index=True, return_counts=True)
    # A chart that is closed up in itself has no outline: all its edges are as good.
    kept = np.sort(first[times == 1])
    missing = np.setdiff1d(chart, owner[kept])
    kept = np.union1d(kept, np.flatnonzero(np.isin(owner, missing)))
    return edges[kept], owner[kept]


def measure(edges: Float, owner: Int, extent: Float) -> Shapes:
    """Find the shapes of charts.

    edges (e, 2, 2): The charts' outlines [cells], each chart's box starting at (0, 0).
    owner (e,) int64: The chart of each edge.
    extent (count, 2): Width and height of each chart's box [cells].
    """
    count = len(extent)
    size = np.maximum(np.ceil(extent - _ROUNDING).astype(np.int64), 1)
    start, end = edges[:, 0], edges[:, 1]
    column_start, bottom, top = _profile(start, end, owner, size[:, 0], size[:, 1])
    row_start, left, right = _profile(start[:, ::-1], end[:, ::-1], owner, size[:, 1], size[:, 0])
    unused = size[:, 1].repeat(size[:, 0]) - (top - bottom)
    empty = np.bincount(np.repeat(np.arange(count), size[:, 0]), unused, count)
    return Shapes(
        size[:, 0], size[:, 1], column_start, row_start, bottom, top, left, right, np.asarray(empty == 0)
    )


def _profile(start: Float, end: Float, owner: Int, columns: Int, height: Int) -> tuple[Int, Int, Int]:
    """Return (offsets, lowest, highest) over each chart's columns, from its edges."""
    offset = np.concatenate(([0], np.cumsum(columns)))
    low = np.repeat(height, columns).astype(np.float64)
    high = np.zeros(offset[-1])
    near, far = np.minimum(start[:, 0], end[:, 0]), np.maximum(start[:, 0], end[:, 0])
    first = np.clip(np.floor(near + _ROUNDING).astype(np.int64), 0, columns[owner] - 1)
    last = np.clip(np.ceil(far - _ROUNDING).astype(np.int64), first + 1, columns[owner])
    count = last - first
    edge = np.repeat(np.arange(len(start)), count)
    column = run_numbers(count, first)
    run = end[edge, 0] - start[edge, 0]
    steep = np.abs(run) < 1e-12
    slope = np.where(steep, 1.0, run)
    t_0 = np.where(steep, 0.0, np.clip((column - start[edge, 0]) / slope, 0, 1))
    t_1 = np.where(steep, 1.0, np.clip((column + 1 - start[edge, 0]) / slope, 0, 1))
    rise = end[edge, 1] - start[edge, 1]
    y_0, y_1 = start[edge, 1] + t_0 * rise, start[edge, 1] + t_1 * rise
    place = offset[owner[edge]] + column
    np.minimum.at(low, place, np.minimum(y_0, y_1))
    np.maximum.at(high, place, np.maximum(y_0, y_1))
    lowest = np.maximum(np.floor(low + _ROUNDING).astype(np.int64), 0)
    highest = np.minimum(np.ceil(high - _ROUNDING).astype(np.int64), np.repeat(height, columns))
    # A column between two parts of a chart is empty: one cell is claimed, whichever.
    lowest = np.minimum(lowest, np.repeat(height, columns) - 1)
    return offset, lowest, np.maximum(highest, lowest + 1)


def align(uv: Float, chart: Int, count: int) -> Float:
    """Turn each chart so that its bounding box is smallest; its lower left corner becomes 0.

    The smallest box has a side along an edge of the chart's convex hull. Angles are searched
    in 2° steps, refined, and put on the nearest edge of the chart if that does no harm, so
    that a rectangle comes out exactly upright.
    """
    angle = np.zeros(count)
    best = np.full(count, np.inf)
    for step, around in ((np.pi / 90, 45), (np.pi / 900, 12), (np.pi / 9000, 12)):
        middle = angle.copy()
        for k in range(around):
            trial = middle + (k - around // 2) * step
            area = _box_area(uv, chart, count, trial)
            better = area < best * (1 - 1e-12)
            best, angle = np.where(better, area, best), np.where(better, trial, angle)
    edge = (np.roll(uv, -1, axis=1) - uv).reshape(-1, 2)
    owner = np.repeat(chart, 3)
    direction = -np.arctan2(edge[:, 1], edge[:, 0])
    miss = (direction - angle[owner] + np.pi / 4) % (np.pi / 2) - np.pi / 4
    miss[(edge == 0).all(axis=1)] = np.inf
    nearest = np.lexsort((np.abs(miss), owner))
    first = nearest[np.searchsorted(owner[nearest], np.arange(count))]
    snapped = angle + np.where(np.isfinite(miss[first]), miss[first], 0.0)
    harmless = _box_area(uv, chart, count, snapped) <= best * (1 + 1e-6)
    turned = _turn(uv, chart, np.where(harmless, snapped, angle))
    low = np.full((count, 2), np.inf)
    np.minimum.at(low, chart, turned.min(axis=1))
    return np.asarray(turned - low[chart][:, None])


def _turn(uv: Float, chart: Int, angle: Float) -> Float:
    cos, sin = np.cos(angle)[chart, None], np.sin(angle)[chart, None]
    return np.stack((uv[..., 0] * cos - uv[..., 1] * sin, uv[..., 0] * sin + uv[..., 1] * cos), axis=-1)


def _box_area(uv: Float, chart: Int, count: int, angle: Float) -> Float:
    turned = _turn(uv, chart, angle)
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, chart, turned.min(axis=1))
    np.maximum.at(high, chart, turned.max(axis=1))
    return np.asarray((high - low).prod(axis=1))
