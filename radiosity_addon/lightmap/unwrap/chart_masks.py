"""The cells that charts cover: a chart's real shape, holes and concavities included.

A cell is covered if any triangle reaches into it. Rows are kept as integers whose bits are cells, the first
column the lowest bit. Charts are never mirrored.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...numerics import run_numbers

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

_ROUNDING = 1e-6
"""Cells; an edge on a cell's border must not claim the next cell for a rounding error."""


@dataclass(frozen=True, eq=False)
class Mask:
    """A chart's cells.

    width: In columns.
    rows: As integers.
    bands: The first row and the one past the last of equal rows, and their runs: first column and length.
        The widest come first: they are met most often.
    longest (height,) int64: The length of the longest run of cells in each row.
    """

    width: int
    rows: tuple[int, ...]
    bands: tuple[tuple[int, int, tuple[tuple[int, int], ...]], ...]
    longest: Int

    @property
    def height(self) -> int:
        """The number of rows."""
        return len(self.rows)


def mask_of(width: int, rows: tuple[int, ...]) -> Mask:
    """Return the mask of some rows."""
    bands, start = [], 0
    for end in range(1, len(rows) + 1):
        if end == len(rows) or rows[end] != rows[start]:
            bands.append((start, end, tuple(runs_of(rows[start]))))
            start = end
    widest = [max((length for _, length in runs), default=0) for _, _, runs in bands]
    longest = np.repeat(widest, [end - start for start, end, _ in bands])
    order = sorted(range(len(bands)), key=lambda band: -widest[band])
    return Mask(width, rows, tuple(bands[band] for band in order), longest)


def runs_of(row: int) -> Iterator[tuple[int, int]]:
    """Yield first column and length of the runs of set bits."""
    column = 0
    while row:
        skip = (row & -row).bit_length() - 1
        row >>= skip
        length = (~row & (row + 1)).bit_length() - 1
        yield column + skip, length
        row >>= length
        column += skip + length


@dataclass(frozen=True)
class ChartMasks:
    """All charts at one scale.

    width, height (count,) int64: Cells each chart's bounding box takes.
    start (count + 1,) int64: Where each chart's cells begin.
    covered (cells in all,) bool: Row by row.
    """

    width: Int
    height: Int
    start: Int
    covered: Bool
    _made: dict[tuple[int, int], Mask] = field(default_factory=dict)
    _alike: dict[tuple[int, tuple[int, ...]], Mask] = field(default_factory=dict)

    @cached_property
    def boxy(self) -> Bool:
        """(count,) bool: whether a chart fills its bounding box; half a turn then changes nothing."""
        return np.asarray(np.add.reduceat(self.covered, self.start[:-1]) == self.width * self.height)

    def turned(self, chart: int, quarter: int) -> Mask:
        """Return a chart turned by quarter turns counter-clockwise; charts of one shape share a mask."""
        found = self._made.get((chart, quarter))
        if found is None:
            found = self._made[chart, quarter] = self._turned(chart, quarter)
        return found

    def _turned(self, chart: int, quarter: int) -> Mask:
        if self.boxy[chart]:
            sides = int(self.width[chart]), int(self.height[chart])
            width, height = sides if quarter % 2 == 0 else reversed(sides)
            return self._alike_to(width, ((1 << width) - 1,) * height)
        cells = self.covered[self.start[chart] : self.start[chart + 1]]
        grid = np.rot90(cells.reshape(-1, self.width[chart]), -quarter)
        packed = np.packbits(grid, axis=1, bitorder="little")
        return self._alike_to(grid.shape[1], tuple(int.from_bytes(row.tobytes(), "little") for row in packed))

    def _alike_to(self, width: int, rows: tuple[int, ...]) -> Mask:
        """Return the mask of some rows, the same each time."""
        if (width, rows) not in self._alike:
            self._alike[width, rows] = mask_of(width, rows)
        return self._alike[width, rows]


def chart_masks(uv: Float, chart: Int, extent: Float) -> ChartMasks:
    """Find the cells that charts cover.

    uv (n, 3, 2): Triangles [cells], each chart's box starting at (0, 0).
    chart (n,) int64.
    extent (count, 2): Width and height of each chart's box [cells].
    """
    width, height = np.maximum(np.ceil(extent - _ROUNDING).astype(np.int64), 1).T
    # One column more, where the last run ends.
    start = np.concatenate(([0], np.cumsum((width + 1) * height)))
    steps = np.zeros(int(start[-1]), dtype=np.int32)
    triangle, row = _rows(uv, height[chart])
    first, end = _columns(uv[triangle], row, width[chart[triangle]])
    begin = start[chart[triangle]] + row * (width[chart[triangle]] + 1)
    np.add.at(steps, begin + first, 1)
    np.add.at(steps, begin + end, -1)
    covered = np.cumsum(steps) > 0
    last = np.zeros(len(steps), dtype=np.bool_)
    last[np.repeat(start[:-1] + width, height) + run_numbers(height) * np.repeat(width + 1, height)] = True
    return ChartMasks(width, height, np.concatenate(([0], np.cumsum(width * height))), covered[~last])


def _rows(uv: Float, height: Int) -> tuple[Int, Int]:
    """Return (triangle, row) for every row that each triangle reaches."""
    v = uv[..., 1]
    first = np.clip(np.floor(v.min(axis=1) + _ROUNDING).astype(np.int64), 0, height - 1)
    last = np.clip(np.ceil(v.max(axis=1) - _ROUNDING).astype(np.int64), first + 1, height)
    count = last - first
    return np.repeat(np.arange(len(uv)), count), run_numbers(count, first)


def _columns(corners: Float, row: Int, width: Int) -> tuple[Int, Int]:
    """Return the first column that a triangle reaches within a row, and the one past its last."""
    following = np.roll(corners, -1, axis=1)
    start, rise = corners[..., 1], following[..., 1] - corners[..., 1]
    level = rise == 0
    slope = np.where(level, 1.0, rise)
    bottom = row[:, None].astype(np.float64)
    t_0 = np.where(level, 0.0, np.clip((bottom - start) / slope, 0, 1))
    t_1 = np.where(level, 1.0, np.clip((bottom + 1 - start) / slope, 0, 1))
    run = following[..., 0] - corners[..., 0]
    x_0, x_1 = corners[..., 0] + t_0 * run, corners[..., 0] + t_1 * run
    low, high = np.minimum(start, following[..., 1]), np.maximum(start, following[..., 1])
    # An edge outside the row would be clamped to its nearer end.
    apart = (high < bottom - _ROUNDING) | (low > bottom + 1 + _ROUNDING)
    left = np.where(apart, np.inf, np.minimum(x_0, x_1)).min(axis=1)
    right = np.where(apart, -np.inf, np.maximum(x_0, x_1)).max(axis=1)
    first = np.clip(np.floor(left + _ROUNDING), 0, width - 1).astype(np.int64)
    end = np.clip(np.ceil(right - _ROUNDING).astype(np.int64), first + 1, width)
    return first, end
