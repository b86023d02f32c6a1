"""Joining flat charts across an edge: the grower leaves the halves of large quads apart.

A quad of two triangles takes half of the box that each of them takes, and has no seam.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...numerics import double_area_vectors, numbered
from .flatten import project
from .overlap import overlapping_triangles

Float = NDArray[np.float64]
Int = NDArray[np.int64]

_COPLANAR = 1e-5
"""Charts are flat, and in one plane, if their normals lie this close (chord length)."""

_ROUNDS = 2
"""Of pairs that are joined."""


def join_coplanar(uv: Float, triangles: Float, chart: Int, owner: Int) -> tuple[Float, Int]:
    """Join pairs of flat charts that share an edge if one box for both is smaller than their two.

    uv (n, 3, 2), triangles (n, 3, 3): 1 unit is 1 m.
    chart (n,) int64: −1 for triangles without area.
    owner (n,) int64: The object of each triangle.
    Returns uv and chart, numbered without gaps.
    """
    for _ in range(_ROUNDS):
        pairs = _neighbors(triangles, chart, owner)
        if not len(pairs):
            break
        into = np.arange(int(chart.max()) + 1)
        into[pairs[:, 1]] = pairs[:, 0]
        joined = np.where(chart >= 0, into[chart], -1)
        rows = np.flatnonzero(np.isin(joined, pairs[:, 0]))
        number = numbered(joined[rows])
        cross = double_area_vectors(triangles[rows])
        count = len(pairs)
        normal = np.stack([np.bincount(number, cross[:, k], count) for k in range(3)], axis=-1)
        flat = project(triangles[rows], np.asarray(normal, dtype=np.float64)[number])
        before = _boxes(uv[rows], numbered(chart[rows]))
        pair_of = np.zeros(len(before), dtype=np.int64)
        pair_of[numbered(chart[rows])] = number
        worth = _boxes(flat, number) < 0.99 * np.bincount(pair_of, before, count)
        worth[number[overlapping_triangles(flat, number)]] = False
        if not worth.any():
            break
        kept = worth[number]
        uv = uv.copy()
        uv[rows[kept]] = flat[kept]
        chart = chart.copy()
        chart[rows[kept]] = joined[rows[kept]]
        used = chart >= 0
        chart[used] = numbered(chart[used])
    return uv, chart


def _neighbors(triangles: Float, chart: Int, owner: Int) -> Int:
    """Return (p, 2) pairs of flat charts in one plane, each the other's neighbor along the longest edge."""
    rows = np.flatnonzero(chart >= 0)
    count = int(chart.max(initial=-1)) + 1
    cross = double_area_vectors(triangles)
    unit = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-300)
    mean = np.stack([np.bincount(chart[rows], cross[rows, k], count) for k in range(3)], axis=-1)
    mean = np.asarray(mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300))
    flat = np.ones(count, dtype=np.bool_)
    flat[chart[rows[np.linalg.norm(unit[rows] - mean[chart[rows]], axis=1) > _COPLANAR]]] = False
    rows = rows[flat[chart[rows]]]
    place = np.column_stack((np.repeat(owner[rows], 3), triangles[rows].reshape(-1, 3)))
    vertex = numbered(place).reshape(-1, 3)
    start, end = vertex.ravel(), np.roll(vertex, -1, axis=1).ravel()
    side_of = np.repeat(chart[rows], 3)
    length = np.linalg.norm(np.roll(triangles[rows], -1, axis=1) - triangles[rows], axis=2).ravel()
    edge = numbered(np.column_stack((np.minimum(start, end), np.maximum(start, end))))
    order = np.lexsort((start > end, edge))
    twice = np.flatnonzero(np.bincount(edge) == 2)
    first = order[np.searchsorted(edge[order], twice)]
    second = order[np.searchsorted(edge[order], twice) + 1]
    one, other = side_of[first], side_of[second]
    # Along an edge of one surface the two sides run in opposite directions.
    good = (one != other) & ((start > end)[first] != (start > end)[second])
    good &= np.linalg.norm(mean[one] - mean[other], axis=1) <= _COPLANAR
    one, other, length = one[good], other[good], length[first[good]]
    both, to = np.concatenate((one, other)), np.concatenate((other, one))
    order = np.lexsort((to, -np.concatenate((length, length)), both))
    chosen = np.full(count, -1, dtype=np.int64)
    best = np.unique(both[order], return_index=True)
    chosen[best[0]] = to[order][best[1]]
    low = np.flatnonzero((chosen >= 0) & (chosen[chosen] == np.arange(count)) & (np.arange(count) < chosen))
    return np.stack((low, chosen[low]), axis=-1)


def _boxes(uv: Float, chart: Int) -> Float:
    """Return (count,) the areas of charts' boxes along their longest edges."""
    count = int(chart.max()) + 1
    edge = np.roll(uv, -1, axis=1) - uv
    length = (edge**2).sum(axis=2).ravel()
    owner = np.repeat(chart, 3)
    order = np.lexsort((-length, owner))
    # The diagonal of a rectangle is no side of its box: try the three longest edges.
    starts = np.searchsorted(owner[order], np.arange(count))
    least = np.full(count, np.inf)
    for rank in range(3):
        direction = edge.reshape(-1, 2)[order[starts + rank]]
        cos, sin = (direction / np.maximum(np.hypot(*direction.T), 1e-300)[:, None]).T[:, chart, None]
        low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
        turned = np.stack((uv[..., 0] * cos + uv[..., 1] * sin, uv[..., 1] * cos - uv[..., 0] * sin), axis=-1)
        np.minimum.at(low, chart, turned.min(axis=1))
        np.maximum.at(high, chart, turned.max(axis=1))
        least = np.minimum(least, (high - low).prod(axis=1))
    return least
