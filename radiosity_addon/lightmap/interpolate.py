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
from ..solver.visibility import RayCaster
from .texel_geometry import NO_TEXEL, TexelGeometry

REACH = 0.35
"""Largest split-sphere change at which a gather point still counts."""

SLOPE_DAMPING = 0.05
"""Pull of the fitted slopes towards zero, relative to the spread of the points."""

LIFT = 2.0
"""Lines of sight run this many surface offsets above the surface, …"""

SAGITTA = 0.6
"""… and this part of distance · √(1 − cos of the turn) more: what a sphere of few facets needs."""

CHUNK = 1 << 15
"""Texels whose candidates are weighed at once; bounds the temporaries to some 120 MB."""


class GatherPoints:
    """The texels chosen to gather, level by level; finer levels only where coarser ones do not reach.

    Attributes
    ----------
    texel : (g,) int32
    closeness : (g,) float64
        Mean inverse distance seen from each point [1/m].
    """

    def __init__(self, geometry: TexelGeometry, caster: RayCaster) -> None:
        self._geometry, self._caster = geometry, caster
        self.texel = np.zeros(0, dtype=np.int32)
        self.closeness = np.zeros(0)
        self._levels: list[tuple[int, list[Array]]] = []

    def __len__(self) -> int:
        return len(self.texel)

    def add(self, stride: int, texel: Array, closeness: Array) -> None:
        """Add a level of points that lie on the lattice of every `stride`-th texel."""
        numbers = np.full(len(self._geometry), -1, dtype=np.int32)
        numbers[texel] = len(self) + np.arange(len(texel), dtype=np.int32)
        images = []
        for index in self._geometry.index:
            image = np.full(index.shape, -1, dtype=np.int32)
            inside = index != NO_TEXEL
            image[inside] = numbers[index[inside]]
            images.append(image)
        self._levels.append((stride, images))
        self.texel = np.concatenate([self.texel, texel])
        self.closeness = np.concatenate([self.closeness, closeness])

    def candidates(self, texels: Array) -> Array:
        """Return (n, c) int32: gather points on the lattices around n texels, −1 for none."""
        geometry = self._geometry
        found = []
        for stride, images in self._levels:
            reach = np.arange(-1, 3) if stride > 1 else np.arange(-1, 2)
            row = (geometry.row[texels] // stride)[:, None] + reach
            col = (geometry.column[texels] // stride)[:, None] + reach
            points = np.full((len(texels), len(reach), len(reach)), -1, dtype=np.int32)
            for page, image in enumerate(images):
                mine = np.flatnonzero(geometry.page[texels] == page)
                r, c = row[mine] * stride, col[mine] * stride
                inside = ((r >= 0) & (r < len(image)))[:, :, None] & ((c >= 0) & (c < len(image)))[:, None, :]
                r, c = np.clip(r, 0, len(image) - 1), np.clip(c, 0, len(image) - 1)
                points[mine] = np.where(inside, image[r[:, :, None], c[:, None, :]], -1)
            found.append(points.reshape(len(texels), -1))
        return np.concatenate(found, axis=1)

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
        row, column = np.nonzero((weight > 0) & (distance > 0))
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
        for first in range(0, len(texels), CHUNK):
            rows = texels[first : first + CHUNK]
            total[first : first + CHUNK] = self.kernel(rows, self.candidates(rows)).sum(axis=1)
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
    """Weigh the gather points around every texel: a local linear fit, evaluated at the texel."""
    counts, numbers, weights = [], [], []
    for begin in range(0, len(geometry), CHUNK):
        texels = np.arange(begin, min(begin + CHUNK, len(geometry)), dtype=np.int64)
        candidates = points.candidates(texels)
        kernel = points.kernel(texels, candidates)
        # Where nothing reaches, the nearest candidate has to do.
        lost = np.flatnonzero(kernel.sum(axis=1) == 0)
        kernel[lost] = _nearest(points, geometry, texels[lost], candidates[lost])
        linear = _linear_weights(points, geometry, texels, candidates, kernel)
        used = linear != 0
        counts.append(used.sum(axis=1))
        numbers.append(candidates[used])
        weights.append(linear[used].astype(np.float32))
    count = np.concatenate(counts)
    return Interpolation(
        np.cumsum(count) - count, np.concatenate(numbers).astype(np.int32), np.concatenate(weights)
    )


def _nearest(points: GatherPoints, geometry: TexelGeometry, texels: Array, candidates: Array) -> Array:
    """Return (n, c) 0/1 weights that pick the nearest candidate (point 0 if there is none)."""
    along = geometry.position[points.texel[candidates]] - geometry.position[texels][:, None]
    distance = np.where(candidates >= 0, np.linalg.norm(along, axis=2), np.inf)
    weight = np.zeros(candidates.shape)
    weight[np.arange(len(texels)), distance.argmin(axis=1)] = 1.0
    return weight


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
