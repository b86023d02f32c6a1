"""Every object in a rectangle of its own: instances of a shape have one layout, moved by whole texels.

Engines then need one mesh for all of them, with a scale and an offset each. Corners are in steps of a texel,
so that float32 UVs give the same layout back wherever its rectangle is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...base import SILENT, BakeError, Progress
from ...options import TEXEL_STEPS
from .collapse import ChartPlaces
from .packing import MIN_CHART_WIDTH, ChartJob, Limits, Packing, chart_job, pack_at, page_size, too_dense

Float = NDArray[np.float64]
Int = NDArray[np.int64]

TRIALS, PRECISION = 16, 1.01
"""Densities tried at most, and the ratio of one that does not fit to one that does."""


@dataclass(frozen=True)
class Shape:
    """The charts of one shape, and how many triangles it has.

    rows (u,): Its triangles that have a chart; the others have no area.
    """

    job: ChartJob | None
    rows: Int
    count: int

    def laid_out(self, density: float) -> tuple[Float, tuple[int, int]]:
        """Return corners (count, 3, 2) [texels] at a density, and the width and height that they take."""
        if self.job is None:
            return np.full((self.count, 3, 2), 0.5), (1, 1)
        packing = pack_at(self.job, density)
        texels = np.rint(TEXEL_STEPS * packing.resolution * packing.uv.astype(np.float64)) / TEXEL_STEPS
        texels -= np.floor(texels.min(axis=(0, 1)))
        width, height = np.maximum(np.ceil(texels.max(axis=(0, 1))), 1.0).astype(int).tolist()
        corners = np.empty((self.count, 3, 2))
        corners[:] = texels[0, 0]
        corners[self.rows] = texels
        return corners, (width, height)


def shape_of(uv: Float, chart: Int, limits: Limits, places: ChartPlaces | None) -> Shape:
    """Return a shape of charts in meters; triangles of chart −1 are put on a corner of another."""
    rows = np.flatnonzero(chart >= 0)
    job = chart_job(uv[rows], chart[rows], limits, places) if len(rows) else None
    return Shape(job, rows, len(uv))


def pack_rectangles(
    shapes: Sequence[Shape],
    shape: Sequence[int],
    resolution: int,
    density: float | None,
    limits: Limits,
    progress: Progress = SILENT,
) -> Packing:
    """Pack objects into a square page, each in its rectangle, upright.

    Parameters
    ----------
    shapes : sequence of Shape
    shape : sequence of int
        Which of them each object has.
    resolution : int
        The page's size, if no density is given.
    density : float or None
        Texels per meter; the page becomes the smallest square multiple of 4 that holds all.
    limits : Limits
    progress : Progress

    Raises
    ------
    BakeError
        If the density asks for more than the largest page.
    """
    if density is not None:
        return _at_density(shapes, shape, density, limits)
    finer = resolution
    while (found := _into(shapes, shape, finer, limits, progress)) is None:
        # Too small to keep the rectangles apart: pack a finer page and shrink it.
        finer *= 2
        shapes = [replace(each, job=each.job and replace(each.job, places=None)) for each in shapes]
    uv, finest = found
    return Packing(uv, resolution, finest * resolution / finer, crowded=finer != resolution)


def _at_density(shapes: Sequence[Shape], shape: Sequence[int], density: float, limits: Limits) -> Packing:
    laid = [each.laid_out(density) for each in shapes]
    sizes = np.array([laid[each][1] for each in shape])
    gap, border = limits.gap(1), limits.border(1)
    side = page_size(max(math.sqrt(float((sizes + gap).prod(axis=1).sum())), float(sizes.max()) + 2 * border))
    while True:
        if side > limits.side:
            raise too_dense(density, limits.side)
        places, height = placed(sizes + gap, side - 2 * border + gap)
        if height <= side - 2 * border + gap:
            return Packing(_uv(laid, shape, places + border, side), side, density)
        side = page_size(1.01 * side)


def _into(
    shapes: Sequence[Shape], shape: Sequence[int], resolution: int, limits: Limits, progress: Progress
) -> tuple[NDArray[np.float32], float] | None:
    """Return UVs at the largest density that fits a page, and that density; None if none does."""
    gap, border = limits.gap(1), limits.border(1)
    room = resolution - 2 * border + gap
    longest = max((float(each.job.extent.max()) for each in shapes if each.job is not None), default=1.0)
    area = sum(each.job.area for number in shape if (each := shapes[number]).job is not None)
    low, high, best = 0.0, math.inf, None
    density = min(math.sqrt(0.7 * room**2 / max(area, 1e-300)), room / longest)
    for _ in range(TRIALS):
        progress.at(0.0)
        try:
            laid = [each.laid_out(density) for each in shapes]
        except BakeError:  # one of them alone needs more than the largest page
            high, density = density, 0.5 * (low + density)
            continue
        sizes = np.array([laid[each][1] for each in shape])
        places, height = placed(sizes + gap, room)
        if height <= room:
            low, best = density, (_uv(laid, shape, places + border, resolution), density)
        else:
            high = density
            if low == 0.0 and density * longest < MIN_CHART_WIDTH:
                return None
        if high < low * PRECISION:
            break
        likely = density * min(max(math.sqrt(room / max(height, 1.0)), 0.5), 1.5)
        if math.isinf(high):
            density = max(likely, low * PRECISION)
        elif low == 0.0:
            density = min(likely, high / PRECISION)
        else:
            density = likely if low < likely < high else math.sqrt(low * high)
    return best


def _uv(
    laid: Sequence[tuple[Float, tuple[int, int]]], shape: Sequence[int], places: Int, side: int
) -> NDArray[np.float32]:
    """Return the UVs of all objects, one after the other."""
    corners = [laid[each][0] + place for each, place in zip(shape, places, strict=True)]
    return (np.concatenate(corners) / side).astype(np.float32)


def placed(sizes: Int, width: int) -> tuple[Int, float]:
    """Place rectangles (n, 2) above each other in a strip, the highest first, each as low as it goes.

    Returns places (n, 2): Of their lower left corners.
    Returns height: That they take; infinite if one is wider than the strip.
    """
    places = np.zeros((len(sizes), 2), dtype=np.int64)
    if int(sizes[:, 0].max(initial=0)) > width:
        return places, math.inf
    skyline = [(0, 0)]  # from where on to the right the strip is filled up to which height
    top = 0
    for number in np.lexsort((-sizes[:, 0], -sizes[:, 1])).tolist():
        wide, high = sizes[number].tolist()
        x, y = _lowest(skyline, wide, width)
        places[number] = x, y
        top = max(top, y + high)
        _raise(skyline, x, wide, y + high, width)
    return places, float(top)


def _lowest(skyline: list[tuple[int, int]], wide: int, width: int) -> tuple[int, int]:
    """Return where a rectangle of a width lies lowest, leftmost of several."""
    best_x, best_y = 0, -1
    for first, (x, level) in enumerate(skyline):
        if x + wide > width:
            break
        if 0 <= best_y <= level:
            continue
        y = level
        for start, below in skyline[first + 1 :]:
            if start >= x + wide:
                break
            y = max(y, below)
        if best_y < 0 or y < best_y:
            best_x, best_y = x, y
    return best_x, best_y


def _raise(skyline: list[tuple[int, int]], x: int, wide: int, level: int, width: int) -> None:
    """Fill a strip up to a level from x on."""
    before = [part for part in skyline if part[0] < x]
    inside = [part for part in skyline if part[0] <= x + wide]
    after = [part for part in skyline if part[0] > x + wide]
    edge = [(x + wide, inside[-1][1])] if x + wide < width else []
    skyline[:] = [*before, (x, level), *edge, *after]
