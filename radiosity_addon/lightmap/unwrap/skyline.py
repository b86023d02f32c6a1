"""Placing charts in a strip of fixed width so that it grows as little as possible.

The skyline holds, for every column of cells, how far it is filled; a chart falls onto it at the
place where it ends lowest, bottom profile against skyline. Hollows that a chart covers up are kept
as free rectangles for smaller ones (Jylänki, A thousand ways to pack the bin, 2010: skyline with
waste map, here with profiles instead of rectangles as in Lévy et al., Least squares conformal maps,
2002). The loop over charts is sequential by nature; all positions of one chart are one array.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from .chart_profiles import Shapes

Int = NDArray[np.int64]

ALL_TURNS = 2000
"""Up to this many charts every chart is tried in four directions, beyond in two."""


@dataclass(frozen=True)
class Placement:
    """Where each chart's box begins [cells], its quarter turns, and the height filled."""

    x: Int
    y: Int
    quarter: Int
    height: int


@dataclass
class _Strip:
    """The state of the packing."""

    skyline: Int
    gap: int
    least: int
    holes: Int = field(default_factory=lambda: np.zeros((0, 4), dtype=np.int64))

    def take_hole(self, width: int, height: int) -> tuple[int, int] | None:
        """Return the corner of the tightest free rectangle that fits, and use it up."""
        fits = (self.holes[:, 2] >= width) & (self.holes[:, 3] >= height)
        if not fits.any():
            return None
        spare = np.where(fits, self.holes[:, 2] * self.holes[:, 3], np.iinfo(np.int64).max)
        index = int(spare.argmin())
        x, y, w, h = (int(value) for value in self.holes[index])
        right, above = w - width - self.gap, h - height - self.gap
        # Cut the rest into two rectangles along the longer leftover.
        if right > above:
            rest = [(x + width + self.gap, y, right, h), (x, y + height + self.gap, width, above)]
        else:
            rest = [(x, y + height + self.gap, w, above), (x + width + self.gap, y, right, height)]
        self.holes = np.delete(self.holes, index, axis=0)
        self._keep(np.array(rest, dtype=np.int64))
        return x, y

    def drop(self, bottom: Int) -> tuple[int, int, int]:
        """Return (x, y, waste) of the lowest place for a bottom profile."""
        width = len(bottom)
        if bottom.any():
            rest = (sliding_window_view(self.skyline, width) - bottom).max(axis=1)
        else:
            rest = _running_max(self.skyline, width)
        rest = np.maximum(rest, 0)
        y = int(rest.min())
        candidates = np.flatnonzero(rest == y)
        if len(candidates) > 1:
            filled = np.concatenate(([0], np.cumsum(self.skyline)))
            under = filled[candidates + width] - filled[candidates]
            x = int(candidates[under.argmax()])
        else:
            x = int(candidates[0])
        return x, y, int((y + bottom - self.skyline[x : x + width]).sum())

    def put(self, x: int, y: int, bottom: Int, top: Int) -> None:
        """Raise the skyline over a chart, and its margin, and keep the hollows below it."""
        width, gap = len(bottom), self.gap
        # What hangs down must also stay a gap away from a hollow next to it.
        ceiling, above = bottom + (y - gap), top + (y + gap)
        wide = np.full(width + 2 * gap, -1, dtype=np.int64)
        wide[gap : gap + width] = above
        for shift in range(1, gap + 1):
            np.minimum(ceiling[shift:], bottom[:-shift] + (y - gap), out=ceiling[shift:])
            np.minimum(ceiling[:-shift], bottom[shift:] + (y - gap), out=ceiling[:-shift])
            for start in (gap - shift, gap + shift):
                np.maximum(wide[start : start + width], above, out=wide[start : start + width])
        under = self.skyline[x : x + width]
        if int((ceiling - under).max()) >= self.least:
            self._keep(_hollows(x, under, ceiling, self.least))
        left, right = max(x - gap, 0), min(x + width + gap, len(self.skyline))
        part = self.skyline[left:right]
        np.maximum(part, wide[left - x + gap : right - x + gap], out=part)

    def _keep(self, rectangles: Int) -> None:
        worth = (rectangles[:, 2:] >= self.least).all(axis=1)
        if worth.any():
            self.holes = np.concatenate((self.holes, rectangles[worth]))


def _hollows(x: int, floor: Int, ceiling: Int, least: int) -> Int:
    """Return (n, 4) rectangles x, y, width, height between a stepped floor and a ceiling."""
    cuts = np.flatnonzero(floor[1:] != floor[:-1]) + 1
    starts = np.concatenate(([0], cuts))
    ends = np.concatenate((cuts, [len(floor)]))
    height = np.minimum.reduceat(ceiling, starts) - floor[starts]
    kept = (height >= least) & (ends - starts >= least)
    return np.asarray(np.stack((x + starts, floor[starts], ends - starts, height), axis=-1)[kept])


def _running_max(values: Int, width: int) -> Int:
    """Return the maximum over every window of `width` values."""
    span = 1
    result: Int = values
    while 2 * span <= width:
        result = np.maximum(result[:-span], result[span:])
        span *= 2
    rest = width - span
    widest: Int = np.maximum(result[: len(result) - rest], result[rest:])
    return widest


def place(
    shapes: tuple[Shapes, Shapes], order: Int, width: int, gap: int, limit: int | None, thrifty: bool
) -> Placement | None:
    """Pack all charts, in the given order, into a strip.

    shapes pair of Shapes: As the charts are measured for an even and for an odd number of quarter turns.
    order (count,) int64.
    width: Of the strip [cells].
    gap: Cells that stay free between charts.
    limit: Give up above this height.
    thrifty: Prefer the turn that buries least rather than the one that ends lowest.
    Returns none if a chart is wider than the strip or the limit is passed.
    """
    count = len(order)
    x, y, quarter = (np.zeros(count, dtype=np.int64) for _ in range(3))
    least = int(min(min(shape.width.min(), shape.height.min()) for shape in shapes))
    strip = _Strip(np.zeros(width, dtype=np.int64), gap, least)
    height = 0
    for chart in order.tolist():
        boxes = [
            (int(shapes[0].width[chart]), int(shapes[0].height[chart])),
            (int(shapes[1].height[chart]), int(shapes[1].width[chart])),
        ]
        boxy = shapes[0].boxy[chart]
        turns = range(4) if not boxy and count <= ALL_TURNS else range(1 + (boxes[0] != boxes[1]))
        best: tuple[int, int, int, int] | None = None
        for turn in turns:
            box = boxes[turn % 2]
            corner = strip.take_hole(*box) if turn < 2 and len(strip.holes) else None
            if corner is not None:
                x[chart], y[chart], quarter[chart] = *corner, turn
                break
            if box[0] <= width:
                bottom, _, tall = shapes[turn % 2].turned(chart, turn)
                left, low, waste = strip.drop(bottom)
                score = waste + len(bottom) * low if thrifty else low + tall
                if best is None or score < best[0]:
                    best = score, turn, left, low
        else:
            if best is None:
                return None
            _, turn, left, low = best
            bottom, top, tall = shapes[turn % 2].turned(chart, turn)
            strip.put(left, low, bottom, top)
            x[chart], y[chart], quarter[chart] = left, low, turn
            height = max(height, low + tall)
            if limit is not None and height > limit:
                return None
    return Placement(x, y, quarter, height)
