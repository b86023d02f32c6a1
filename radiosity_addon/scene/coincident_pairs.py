"""Pairs of coincident triangles: coplanar within a tolerance, with a common area."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..numerics import Array, areas, clip_half_plane, run_chunks, run_numbers

TOLERANCE = 1e-6
"""Faces that are no farther apart than this [m], …"""

SPACINGS = 8.0
"""… or than this many float32 spacings of their coordinates, coincide."""

SLACK = 1.25
"""Factor on the tolerance: a distance of a micrometer may be slightly more in float32."""

PARALLEL = 0.9998
"""Cosine between the normals of coplanar triangles, at least: small ones have rounded normals."""

LEVELS = 20
"""The grids' cells are the scene's extent at most, and this extent over 2^20 at least."""

CHUNK_PAIRS = 1 << 19
"""Pairs tested at once; their temporaries take about 150 MB."""

CORNERS = 8
"""A triangle clipped by a triangle and by two heights has no more corners."""


@dataclass(frozen=True)
class CoincidentPairs:
    """p pairs of coincident triangles.

    first, second (p,) int: Rows of triangles.
    same (p,) bool: Whether both face the same way.
    in_first, in_second (p, 8, 2): What they have in common, a convex polygon, as weights of each triangle's
        second and third corner; counter-clockwise.
    height (p,): How far the second lies above the first, along the first's normal, in the middle [m].
    """

    first: Array
    second: Array
    same: Array
    in_first: Array
    in_second: Array
    height: Array

    def __len__(self) -> int:
        return len(self.first)

    def take(self, rows: Array) -> CoincidentPairs:
        """Return selected pairs."""
        return CoincidentPairs(*(getattr(self, name)[rows] for name in _FIELDS))


_FIELDS = ("first", "second", "same", "in_first", "in_second", "height")


def tolerances(triangles: Array) -> Array:
    """Return (t,) how far from (t, 3, 3) triangles others are in the same place [m]."""
    largest = np.abs(triangles).max(axis=(1, 2), initial=0.0)
    spacing = np.spacing(largest.astype(np.float32)).astype(np.float64)
    return np.asarray(SLACK * np.maximum(TOLERANCE, SPACINGS * spacing))


def coincident_pairs(triangles: Array, rows: Array, tolerance: Array, reach: Array) -> CoincidentPairs:
    """Find the pairs among triangles.

    triangles (t, 3, 3).
    rows (n,) int: Those that take part; they have an area.
    tolerance (t,): See `tolerances`. A common area that is not wider than this does not count: neighbors
        overlap by rounding.
    reach (t,): A pair is no farther apart than the larger of its two values [m].
    """
    planes = _Planes(triangles, rows, tolerance, reach)
    found = [planes.overlapping(*pair) for pair in _near_pairs(planes.low, planes.high)]
    if not found:
        none = np.zeros(0, dtype=np.int64)
        nowhere = np.zeros((0, CORNERS, 2))
        return CoincidentPairs(none, none, none > 0, nowhere, nowhere, np.zeros(0))
    fields = (np.concatenate([getattr(part, name) for part in found]) for name in _FIELDS)
    return CoincidentPairs(*fields)


class _Planes:
    """Triangles with the data that tests of pairs need."""

    def __init__(self, triangles: Array, rows: Array, tolerance: Array, reach: Array) -> None:
        self._rows = rows
        corners = triangles[rows]
        self._tolerance, self._reach = tolerance[rows], np.maximum(reach[rows], tolerance[rows])
        self.low = corners.min(axis=1) - self._reach[:, None]
        self.high = corners.max(axis=1) + self._reach[:, None]
        self._corners = corners
        one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        cross = np.cross(one, other)
        length = np.linalg.norm(cross, axis=1)
        self._area = 0.5 * length
        self._normal = cross / length[:, None]
        # Weights of the second and third corner grow along these.
        self._second = np.cross(other, self._normal) / length[:, None]
        self._third = np.cross(self._normal, one) / length[:, None]
        self._edges = np.stack([one, other], axis=1)

    def overlapping(self, first: Array, second: Array) -> CoincidentPairs:
        """Return which of the pairs (n,), numbers of these triangles, coincide."""
        parallel = np.einsum("pk,pk->p", self._normal[first], self._normal[second])
        keep = np.abs(parallel) > PARALLEL
        first, second, parallel = first[keep], second[keep], parallel[keep]
        reach = np.maximum(self._reach[first], self._reach[second])
        apart = self._corners[second] - self._corners[first][:, :1]
        height = np.einsum("pck,pk->pc", apart, self._normal[first])
        keep = (_least(height) <= reach) & (-_least(-height) >= -reach)
        u = np.einsum("pck,pk->pc", apart, self._second[first])
        v = np.einsum("pck,pk->pc", apart, self._third[first])
        for weight in (u, v, 1.0 - u - v):
            keep &= -_least(-weight) > 1e-9
        first, second, same, reach = first[keep], second[keep], parallel[keep] > 0, reach[keep]
        polygon = np.empty((len(first), 3, 5))
        polygon[..., 0], polygon[..., 1], polygon[..., 2] = u[keep], v[keep], height[keep]
        polygon[..., 3:] = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
        polygon = clip_half_plane(polygon, polygon[..., 0])
        polygon = clip_half_plane(polygon, polygon[..., 1])
        polygon = clip_half_plane(polygon, 1.0 - polygon[..., 0] - polygon[..., 1])
        polygon = clip_half_plane(polygon, reach[:, None] - polygon[..., 2])
        polygon = clip_half_plane(polygon, reach[:, None] + polygon[..., 2])
        in_first = np.where(same[:, None, None], polygon[..., :2], polygon[:, ::-1, :2])
        area = 2.0 * self._area[first] * areas(in_first)
        sides = (in_first - np.roll(in_first, 1, axis=1)) @ self._edges[first]
        around = np.linalg.norm(sides, axis=2).sum(axis=1)
        width = np.maximum(self._tolerance[first], self._tolerance[second])
        keep = np.flatnonzero(area > width * around)
        first, second = self._rows[first[keep]], self._rows[second[keep]]
        return CoincidentPairs(
            first, second, same[keep], in_first[keep], polygon[keep, :, 3:], polygon[keep, :, 2].mean(axis=1)
        )


def _least(values: Array) -> Array:
    """Return (p,) the least of (p, 3) values; faster than a reduction over a short axis."""
    return np.asarray(np.minimum(np.minimum(values[:, 0], values[:, 1]), values[:, 2]))


def _near_pairs(low: Array, high: Array) -> Iterator[tuple[Array, Array]]:
    """Yield the pairs of boxes (n, 3) that overlap, each once, in parts.

    Every box lies in cells of a grid of about its own size; smaller ones look into the cells that they
    overlap.
    """
    if len(low) < 2:
        return
    origin = low.min(axis=0)
    extent = max(float((high.max(axis=0) - origin).max()), 1e-300)
    size = np.maximum((high - low).max(axis=1), extent * 2.0**-LEVELS)
    level = np.clip(np.floor(np.log2(extent / size)).astype(np.int64), 0, LEVELS)
    lows, highs = np.ascontiguousarray(low.T), np.ascontiguousarray(high.T)
    thin = (high - low).argmin(axis=1)
    for at in np.unique(level):
        cell = extent * 2.0 ** -float(at)
        asking = np.flatnonzero(level >= at)
        lower = np.floor((low[asking] - origin) / cell).astype(np.int64)
        upper = np.floor((high[asking] - origin) / cell).astype(np.int64)
        row, place = _cells(lower, upper)
        key = (place[0] << 42) | (place[1] << 21) | place[2]
        begins = np.ascontiguousarray(lower.T)
        large = np.flatnonzero(level[asking[row]] == at)
        large = large[np.argsort(key[large], kind="stable")]
        # Most boxes of a cell are not near the flat one of a large triangle: its thinnest axis tells first.
        for axis in range(3):
            hosts = large[thin[asking[row[large]]] == axis]
            for small, host in _sharing(key, hosts, asking[row], lows[axis], highs[axis]):
                one, other = asking[row[small]], asking[row[host]]
                keep = (level[one] > at) | (one < other)
                for side in range(3):
                    bottom, top = lows[side], highs[side]
                    keep &= (bottom[one] <= top[other]) & (bottom[other] <= top[one])
                    # Both may lie in several cells: the first one they share counts.
                    shared = np.maximum(begins[side][row[small]], begins[side][row[host]])
                    keep &= shared == place[side][small]
                if keep.any():
                    yield one[keep], other[keep]


def _sharing(key: Array, hosts: Array, box: Array, low: Array, high: Array) -> Iterator[tuple[Array, Array]]:
    """Yield pairs of entries that are in one cell and overlap along an axis, in parts.

    key, box (c,): The cell and the box of each entry.
    hosts: The second entries of pairs, sorted by their cells.
    low, high (n,): The boxes' bounds along the axis.
    """
    begin = np.searchsorted(key[hosts], key, side="left")
    count = np.searchsorted(key[hosts], key, side="right") - begin
    candidates = np.flatnonzero(count)
    bottom, top = low[box], high[box]
    host_bottom, host_top = bottom[hosts], top[hosts]
    for chunk in run_chunks(count[candidates], CHUNK_PAIRS):
        rows = candidates[chunk]
        repeats = count[rows]
        number = run_numbers(repeats, begin[rows])
        near = np.repeat(bottom[rows], repeats) <= host_top[number]
        near &= np.repeat(top[rows], repeats) >= host_bottom[number]
        found = np.flatnonzero(near)
        if len(found):
            yield np.repeat(rows, repeats)[found], hosts[number[found]]


def _cells(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return every cell between integer bounds (n, 3): which row it belongs to, (c,), and where, (3, c)."""
    size = (upper - lower + 1).T
    count = size[0] * size[1] * size[2]
    row = np.repeat(np.arange(len(lower)), count)
    number = run_numbers(count)
    place = np.empty((3, len(row)), dtype=np.int64)
    for axis in (2, 1, 0):
        number, place[axis] = np.divmod(number, size[axis][row])
        place[axis] += lower[row, axis]
    return row, place
