"""Irradiance between gather points: weights of a local linear fit in world space.

A gather point may speak for a texel as far as irradiance can be expected to stay the
same: distance times the mean closeness of what the point sees, plus the turn of the
normal (the split-sphere estimate of Ward, Rubinstein and Clear 1988). Near a contact that
reach goes to zero. It must also see the texel, just above the surface: in the open the
reach is long, and a wall thin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..solver.arrays import Array
from ..solver.parallel import for_chunks
from ..solver.visibility import RayCaster
from .point_grid import PointGrid
from .texel_geometry import TexelGeometry

REACH = 0.35
"""Largest split-sphere change at which a gather point still counts."""

SLOPE_DAMPING = 0.05
"""Pull of the fitted slopes towards zero, relative to the spread of the points."""

LIFT = 2.0
"""Lines of sight run this many surface offsets above the surface, …"""

SAGITTA = 0.6
"""… and this part of distance · √(1 − cos of the turn) more: what a sphere of few facets needs."""

CHUNK = 1 << 14
"""Texels whose candidates are weighed at once; bounds the temporaries to some 120 MB."""


class GatherPoints:
    """The texels chosen to gather, level by level; finer levels only where coarser ones do not reach.

    Attributes
    ----------
    texel : (g,) int32
    closeness : (g,) float64
        Mean inverse distance seen from each point [1/m].
    """

    def __init__(self, geometry: TexelGeometry, caster: RayCaster, crossed: Array, threads: int = 0) -> None:
        self.threads = threads
        """0 means all cores."""
        self._geometry, self._caster, self._crossed = geometry, caster, crossed
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

    def candidates(self, texels: Array) -> Array:
        """Return (n, c) int32: gather points of all levels around n texels, −1 for none.

        In the world, not on the page: the next chart or object goes on where one ends.
        """
        position, normal = self._geometry.position[texels], self._geometry.normal[texels]
        found = np.concatenate([grid.near(position, normal) for grid in self._grids], axis=1)
        own = self._number[texels][:, None]
        found = np.sort(np.concatenate([found, own], axis=1), axis=1)
        found[:, 1:][found[:, 1:] == found[:, :-1]] = -1
        return found

    def kernel(self, texels: Array, points: Array) -> Array:
        """Return (n, c) weights in [0, 1] of candidate points for texels; 0 out of reach."""
        geometry = self._geometry
        of = self.texel[points]
        along = geometry.position[of] - geometry.position[texels][:, None]
        turn = np.einsum("nck,nk->nc", geometry.normal[of], geometry.normal[texels])
        distance = np.linalg.norm(along, axis=2)
        bend = np.sqrt(np.maximum(1.0 - turn, 0.0))
        change = distance * self.closeness[points] + bend
        weight = np.where(points >= 0, np.maximum(1.0 - change / REACH, 0.0) ** 2, 0.0)
        # A texel that geometry cuts in two speaks for itself alone, and nobody for it.
        other = of != texels[:, None]
        weight[other & (self._crossed[of] | self._crossed[texels][:, None])] = 0.0
        row, column = np.nonzero((weight > 0) & other)
        # Over a bulge the straight line dips below the surface, by an eighth of the distance
        # times the turn of the normal: start and end that much higher.
        lift = LIFT * self._caster.surface_offset + SAGITTA * (distance * bend)[row, column]
        start = geometry.position[texels][row] + lift[:, None] * geometry.normal[texels][row]
        end = geometry.position[of[row, column]] + lift[:, None] * geometry.normal[of[row, column]]
        length = np.linalg.norm(end - start, axis=1)
        directions = (end - start) / np.maximum(length, 1e-300)[:, None]
        weight[row, column] *= self._caster.visible(start, directions, length)
        return weight

    def support(self, texels: Array) -> Array:
        """Return (n,) the summed weights around texels: below 1 they need a point of their own."""
        total = np.empty(len(texels))

        def weigh(rows: slice) -> None:
            total[rows] = self.kernel(texels[rows], self.candidates(texels[rows])).sum(axis=1)

        for_chunks(weigh, len(texels), CHUNK, self.threads)
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


def fit(points: GatherPoints, geometry: TexelGeometry) -> Interpolation:
    """Weigh the gather points around every texel: a local linear fit, evaluated at the texel.

    Raises
    ------
    ValueError
        If nothing speaks for a texel: it should have become a gather point itself.
    """
    parts: dict[int, tuple[Array, Array, Array]] = {}

    def weigh(rows: slice) -> None:
        texels = np.arange(rows.start, rows.stop, dtype=np.int64)
        candidates = points.candidates(texels)
        kernel = points.kernel(texels, candidates)
        if not (kernel.sum(axis=1) > 0).all():
            raise ValueError(
                "a texel has no gather point in reach: the last level must take all that lack one"
            )
        linear = _linear_weights(points, geometry, texels, candidates, kernel)
        used = linear != 0
        parts[rows.start] = used.sum(axis=1), candidates[used], linear[used].astype(np.float32)

    for_chunks(weigh, len(geometry), CHUNK, points.threads)
    counts, numbers, weights = zip(*(parts[start] for start in sorted(parts)), strict=True)
    count = np.concatenate(counts)
    return Interpolation(np.cumsum(count) - count, np.concatenate(numbers), np.concatenate(weights))


def _linear_weights(
    points: GatherPoints,
    geometry: TexelGeometry,
    texels: Array,
    candidates: Array,
    kernel: Array,
) -> Array:
    """Return (n, c) weights that reproduce linear functions of the position as far as damping allows."""
    along = geometry.position[points.texel[candidates]] - geometry.position[texels][:, None]
    total = kernel.sum(axis=1, keepdims=True)
    share = kernel / total
    mean = np.einsum("nc,nck->nk", share, along)
    offset = along - mean[:, None]
    # Least-norm slope in three dimensions: damping makes the flat direction harmless.
    moment = np.einsum("nc,nck,ncl->nkl", share, offset, offset)
    damping = SLOPE_DAMPING * np.trace(moment, axis1=1, axis2=2) + 1e-18
    moment += damping[:, None, None] * np.eye(3)
    slope = np.linalg.solve(moment, -mean[:, :, None])[:, :, 0]
    weights = share * (1.0 + np.einsum("nck,nk->nc", offset, slope))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
