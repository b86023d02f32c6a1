"""Where light is evaluated: points, and the footprints that samples are spread over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from ...base import SILENT, Progress
from ...lights import Lamp
from ...numerics import (
    Array,
    Scratch,
    TakenRows,
    fill_chunks,
    marked,
    row_numbers,
    stratified_square,
    tiles,
    trim,
)
from ..emitters import EmitterGroup

SPREAD = 4
"""Points of each footprint that all lamps share."""

CHUNK_POINTS = 1 << 15
"""Footprints worked on at once; bounds the temporaries to about 40 MB a thread."""

SAME_GAIN = 0.02
"""Where a lamp gives the center of a footprint what it gives its farthest point, up to this
part, the center stands for all: what bends that little bends a mean by its square."""

UNEVEN = ((0.02, 16), (0.1, 64))
"""Where a few points of a texel differ by more than a part, as next to a lamp or at the rim of a spot's cone,
so many are evaluated. Cells, which only answer rays, are evaluated at few: many cells are averaged."""

SAME_OF_MANY = 0.05
"""The same of each of many lamps."""

DIM = 1.0
"""Of many lamps, what is less than this part of a lamp's mean is evaluated at few points."""

EDGE_DIFFERENCE = 0.5
"""Where center and farthest point differ by more than this part, an edge of the lamp's beam crosses."""

CORNERS = np.array([[0.001, 0.001], [0.999, 0.001], [0.999, 0.999], [0.001, 0.999]], dtype=np.float32)
"""Of a footprint, as its samples are placed."""

NEGLIGIBLE = 0.01
"""What is less than this part of the light expected is taken at the center: over a footprint it may vary."""

DARKEST = 0.25
"""Noise is measured by the light expected, or by this part of the mean where that is darker."""

Sampler = Callable[[Array, Array], Array]
"""(rows, u (r, k, 2)) → (r, k, 3): points of the rows' footprints."""


Lift = Callable[[Array, Array, Array], Array]
"""(rows, starts (r, k, 3), directions (r, k, 3)) → (r, k, 3): where shadow rays start instead."""


@dataclass(frozen=True)
class Footprints:
    """Where light is evaluated.

    points, normals (n, 3): Centers of the footprints, unit normals.
    keys (n,) int: With the seed, what places each point's samples.
    sampler: Spreads the samples over each point's footprint; None keeps them at the point.
    near: Grows a (n,) mask of doubtful points to their neighbors, which then also get the larger number of
        rays.
    starts: From how many samples a point's gather rays start, each of them a run that is stratified by
        itself; None gives every ray its own.
    expected (n,) or None [W/m²]: About how much light there is, a mean of the channels: a lamp that can add
        little to it gets few shadow rays. With None all lamps get the same number.
    runs (n,) int or None: Which run of its key's rays each point takes: one goes on where the last ended.
    lift: Moves the starts of shadow rays off a smooth surface's flat triangles.
    scratch: Makes arrays of what is found at the points.
    """

    points: Array | TakenRows
    normals: Array | TakenRows
    keys: Array
    sampler: Sampler | None = None
    near: Callable[[Array], Array] | None = None
    starts: int | None = None
    expected: Array | None = None
    runs: Array | None = None
    lift: Lift | None = None
    scratch: Scratch = field(default_factory=Scratch)

    def __len__(self) -> int:
        return len(self.points)

    def weight_of(self, irradiance: Array, rows: slice = slice(None)) -> Array:
        """Return (r,) in [0, 1]: how much an irradiance (r,) [W/m²] of rows counts next to the expected."""
        if self.expected is None or not len(irradiance):
            return np.ones(len(irradiance))
        scale = np.maximum(self.expected[rows], DARKEST * self.mean_expected)
        return np.asarray(np.minimum(irradiance / np.maximum(scale, 1e-300), 1.0))

    @cached_property
    def mean_expected(self) -> float:
        """The mean of what is expected [W/m²]."""
        assert self.expected is not None
        mean = float(self.expected.mean())
        trim()
        return mean


class SpreadPoints:
    """The centers of footprints and a few points spread over each, which all lamps share.

    count: Points of each; 1, the center, without a sampler. More than `SPREAD` are for many lamps.
    """

    def __init__(self, at: Footprints, seed: int, threads: int = 0, count: int = SPREAD) -> None:
        self.at, self._seed, self._threads = at, seed, threads
        self.count = count if at.sampler else 1
        self._many = count > SPREAD
        self.same_gain = SAME_OF_MANY if self._many else SAME_GAIN
        # From the center: single precision is too coarse for the place of small things far from the origin.
        self._apart = at.scratch.zeros((len(at), self.count, 3), np.float32)
        self._farthest = np.zeros(len(at), dtype=np.int8)
        if at.sampler is not None:
            into = (self._apart, self._farthest)
            fill_chunks(partial(_spread, at, at.sampler, seed, count), into, len(at), CHUNK_POINTS, threads)

    def points(self, rows: Array | slice, count: int | None = None) -> Array:
        """Return (r, count, 3) float64: the first points of some footprints, or all."""
        return np.asarray(self.at.points[rows, None] + self._apart[rows, :count])

    def gain(self, light: Lamp | EmitterGroup, least: float = 0.0, progress: Progress = SILENT) -> Array:
        """Return (n,) the unoccluded irradiance per unit of strength, a mean over the footprint.

        Where it is no more than `least` in the center, that stands for all, unless a glowing face is
        no farther than the footprint is wide: it may light only what is next to the center. Without
        `least`, where the farthest point gets the same.
        """
        at = self.at
        gain = at.scratch.empty(len(at))
        varies, jump = np.zeros((2, len(at)), dtype=bool)

        into, ask = (gain, varies, jump), partial(_at_centers, self, light, least)
        fill_chunks(ask, into, len(at), CHUNK_POINTS, self._threads, progress.part(0.0, 0.5))
        # Right under a lamp two points may happen to see it alike: their neighbors do not.
        bent = row_numbers(varies if at.near is None or least else at.near(varies))
        average, part = partial(_varying, self, light, self._dim(gain), bent), progress.part(0.5, 1.0)
        fill_chunks(average, gain, len(bent), CHUNK_POINTS, self._threads, part, at=bent)
        if at.near is not None and jump.any():
            # An edge that only cuts a footprint's corner is found from its neighbors.
            lit = marked(len(gain), lambda rows: gain[rows] > 0)
            counts = marked(len(gain), lambda rows: self.matters(light, gain[rows], rows))
            crossed = at.near(jump)
            doubted = row_numbers(at.near(lit) & at.near(~lit) & at.near(counts) & ~crossed)
            crossed[doubted] = self.is_cut(light, doubted, lit[doubted])
            rows = row_numbers(crossed & at.near(counts))
            fine = gain[rows] > self._dim(gain)
            for chosen, count in ((fine, UNEVEN[-1][1]), (~fine, UNEVEN[0][1])):
                gain[rows[chosen]], _ = self.many(light, rows[chosen], count)
        return gain

    def _dim(self, gain: Array) -> float:
        """Return the gain from which on a footprint is worth more points than all lamps share."""
        if not self._many:
            return -np.inf
        return DIM * float(sum(gain[tile].sum() for tile in tiles(len(gain)))) / max(len(gain), 1)

    def matters(self, light: Lamp | EmitterGroup, gain: Array, rows: slice) -> Array:
        """Return (r,) bool: whether a light of this gain (r,) adds to what is expected at rows."""
        return np.asarray(self.at.weight_of(gain * light.strength.mean(), rows) > NEGLIGIBLE)

    def farthest(self, rows: Array) -> Array:
        """Return (r, 3) float64: the points of footprints that are farthest from their centers."""
        apart = self._apart[rows, self._farthest[rows]]
        return np.asarray(self.at.points[rows] + apart)

    def width(self, part: slice | Array) -> Array:
        """Return (r,) how far a footprint reaches from its center, twice: about its width [m]."""
        return np.asarray(2.0 * np.sqrt((self._apart[part] ** 2).sum(axis=2).max(axis=1)))

    def is_cut(self, light: Lamp | EmitterGroup, rows: Array, lit: Array) -> Array:
        """Return (r,) whether any corner of rows' footprints is lit unlike their centers, `lit` (r,)."""
        cut = np.empty(len(rows), dtype=bool)
        for start in range(0, len(rows), CHUNK_POINTS):
            chunk = slice(start, start + CHUNK_POINTS)
            bright = self.gains(light, rows[chunk], self._corners_of(rows[chunk])) > 0.0
            cut[chunk] = (bright != lit[chunk, None]).any(axis=1)
        return cut

    def many(self, light: Lamp | EmitterGroup, rows: Array, count: int) -> tuple[Array, Array]:
        """Return (r,) the mean gain at some rows, by `count` points of each, and its standard deviation."""
        mean, deviation = np.empty((2, len(rows)))
        step = CHUNK_POINTS // count * SPREAD
        for start in range(0, len(rows), step):
            part = slice(start, start + step)
            each = self.gains(light, rows[part], self._points_of(rows[part], count))
            mean[part], deviation[part] = each.mean(axis=1), each.std(axis=1)
        return mean, deviation

    def _corners_of(self, rows: Array) -> Array:
        """Return (r, 4, 3) the corners of some footprints."""
        if not self._many:
            assert self.at.sampler is not None
            return self.at.sampler(rows, np.broadcast_to(CORNERS, (len(rows), *CORNERS.shape)))
        return np.asarray(self.at.points[rows, None] + self._corners[rows])

    @cached_property
    def _corners(self) -> Array:
        """(n, 4, 3) float32: the corners of all footprints from their centers, for many lamps."""
        corners = self.at.scratch.empty((len(self.at), len(CORNERS), 3), np.float32)
        assert self.at.sampler is not None
        fill_chunks(
            partial(_corners_apart, self.at, self.at.sampler),
            corners,
            len(self.at),
            CHUNK_POINTS,
            self._threads,
        )
        return corners

    def _points_of(self, rows: Array, count: int) -> Array:
        """Return (r, count, 3) points of some footprints: shared ones, as far as there are so many."""
        if count <= self.count:
            return self.points(rows, count)
        assert self.at.sampler is not None
        return self.at.sampler(rows, stratified_square(self.at.keys[rows], count, self._seed))

    def gains(self, light: Lamp | EmitterGroup, rows: Array, points: Array) -> Array:
        """Return (r, k) the gain at (r, k, 3) points of some rows' footprints."""
        count = points.shape[1]
        gain = light.unit_irradiance(points.reshape(-1, 3), np.repeat(self.at.normals[rows], count, axis=0))
        return np.asarray(gain.reshape(-1, count))


def _spread(at: Footprints, sampler: Sampler, seed: int, count: int, part: slice) -> tuple[Array, Array]:
    """Return (r, count, 3) points of footprints from their centers, and (r,) which is farthest."""
    rows = np.arange(part.start, part.stop)
    points = sampler(rows, stratified_square(at.keys[part], count, seed))
    apart = points - at.points[part, None]
    return apart, (apart**2).sum(axis=2).argmax(axis=1)


def _corners_apart(at: Footprints, sampler: Sampler, part: slice) -> Array:
    """Return (r, 4, 3) the corners of footprints from their centers."""
    rows = np.arange(part.start, part.stop)
    corners = np.broadcast_to(CORNERS, (len(rows), *CORNERS.shape))
    return np.asarray(sampler(rows, corners) - at.points[part, None])


def _at_centers(
    spread: SpreadPoints, light: Lamp | EmitterGroup, least: float, part: slice
) -> tuple[Array, Array, Array]:
    """Return (r,) the gain at centers, whether it varies over the footprint, and whether an edge does."""
    at = spread.at
    normals = at.normals[part]
    own = light.unit_irradiance(at.points[part], normals)
    varies, jump = np.zeros((2, len(own)), dtype=bool)
    if at.sampler is not None and not light.is_distant:
        if isinstance(light, EmitterGroup) and least:
            varies = (own > least) | light.is_near(at.points[part], spread.width(part))
        else:
            # A dark center says nothing of the rest.
            asked = np.flatnonzero((own == 0.0) | spread.matters(light, own, part))
            other = light.unit_irradiance(spread.farthest(part.start + asked), normals[asked])
            here = own[asked]
            varies[asked] = np.abs(other - here) > spread.same_gain * np.maximum(here, other)
            jump[asked] = np.abs(other - here) > EDGE_DIFFERENCE * np.maximum(here, other)
    return own, varies, jump


def _varying(spread: SpreadPoints, light: Lamp | EmitterGroup, dim: float, bent: Array, part: slice) -> Array:
    """Return (r,) the mean gain at rows over which it varies."""
    rows = bent[part]
    each = spread.gains(light, rows, spread.points(rows, SPREAD))
    mean, deviation = each.mean(axis=1), each.std(axis=1)
    if spread.at.near is None:
        return np.asarray(mean)
    for least, count in UNEVEN:
        uneven = np.flatnonzero((deviation > least * mean) & (mean > dim))
        mean[uneven], deviation[uneven] = spread.many(light, rows[uneven], count)
    return np.asarray(mean)
