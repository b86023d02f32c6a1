"""Irradiance between gather points: weights of a local linear fit in world space.

A gather point may speak for a texel as far as irradiance can be expected to stay the
same: distance times the mean closeness of what the point sees, plus the turn of the
normal (the split-sphere estimate of Ward, Rubinstein and Clear 1988). Near a contact that
reach goes to zero. It must also see the texel, just above the surface: in the open the
reach is long, and a wall thin.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ..solver.arrays import Array
from ..solver.parallel import chunk_steps
from ..solver.steps import drain
from ..solver.visibility import RayCaster
from .point_grid import PointGrid
from .texel_geometry import TexelGeometry

REACH = 0.35
"""Largest split-sphere change at which a gather point still counts."""

SLOPE_DAMPING = 0.05
"""Pull of the fitted slopes towards zero, relative to the spread of the points."""

STEEPEST = 2.0
"""How far a slope may lower a point's weight, as a multiple of it."""

LIFT = 2.0
"""Lines of sight run this many surface offsets above the surface, …"""

SAGITTA = 0.6
"""… and this part of distance · √(1 − cos of the turn) more: what a sphere of few facets needs."""

CHUNK = 1 << 13
"""Texels whose neighbours are weighed at once; bounds the temporaries to some 40 MB a thread."""


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
        self._grids: list[PointGrid] = []
        self._number = np.full(len(geometry), -1, dtype=np.int32)

    def __len__(self) -> int:
        return len(self.texel)

    def add(self, stride: int, texel: Array, closeness: Array) -> None:
        """Add a level of points, about `stride` texels apart."""
        geometry = self._geometry
        numbers = len(self) + np.arange(len(texel), dtype=np.int32)
        size = max(stride, 1.5) * geometry.texel_size
        self._grids.append(PointGrid(geometry.position[texel], geometry.normal[texel], numbers, size))
        self._number[texel] = numbers
        self.texel = np.concatenate([self.texel, texel])
        self.closeness = np.concatenate([self.closeness, closeness])

    def pairs(self, texels: Array) -> tuple[Array, Array]:
        """Return rows of `texels` and gather points of all levels around them, sorted by row, then point.

        In the world, not on the page: the next chart or object goes on where one ends.
        """
        position, normal = self._geometry.position[texels], self._geometry.normal[texels]
        own = self._number[texels]
        keys = [np.flatnonzero(own >= 0) * len(self) + own[own >= 0]]
        for grid in self._grids:
            found = grid.near(position, normal)
            row, column = np.nonzero(found >= 0)
            keys.append(row * len(self) + found[row, column])
        return np.divmod(np.unique(np.concatenate(keys)), max(len(self), 1))

    def kernel(self, texels: Array, point: Array) -> Array:
        """Return (p,) weights in [0, 1] of gather points for texels (p,), pair by pair; 0 out of reach."""
        geometry = self._geometry
        of = self.texel[point]
        along = geometry.position[of] - geometry.position[texels]
        turn = np.einsum("pk,pk->p", geometry.normal[of], geometry.normal[texels])
        distance = np.sqrt(np.einsum("pk,pk->p", along, along))
        bend = np.sqrt(np.maximum(1.0 - turn, 0.0))
        weight = np.maximum(1.0 - (distance * self.closeness[point] + bend) / REACH, 0.0) ** 2
        # A texel that geometry cuts in two, or hoods, speaks for itself alone, and nobody for it.
        other = of != texels
        weight[other & (self._alone[of] | self._alone[texels])] = 0.0
        row = np.flatnonzero((weight > 0) & other)
        # Over a bulge the straight line dips below the surface, by an eighth of the distance
        # times the turn of the normal: start and end that much higher.
        lift = LIFT * self._caster.surface_offset + SAGITTA * (distance * bend)[row]
        start = geometry.position[texels[row]] + lift[:, None] * geometry.normal[texels[row]]
        end = geometry.position[of[row]] + lift[:, None] * geometry.normal[of[row]]
        length = np.linalg.norm(end - start, axis=1)
        directions = (end - start) / np.maximum(length, 1e-300)[:, None]
        weight[row] *= self._caster.visible(start, directions, length)
        return np.asarray(weight)

    def support(self, texels: Array) -> Array:
        """Return (n,) the summed weights around texels: below 1 they need a point of their own."""
        return drain(self.support_steps(texels))

    def support_steps(self, texels: Array) -> Generator[float, None, Array]:
        """Compute the same; yields the fraction done."""
        total = np.empty(len(texels))

        def weigh(rows: slice) -> None:
            row, point = self.pairs(texels[rows])
            weight = self.kernel(texels[rows][row], point)
            total[rows] = np.bincount(row, weight, minlength=len(texels[rows]))

        yield from chunk_steps(weigh, len(texels), CHUNK, self.threads)
        return total


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

    def __call__(self, values: Array) -> Array:
        """Carry (g, k) values of the gather points to (n, k) of the texels."""
        result = np.empty((len(self.first), values.shape[1]))
        for channel in range(values.shape[1]):
            result[:, channel] = np.add.reduceat(values[self.point, channel] * self.weight, self.first)
        return result

    def any_of(self, chosen: Array) -> Array:
        """Return (n,) bool: which texels take from any of the chosen points, (g,) bool."""
        return np.asarray(np.logical_or.reduceat(chosen[self.point], self.first))


def fit(points: GatherPoints, geometry: TexelGeometry) -> Interpolation:
    """Weigh the gather points around every texel (see `fit_steps`)."""
    return drain(fit_steps(points, geometry))


def fit_steps(points: GatherPoints, geometry: TexelGeometry) -> Generator[float, None, Interpolation]:
    """Weigh the gather points around every texel: a local linear fit, evaluated at the texel.

    Yields
    ------
    fraction : float

    Raises
    ------
    ValueError
        If nothing speaks for a texel: it should have become a gather point itself.
    """
    parts: dict[int, tuple[Array, Array, Array]] = {}

    def weigh(rows: slice) -> None:
        row, point = points.pairs(np.arange(rows.start, rows.stop, dtype=np.int64))
        kernel = points.kernel(row + rows.start, point)
        reached = kernel > 0
        row, point, kernel = row[reached], point[reached], kernel[reached]
        count = np.bincount(row, minlength=rows.stop - rows.start)
        if not count.all():
            raise ValueError(
                "a texel has no gather point in reach: the last level must take all that lack one"
            )
        along = geometry.position[points.texel[point]] - geometry.position[row + rows.start]
        parts[rows.start] = count, point.astype(np.int32), _linear_weights(along, kernel, count)

    yield from chunk_steps(weigh, len(geometry), CHUNK, points.threads)
    counts, numbers, weights = zip(*(parts[start] for start in sorted(parts)), strict=True)
    count = np.concatenate(counts)
    return Interpolation(np.cumsum(count) - count, np.concatenate(numbers), np.concatenate(weights))


def _linear_weights(along: Array, kernel: Array, count: Array) -> Array:
    """Return (p,) float32 weights that reproduce linear functions of the position as far as damping allows.

    Parameters
    ----------
    along : (p, 3) float64
        From the texel to the point of each pair.
    kernel : (p,) float64
    count : (n,) int
        How many pairs, one after the other, each texel has.
    """
    first = np.cumsum(count) - count
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
