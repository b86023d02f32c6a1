"""How many rays gather points take: more where coarser points around them see light that varies more.

A point of a lattice of every fourth texel speaks for sixteen of them, or for fewer if more points have to
speak for each texel. The noise of all texels together is least if the rays of a point are in proportion to
the square root of that (`GatherSettings.times_rays`).

Rays come in runs of the same length; a point takes one or several, which go on in one sequence. Each run has
a row of its own among the stored hits, and a point stands for the mean of its rows. The number of runs
depends on what points of coarser levels met, never on what the point itself meets: so no mean is biased
(a point that took further rays only after a lucky one would be darkened in the mean).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...numerics import TILE, Array, Scratch, fill_chunks, tiles, trim
from ..points import GatherPoints
from .source_means import by_channel

RUNS = 2
"""Runs of rays of a point where every texel is one, in the mean; on coarser lattices `times_rays` as many."""

MOST_RUNS = 16
"""No point takes more, where the mean is `RUNS`."""

EVEN = 0.25
"""This part of the rays is for all points alike; the others are in proportion to the noise expected."""

GOLDEN_RATIO = 0.5 * (1.0 + 5.0**0.5)

CHUNK = 1 << 14
"""Points whose neighbors are looked up at once."""

Values = Callable[[Array], Array]
"""(g, k) int32 sources → (g, k, 3): their radiosity as far as it is known [W/m²]."""


def variance_of(sources: Array, tints: Array | None, values: Values) -> Array:
    """Return (g,) the variance of what the rays of rows brought, summed over the channels.

    tints (g, rays, 3): What it is multiplied with on its way.
    """
    result = np.empty(len(sources))
    for rows in tiles(len(sources), CHUNK):
        brought = values(sources[rows])
        if tints is not None:
            brought = brought * tints[rows]
        result[rows] = brought.var(axis=1).sum(axis=1)
    return result


def runs_of(
    points: GatherPoints, variance: Array, chosen: Array, mean: float = RUNS, progress: Progress = SILENT
) -> Array:
    """Return (c,) int: how many runs each chosen texel takes.

    points: Those of coarser levels, …
    variance (g,): … and of each, that of what its rays brought. Without any all take as many.
    mean: Of the runs of a point.
    """
    if not len(chosen) or not variance.any():
        return _rounded(np.full(len(chosen), mean), chosen)
    noise = np.empty(len(chosen))
    expected = partial(_expected_noise, points, variance, chosen)
    fill_chunks(expected, noise, len(chosen), CHUNK, points.threads, progress)
    share = EVEN + (1.0 - EVEN) * noise / max(float(noise.mean()), 1e-300)
    return np.clip(_rounded(mean * share, chosen), 1, round(MOST_RUNS * mean / RUNS))


def further_runs(count: Array, texel: Array, factor: float) -> Array:
    """Return (g,) int: how many more runs points at texels take that have some and want times as many."""
    return np.maximum(_rounded(factor * count, texel), count) - count


def _rounded(runs: Array, texel: Array) -> Array:
    """Round fractions up as often as they are large, so that the mean over texels stays."""
    return np.floor(runs + np.modf(GOLDEN_RATIO * texel)[0]).astype(np.int64)


def _expected_noise(points: GatherPoints, variance: Array, chosen: Array, rows: slice) -> Array:
    """Return (r,) the noise of a ray at some of the chosen texels: that of the points around them."""
    row, point = points.pairs(chosen[rows])
    count = np.bincount(row, minlength=rows.stop - rows.start)
    total = np.bincount(row, variance[point], minlength=len(count))
    return np.sqrt(np.where(count > 0, total / np.maximum(count, 1), variance.mean()))


def points_of(run: Array) -> tuple[Array, Array]:
    """Return (p,) the first row of each point, and how many it has, of rows with run numbers (g,) from 0."""
    first = np.flatnonzero(run == 0)
    return first, np.diff(np.append(first, len(run)))


def runs_with(run: Array) -> Array:
    """Return (g,) int16: how many runs the point of each row has, see `points_of`."""
    _, count = points_of(run)
    return over_runs(count.astype(np.int16), run)


def noise_weights(run: Array, count: Array) -> Array:
    """Return (r,) float32: times these, means of rows have a sample of the noise for their mean over a point.

    The mean of half of a point's runs differs from that of all by about as much as that of all is off.
    A single run has no halves: 0.

    run, count (r,) int: Which of its point's runs each row is, from 0, and how many these are.
    """
    half = np.maximum(count // 2, 1)
    weights = np.where(run < half, count / half, 0.0) - 1.0
    return (weights * np.sqrt(half / np.maximum(count - half, 1))).astype(np.float32)


def mean_over_runs(values: Array, run: Array, scratch: Scratch | None = None) -> Array:
    """Return (p, k) the means of (g, k) values over the runs of each point, numbered as for `points_of`."""
    result = by_channel(number_of_points(run), values.shape[1], scratch)
    for points, rows, first in _tiles_of_points(run):
        count = np.diff(np.append(first, rows.stop - rows.start))
        for channel in range(values.shape[1]):
            result[points, channel] = np.add.reduceat(values[rows, channel], first) / count
    return result


def over_runs(values: Array, run: Array) -> Array:
    """Return (g,) what values (p,) of points are for each of their runs."""
    result = np.empty(len(run), dtype=values.dtype)
    for points, rows, first in _tiles_of_points(run):
        result[rows] = np.repeat(values[points], np.diff(np.append(first, rows.stop - rows.start)))
    return result


def any_of_runs(marked: Array, run: Array) -> Array:
    """Return (p,) bool: which points have a run that is marked, (g,) bool."""
    result = np.empty(number_of_points(run), dtype=bool)
    for points, rows, first in _tiles_of_points(run):
        result[points] = np.logical_or.reduceat(marked[rows], first)
    return result


def number_of_points(run: Array) -> int:
    """Return how many points rows with run numbers (g,) are of."""
    return sum(int(np.count_nonzero(run[rows] == 0)) for rows in tiles(len(run)))


def _tiles_of_points(run: Array) -> Iterator[tuple[slice, slice, Array]]:
    """Yield some points at a time, the rows that are theirs, and where in these each point begins."""
    done = start = 0
    while start < len(run):
        stop = min(start + TILE, len(run))
        while stop < len(run) and run[stop] != 0:
            stop += 1
        first = np.flatnonzero(run[start:stop] == 0)
        yield slice(done, done + len(first)), slice(start, stop), first
        trim()
        done, start = done + len(first), stop
