"""Irradiance between gather points: weights of a local linear fit in world space.

A gather point may speak for a texel as far as irradiance can be expected to stay the
same: distance times the mean closeness of what the point sees, plus the turn of the
normal (the split-sphere estimate of Ward, Rubinstein and Clear 1988). Near a contact that
reach goes to zero. What neighbors of a texel see d away, it sees no farther away than that and the
way to them: so no point in the open speaks for texels next to a contact (neighbor clamping, Křivánek,
Bouatouch, Pattanaik and Žára 2006). A point must also see the texel, just above the surface: in the
open the reach is long, and a wall thin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, fill_chunks, map_chunks, run_starts, tiles
from ...rays import SAGITTA, SIGHT_LIFT, RayCaster
from ..texels import TexelGeometry
from .point_grid import NONE, PointGrid
from .weighted_pairs import WeightedPairs, run_of

REACH = 0.35
"""Largest split-sphere change at which a gather point still counts."""

SLOPE_DAMPING = 0.05
"""Pull of the fitted slopes toward zero, relative to the spread of the points."""

STEEPEST = 2.0
"""How far a slope may lower a point's weight, as a multiple of it."""

BESIDE = 0.7
"""Points that lie on one side of a texel, so many texels away in the mean, support it half as much as points
around it: a strip with but one row of points would look alike all across."""

CHUNK = 1 << 14
"""Texels whose neighbors are weighed at once; bounds the temporaries to some 80 MB a thread."""


class GatherPoints:
    """The texels chosen to gather, level by level; finer levels only where coarser ones do not reach.

    Attributes
    ----------
    texel : (g,) int32
    closeness : (g,) float64
        Mean inverse distance seen from each point [1/m].
    """

    def __init__(self, geometry: TexelGeometry, caster: RayCaster, alone: Array, threads: int = 0) -> None:
        self.threads = threads
        """0 means all cores."""
        self._geometry, self._caster, self._alone = geometry, caster, alone
        self.texel = np.zeros(0, dtype=np.int32)
        self.closeness = np.zeros(0)
        self.level = np.zeros(0, dtype=np.int8)
        """(g,) int8: as which level each was added, from 0"""
        self._grids: list[PointGrid] = []
        self._weighed = WeightedPairs.nothing()
        scratch = geometry.scratch
        self._number = scratch.empty(len(geometry), np.int32)
        self.farthest = scratch.empty(len(geometry))
        for rows in tiles(len(geometry)):
            self._number[rows], self.farthest[rows] = -1, np.inf
        """(n,) float64 [m]: what texels see is no farther off in the mean, by what points near them see."""

    def __len__(self) -> int:
        return len(self.texel)

    def add(self, stride: int, texel: Array, closeness: Array) -> None:
        """Add a level of points, about `stride` texels apart."""
        geometry = self._geometry
        numbers = len(self) + np.arange(len(texel), dtype=np.int32)
        size = max(stride, 1.5) * geometry.texel_size
        scale = geometry.scale[geometry.triangle[texel]]
        grid = PointGrid(geometry.position, geometry.normal, texel, scale, len(self), size, geometry.scratch)
        self._grids.append(grid)
        self._number = _writable(self._number, geometry.scratch)
        self._number[texel] = numbers
        level = np.full(len(texel), len(self._grids) - 1, dtype=np.int8)
        self.level = np.concatenate([self.level, level])
        self.texel = np.concatenate([self.texel, texel])
        self.closeness = np.concatenate([self.closeness, closeness])

    def pairs(self, texels: Array, level: int = 0) -> tuple[Array, Array]:
        """Return rows of `texels` and gather points around them of all levels from `level`, sorted by row.

        In the world, not on the page: the next chart or object goes on where one ends.
        """
        position, normal = self._geometry.position[texels], self._geometry.normal[texels]
        scale, grids = self._geometry.scale[self._geometry.triangle[texels]], self._grids[level:]
        near = [np.full((len(texels), 0), NONE, np.int32)]
        near += [grid.near(position, normal, scale) for grid in grids]
        found = np.concatenate(near, axis=1)
        # Its own point each texel has, should others crowd it out of its cell.
        own = self._number[texels]
        own[(found == own[:, None]).any(axis=1)] = NONE
        found = np.concatenate([own[:, None], found], axis=1)
        row, column = np.nonzero(found != NONE)
        return row, found[row, column]

    def kernel(
        self, texels: Array, point: Array, farthest: Array | None = None, seen: Array | None = None
    ) -> Array:
        """Return (p,) weights in [0, 1] of gather points for texels (p,), pair by pair; 0 out of reach.

        farthest (p,): Of the texels; None for what is known of them.
        seen (p,) bool: Whether the points see the texels; None if that is to be found out.
        """
        farthest = self.farthest.take(texels) if farthest is None else farthest
        geometry = self._geometry
        points_texel = self.texel.take(point)
        along = geometry.position.take(points_texel, axis=0) - geometry.position.take(texels, axis=0)
        distance = np.sqrt(np.einsum("pk,pk->p", along, along))
        closeness = np.maximum(self.closeness.take(point), self._own_closeness(texels, farthest))
        change = distance * closeness
        # A texel that geometry cuts in two, or hoods, speaks for itself alone, and nobody for it.
        apart = self._alone.take(points_texel) | self._alone.take(texels)
        weight = np.where(points_texel == texels, np.maximum(1.0 - change / REACH, 0.0) ** 2, 0.0)
        row = np.flatnonzero((points_texel != texels) & (change < REACH) & ~apart)
        bend = _bend(geometry, texels.take(row), points_texel.take(row))
        spoken = np.maximum(1.0 - (change[row] + bend) / REACH, 0.0) ** 2
        row, spoken = row[spoken > 0], spoken[spoken > 0]
        free = self.sees(texels.take(row), point.take(row)) if seen is None else seen[row]
        weight[row] = spoken * free
        return np.asarray(weight)

    def sees(self, texels: Array, point: Array) -> Array:
        """Return (p,) bool: whether nothing is between gather points and texels (p,), pair by pair."""
        geometry, end = self._geometry, self.texel.take(point)
        normal, end_normal = geometry.normal.take(texels, axis=0), geometry.normal.take(end, axis=0)
        along = geometry.position.take(end, axis=0) - geometry.position.take(texels, axis=0)
        distance = np.sqrt(np.einsum("pk,pk->p", along, along))
        # Over a bulge the straight line dips below the surface, by an eighth of the distance
        # times the turn of the normal: start and end that much higher.
        lift = SIGHT_LIFT * self._caster.surface_offset + SAGITTA * distance * _bend(geometry, texels, end)
        begin = geometry.position.take(texels, axis=0) + lift[:, None] * normal
        along += lift[:, None] * (end_normal - normal)
        length = np.sqrt(np.einsum("pk,pk->p", along, along))
        along /= np.maximum(length, 1e-300)[:, None]
        return self._caster.unoccluded(begin, along, length)

    def _own_closeness(self, texels: Array, farthest: Array) -> Array:
        """Return (p,) what texels that are points see themselves; elsewhere what their neighbors expect."""
        number = self._number.take(texels)
        if not len(self):
            return np.zeros(len(texels))
        return np.where(number >= 0, self.closeness.take(np.maximum(number, 0)), 1.0 / farthest)

    def clamped(self, texels: Array, row: Array, point: Array) -> Array:
        """Return (n,) how far things are from texels, by what points (p,), sorted by row, see that see them.

        What is close to others, in the gap behind a board, say, is not close to the board's front.
        """
        geometry, result = self._geometry, self.farthest[texels]
        along = geometry.position[self.texel[point]] - geometry.position[texels[row]]
        farthest = 1.0 / np.maximum(self.closeness[point], 1e-300) + np.linalg.norm(along, axis=1)
        first = np.flatnonzero(np.diff(row, prepend=-1))
        if len(first):
            rows = row[first]
            result[rows] = np.minimum(result[rows], np.minimum.reduceat(farthest, first))
        return np.asarray(result)

    def support(self, texels: Array, least: float = 1.0, progress: Progress = SILENT) -> Array:
        """Return (n,) the summed weights around texels, less of points on one side (`BESIDE`).

        From then on no point speaks for them that lies farther off than their neighbors allow.

        least: With less than this they become points themselves.
        """
        scratch = self._geometry.scratch
        total, farthest = scratch.empty(len(texels)), scratch.empty(len(texels))
        kept = scratch.rows(1, np.int32), scratch.rows(1, np.int32), scratch.rows(1, np.float32)
        self._weighed = WeightedPairs.nothing()
        supported = partial(_supported, self, texels, least)
        for rows, (*sums, count, point, weight) in map_chunks(
            supported, len(texels), CHUNK, self.threads, progress
        ):
            total[rows], farthest[rows] = sums
            pairs = np.repeat(texels[rows], count), point, weight
            for table, values in zip(kept, pairs, strict=True):
                table.extend(values)
        self.farthest = _writable(self.farthest, scratch)
        for rows in tiles(len(texels)):
            self.farthest[texels[rows]] = farthest[rows]
        in_order = all((np.diff(texels[rows]) > 0).all() for rows in tiles(len(texels)))
        if in_order and len(texels):
            known = np.concatenate([texels[rows][total[rows] >= least] for rows in tiles(len(texels))])
            self._weighed = WeightedPairs(len(self._grids), known, *(table.all()[:, 0] for table in kept))
        return total

    def weights_of(self, texels: slice) -> tuple[Array, Array, Array]:
        """Return rows, points and weights above 0 for a run of all texels, sorted by row.

        What `support` weighed last is not weighed again.
        """
        known = self._weighed
        run = np.arange(texels.start, texels.stop)
        entries = run_of(known.texels, texels)
        old = np.zeros(len(run), dtype=bool)
        old[known.texels[entries] - texels.start] = True
        # What has become a point since has learned how close things are to it.
        old &= self._number[run] < 0
        kept = known.pairs_of(texels)
        still = old[kept[0] - texels.start]
        kept = (kept[0][still], kept[1][still], kept[2][still])
        found = [self.weighed(run[~old], 0), self.weighed(run[old], known.levels), kept]
        texel, point, weight = (np.concatenate(parts) for parts in zip(*found, strict=True))
        row = texel - texels.start
        order = np.argsort(row.astype(np.int16 if len(run) < 1 << 15 else np.int64), kind="stable")
        return row[order], point[order], weight[order]

    def weighed(self, texels: Array, level: int = 0) -> tuple[Array, Array, Array]:
        """Weigh the points of all levels from `level` for texels: (p,) texels, points, weights above 0."""
        row, point = self.pairs(texels, level)
        weight = self.kernel(texels[row], point)
        reached = np.flatnonzero(weight)
        return texels[row[reached]], point[reached], weight[reached].astype(np.float32)


def _supported(
    points: GatherPoints, texels: Array, least: float, rows: slice
) -> tuple[Array, Array, Array, Array, Array]:
    """Return (r,) summed weights around texels, how far things are, and how many points speak for each.

    Then these points and their weights above 0, in order: none for texels that get less than `least`.
    """
    texels = texels[rows]
    row, point = points.pairs(texels)
    seen = points.sees(texels[row], point)
    farthest = points.clamped(texels, row[seen], point[seen])
    weight = points.kernel(texels[row], point, farthest[row], seen)
    total = np.bincount(row, weight, minlength=len(texels))
    reached = np.flatnonzero(weight)
    away = _beside(points, texels, row[reached], point[reached], weight[reached], total)
    total = total / (1.0 + (away / BESIDE) ** 2)
    reached = reached[total[row[reached]] >= least]
    count = np.bincount(row[reached], minlength=len(texels)).astype(np.uint8)
    # In single precision: they are kept for all texels.
    return total, farthest, count, point[reached], weight[reached].astype(np.float32)


def _writable(array: Array, scratch: Scratch) -> Array:
    """Return an array, or a copy of one that must not change because others read it."""
    if array.flags.writeable:
        return array
    copy = scratch.empty(array.shape, array.dtype)
    for rows in tiles(len(array)):
        copy[rows] = array[rows]
    return copy


def _bend(geometry: TexelGeometry, one: Array, other: Array) -> Array:
    """Return (p,) how much normals turn between texels (p,) each: about the angle, √(1 − cosine)."""
    normal, end_normal = geometry.normal.take(one, axis=0), geometry.normal.take(other, axis=0)
    return np.sqrt(np.maximum(1.0 - np.einsum("pk,pk->p", normal, end_normal), 0.0))


def _beside(
    points: GatherPoints, texels: Array, row: Array, point: Array, weight: Array, total: Array
) -> Array:
    """Return (r,) how many texels away the weighted mean of the points around each texel is."""
    geometry = points._geometry
    # Taken row by row: to take from a column, NumPy copies the whole column first.
    along = geometry.position.take(points.texel[point], axis=0)
    along -= geometry.position.take(texels[row], axis=0)
    sums = [np.bincount(row, along[:, axis] * weight, minlength=len(texels)) for axis in range(3)]
    away = np.linalg.norm(sums, axis=0) / np.maximum(total, 1e-12)
    return np.asarray(away / np.sqrt(geometry.texel_area[geometry.triangle[texels]]))


@dataclass(frozen=True)
class Interpolation:
    """A sparse operator from gather points to texels, in rows.

    Attributes
    ----------
    first : (n,) int64
        Where each texel's entries start; every texel has at least one.
    point : (m,) int32
    weight : (m,) float32
        The entries of a texel sum to 1.
    """

    first: Array
    point: Array
    weight: Array

    def __call__(self, values: Array, threads: int = 1, scratch: Scratch | None = None) -> Array:
        """Carry (g, k) values of the gather points to (n, k) of the texels."""
        result = (scratch or Scratch()).empty((len(self.first), values.shape[1]))
        columns = [np.ascontiguousarray(values[:, channel]) for channel in range(values.shape[1])]
        fill_chunks(partial(_spread, self, columns), result, len(self.first), CHUNK, threads)
        return result

    def any_of(self, chosen: Array) -> Array:
        """Return (n,) bool: which texels take from any of the chosen points, (g,) bool."""
        result = np.zeros(len(self.first), dtype=bool)
        for rows in tiles(len(result)):
            entries = self.entries_of(rows)
            first = self.first[rows] - entries.start
            result[rows] = np.logical_or.reduceat(chosen[self.point[entries]], first)
        return result

    def entries_of(self, rows: slice) -> slice:
        """Return where the entries of a run of texels are."""
        stop = self.first[rows.stop] if rows.stop < len(self.first) else len(self.point)
        return slice(int(self.first[rows.start]), int(stop))


def _spread(spread: Interpolation, columns: list[Array], rows: slice) -> Array:
    """Return (r, k) the values of columns at texels."""
    entries = spread.entries_of(rows)
    point, weight = spread.point[entries].astype(np.intp), spread.weight[entries]
    first = spread.first[rows] - entries.start
    return np.stack([np.add.reduceat(column.take(point) * weight, first) for column in columns], axis=1)


def fit(points: GatherPoints, geometry: TexelGeometry, progress: Progress = SILENT) -> Interpolation:
    """Weigh the gather points around every texel: a local linear fit, evaluated at the texel.

    Raises
    ------
    ValueError
        If nothing speaks for a texel: it should have become a gather point itself.
    """
    scratch = geometry.scratch
    first = scratch.empty(len(geometry), np.int64)
    point, weight = scratch.rows(1, np.int32), scratch.rows(1, np.float32)
    total = 0
    weigh = partial(_fitted, points, geometry)
    for rows, (count, numbers, weights) in map_chunks(weigh, len(geometry), CHUNK, points.threads, progress):
        first[rows] = total + run_starts(count)
        total += len(numbers)
        point.extend(numbers)
        weight.extend(weights)
    return Interpolation(first, point.all()[:, 0], weight.all()[:, 0])


def _fitted(points: GatherPoints, geometry: TexelGeometry, rows: slice) -> tuple[Array, Array, Array]:
    """Return how many entries each texel has, and their points and weights in order."""
    row, point, kernel = points.weights_of(rows)
    count = np.bincount(row, minlength=rows.stop - rows.start)
    if not count.all():
        raise ValueError("a texel has no gather point in reach: the last level must take all that lack one")
    along = geometry.position[points.texel[point]] - geometry.position[row + rows.start]
    return count, point.astype(np.int32), linear_weights(along, kernel, count)


def linear_weights(along: Array, kernel: Array, count: Array) -> Array:
    """Return (p,) float32 weights that reproduce linear functions of the position as far as damping allows.

    Parameters
    ----------
    along : (p, 3) float64
        From the texel to the point of each pair.
    kernel : (p,) float64
    count : (n,) int
        How many pairs, one after the other, each texel has.
    """
    first = run_starts(count)
    share = kernel / np.repeat(np.add.reduceat(kernel, first), count)
    mean = np.add.reduceat(share[:, None] * along, first, axis=0)
    offset = along - np.repeat(mean, count, axis=0)
    # Least-norm slope in three dimensions: damping makes the flat direction harmless.
    moment = np.empty((len(count), 3, 3))
    for one in range(3):
        for other in range(one, 3):
            product = np.add.reduceat(share * offset[:, one] * offset[:, other], first)
            moment[:, one, other] = moment[:, other, one] = product
    damping = SLOPE_DAMPING * np.trace(moment, axis1=1, axis2=2) + 1e-18
    moment += damping[:, None, None] * np.eye(3)
    slope = np.linalg.solve(moment, -mean[:, :, None])[:, :, 0]
    tilt = np.einsum("pk,pk->p", offset, np.repeat(slope, count, axis=0))
    # A tight bunch of points far away knows nothing of a slope: no point counts against itself by
    # more than it counts, which bounds the sum of all weights' sizes by 3.
    steepest = STEEPEST / np.maximum(-np.minimum.reduceat(tilt, first), STEEPEST)
    weights = share * (1.0 + np.repeat(steepest, count) * tilt)
    weights /= np.repeat(np.add.reduceat(weights, first), count)
    return np.asarray(weights, dtype=np.float32)
