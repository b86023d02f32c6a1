"""Placing charts by their real shapes: each at the lowest free place, hollows and concavities included.

The page's rows are integers whose bits are taken cells: a shift and an "or" test all places of a row at once.
A chart fits where its runs of cells, row by row, meet only free cells; places whose rows have no free run as
long are left out before that. The loop over charts is sequential by nature.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from .chart_masks import ChartMasks, Mask

Int = NDArray[np.int64]

FIRST_ROWS, MORE_ROWS = 8, 4
"""A place is looked for in so many rows at first, and in so many times as many each time there is none:
mostly the first row from the last place of the same shape on has one."""


@dataclass(frozen=True)
class Placement:
    """Where each chart's box begins [cells], its quarter turns, and the height filled."""

    x: Int
    y: Int
    quarter: Int
    height: int


def place(
    masks: tuple[ChartMasks, ChartMasks], order: Int, width: int, height: int, gap: int
) -> tuple[Placement | None, float]:
    """Place all charts, in the given order, in a room of width × height cells.

    masks pair of ChartMasks: As the charts are for an even and for an odd number of quarter turns.
    order (count,) int64.
    gap: Cells that stay free between charts.
    Returns the placement, or None if the room is too small, and which part of the charts' cells was placed.
    """
    count = len(order)
    x, y, quarter = (np.zeros(count, dtype=np.int64) for _ in range(3))
    page, boxy, top = _Page(width, height, gap), masks[0].boxy, 0
    cells = (masks[0].width + gap) * (masks[0].height + gap)
    done = 0
    for chart in order.tolist():
        square = masks[0].width[chart] == masks[0].height[chart]
        turns = range(4) if not boxy[chart] else range(1 if square and masks[0] is masks[1] else 2)
        best: tuple[int, int, int, int] | None = None
        for turn in turns:
            mask = masks[turn % 2].turned(chart, turn)
            # A place no better than the best so far is of no use.
            below = height if best is None else best[0] - 1
            found = page.find(mask, below)
            if found is not None:
                best = found[1] + mask.height, turn, *found
        if best is None:
            return None, done / max(int(cells.sum()), 1)
        end, turn, left, low = best
        page.put(masks[turn % 2].turned(chart, turn), left, low)
        x[chart], y[chart], quarter[chart] = left, low, turn
        top = max(top, end)
        done += int(cells[chart])
    return Placement(x, y, quarter, top), 1.0


class _Page:
    """Rows of taken cells, gaps included, each with the length of its longest free run."""

    def __init__(self, width: int, height: int, gap: int) -> None:
        self._width, self._gap, self._full = width, gap, (1 << width) - 1
        self._rows = [0] * height
        self._longest = np.full(height, width, dtype=np.int64)
        self._lowest: dict[Mask, int] = {}

    def find(self, mask: Mask, below: int) -> tuple[int, int] | None:
        """Return (x, y) of the lowest, then leftmost place of a chart that ends below a row."""
        width, height = mask.width, mask.height
        # The page only fills up: the same shape never fits lower than the last time.
        first, last = self._lowest.get(mask, 0), below - height
        if width > self._width or last < first:
            return None
        places, start, rows = (1 << (self._width - width + 1)) - 1, first, FIRST_ROWS
        while start <= last:
            end = min(start + rows - 1, last)
            found = self._lowest_within(mask, start, end, places)
            if found is not None:
                self._lowest[mask] = found[1]
                return found
            start, rows = end + 1, MORE_ROWS * rows
        self._lowest[mask] = max(first, last + 1)
        return None

    def _lowest_within(self, mask: Mask, first: int, last: int, places: int) -> tuple[int, int] | None:
        """Return (x, y) of the lowest, then leftmost place of a chart that begins in some rows."""
        fits = self._candidates(mask, first, last)
        tall = self._windows(mask.height, first, last) if len(mask.bands) == 1 and len(fits) > 1 else None
        for y in (first + fits).tolist():
            if tall is None:
                free = self._free(mask, y, places)
            else:
                free = ~_met(tall[y - first], mask.bands[0][2]) & places
            if free:
                return (free & -free).bit_length() - 1, y
        return None

    def _candidates(self, mask: Mask, first: int, last: int) -> Int:
        """Return the rows from `first` on where every row of a chart meets a free run as long as it."""
        free = self._longest[first : last + mask.height]
        if len(mask.bands) == 1:
            blocked = np.concatenate(([0], np.cumsum(free < mask.longest[0])))
            return np.flatnonzero(blocked[mask.height :] == blocked[: -mask.height])
        return np.flatnonzero((sliding_window_view(free, mask.height) >= mask.longest).all(axis=1))

    def _windows(self, height: int, first: int, last: int) -> list[int]:
        """Return, for each row, what is taken in `height` rows from it on."""
        rows, span = self._rows[first : last + height], 1
        while 2 * span <= height:
            rows = [one | other for one, other in zip(rows, rows[span:], strict=False)]
            span *= 2
        rest = height - span
        return [one | other for one, other in zip(rows, rows[rest:], strict=False)]

    def _free(self, mask: Mask, y: int, places: int) -> int:
        """Return the columns, as bits, where a chart fits at a row."""
        taken = 0
        for start, end, runs in mask.bands:
            together = 0
            for row in self._rows[y + start : y + end]:
                together |= row
            taken |= _met(together, runs)
            if taken & places == places:
                return 0
        return ~taken & places

    def put(self, mask: Mask, x: int, y: int) -> None:
        """Take a chart's cells and those within the gap around them."""
        gap, height, before, taken = self._gap, mask.height, 0, 0
        for row in range(max(y - gap, 0), min(y + height + gap, len(self._rows))):
            near = 0
            for own in mask.rows[max(row - y - gap, 0) : row - y + gap + 1]:
                near |= own
            if near != before:
                before, taken = near, self._widened(near, x)
            self._rows[row] |= taken
            free = ~self._rows[row] & self._full
            if not _has_run(free, int(self._longest[row])):
                self._longest[row] = _longest_run(free)

    def _widened(self, cells: int, x: int) -> int:
        """Return the cells of a row, moved to a column, and those within the gap beside them."""
        moved = cells << x + self._gap
        wide = moved
        for step in range(1, self._gap + 1):
            wide |= moved << step | moved >> step
        return (wide >> self._gap) & self._full


def _met(taken: int, runs: tuple[tuple[int, int], ...]) -> int:
    """Return, as bits, the columns from which a chart's row, given by its runs, meets taken cells."""
    met = 0
    for first, length in runs:
        spread, span = taken >> first, 1
        while 2 * span <= length:
            spread |= spread >> span
            span *= 2
        met |= spread | spread >> (length - span)
    return met


def _has_run(row: int, length: int) -> bool:
    """Return whether a row has a run of set bits so long: sooner told than how long the longest is."""
    span = 1
    while 2 * span <= length:
        row &= row >> span
        span *= 2
    return length == 0 or row & row >> (length - span) != 0


def _longest_run(row: int) -> int:
    """Return the length of the longest run of set bits."""
    if not row:
        return 0
    # Starts of runs of 1, 2, 4, … bits; then the longest is put together from these.
    starts = [row]
    while (longer := starts[-1] & starts[-1] >> (1 << (len(starts) - 1))) != 0:
        starts.append(longer)
    length, left = 1 << (len(starts) - 1), starts[-1]
    for power in range(len(starts) - 2, -1, -1):
        longer = left & starts[power] >> length
        if longer:
            left, length = longer, length + (1 << power)
    return length
