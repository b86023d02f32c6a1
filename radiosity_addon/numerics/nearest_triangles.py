"""The triangle of a set that is nearest to a point.

A tree of boxes over triangles in Morton order, descended level by level for all points at once. Closest
points on triangles after Ericson, "Real-Time Collision Detection" (2005), section 5.1.5.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array

LEAF = 8
"""Triangles a leaf."""

CHUNK = 2048
"""Points a pass: what they are compared with takes some ten megabytes."""

MORTON_BITS = 10

_EDGES = ((0, 1), (1, 2), (2, 0))


class TriangleTree:
    """Triangles (t, 3, 3) by place; there must be at least one."""

    def __init__(self, triangles: Array) -> None:
        triangles = np.asarray(triangles, dtype=np.float64)
        middle = triangles.mean(axis=1)
        order = np.argsort(_morton(middle), kind="stable")
        leaves = 1 << max(int(np.ceil(np.log2(max(len(order), 1) / LEAF))), 0)
        # The last triangle fills up what is missing.
        self._rows = order[np.minimum(np.arange(leaves * LEAF), len(order) - 1)]
        self._triangles = triangles
        low = triangles[self._rows].min(axis=1).reshape(leaves, LEAF, 3).min(axis=1)
        high = triangles[self._rows].max(axis=1).reshape(leaves, LEAF, 3).max(axis=1)
        self._levels = [(low, high)]
        while len(low) > 1:
            low = np.minimum(low[0::2], low[1::2])
            high = np.maximum(high[0::2], high[1::2])
            self._levels.insert(0, (low, high))
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        self._normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)

    def nearest(
        self, points: Array, normals: Array | None = None, turned: float = 0.0
    ) -> tuple[Array, Array, Array]:
        """Return what is nearest to each of (p, 3) points.

        normals (p, 3): Unit normals there; a triangle that faces away seems farther.
        turned: By how much, if it is at right angles: √(distance² + turned²).
        Returns triangle (p,) int64.
        Returns weights (p, 3): Of its corners, at the closest point.
        Returns distance (p,): To that point.
        """
        triangle = np.zeros(len(points), dtype=np.int64)
        for first in range(0, len(points), CHUNK):
            rows = slice(first, first + CHUNK)
            facing = None if normals is None else normals[rows]
            triangle[rows] = self._nearest(np.asarray(points[rows], dtype=np.float64), facing, turned)
        weights = closest_weights(points, self._triangles[triangle])
        at = np.einsum("pc,pck->pk", weights, self._triangles[triangle])
        return triangle, weights, np.linalg.norm(at - points, axis=1)

    def _nearest(self, points: Array, normals: Array | None, turned: float) -> Array:
        everyone = np.arange(len(points))
        node = np.zeros(len(points), dtype=np.int64)
        for low, high in self._levels[1:]:
            left = _box_distance(points, low[2 * node], high[2 * node])
            right = _box_distance(points, low[2 * node + 1], high[2 * node + 1])
            node = 2 * node + (right < left)
        best, found = self._in_leaves(points, normals, turned, everyone, node)
        point, node = everyone, np.zeros(len(points), dtype=np.int64)
        for low, high in self._levels[1:]:
            point, node = np.repeat(point, 2), (2 * node[:, None] + (0, 1)).ravel()
            near = _box_distance(points[point], low[node], high[node]) < best[point]
            point, node = point[near], node[near]
        cost, row = self._in_leaves(points, normals, turned, point, node)
        order = np.lexsort((row, cost, point))
        first = order[np.flatnonzero(np.diff(point[order], prepend=-1))]
        closer = cost[first] < best[point[first]]
        found[point[first[closer]]] = row[first[closer]]
        return found

    def _in_leaves(
        self, points: Array, normals: Array | None, turned: float, point: Array, leaf: Array
    ) -> tuple[Array, Array]:
        """Return the least cost in a leaf for each pair of a point and a leaf, and the triangle of it."""
        rows = self._rows[leaf[:, None] * LEAF + np.arange(LEAF)]
        at = np.repeat(points[point], LEAF, axis=0)
        corners = self._triangles[rows.ravel()]
        weights = closest_weights(at, corners)
        cost = ((np.einsum("pc,pck->pk", weights, corners) - at) ** 2).sum(axis=1)
        if normals is not None:
            cosine = np.einsum(
                "pk,pk->p", np.repeat(normals[point], LEAF, axis=0), self._normals[rows.ravel()]
            )
            cost += turned**2 * (1.0 - cosine)
        cost = cost.reshape(rows.shape)
        least = cost.argmin(axis=1)
        pair = np.arange(len(rows))
        return cost[pair, least], rows[pair, least]


def closest_weights(points: Array, triangles: Array) -> Array:
    """Return (p, 3) weights of the corners of (p, 3, 3) triangles, at the points closest to (p, 3) points."""
    along, other = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    to = points - triangles[:, 0]
    aa, ab, bb, ta, tb = (
        np.einsum("pk,pk->p", one, two)
        for one, two in ((along, along), (along, other), (other, other), (to, along), (to, other))
    )
    area = aa * bb - ab**2
    flat = area <= 1e-14 * aa * bb
    scale = 1.0 / np.where(flat, 1.0, area)
    second, third = (bb * ta - ab * tb) * scale, (aa * tb - ab * ta) * scale
    weights = np.stack([1.0 - second - third, second, third], axis=1)
    outside = np.flatnonzero(flat | (weights.min(axis=1) < 0.0))
    best = np.full(len(outside), np.inf)
    for start, end in _EDGES:
        origin = triangles[outside, start]
        edge = triangles[outside, end] - origin
        length = np.maximum(np.einsum("pk,pk->p", edge, edge), 1e-300)
        part = np.clip(np.einsum("pk,pk->p", points[outside] - origin, edge) / length, 0.0, 1.0)
        away = ((origin + part[:, None] * edge - points[outside]) ** 2).sum(axis=1)
        closer = away < best
        best[closer] = away[closer]
        on_edge = np.zeros((int(closer.sum()), 3))
        on_edge[:, start], on_edge[:, end] = 1.0 - part[closer], part[closer]
        weights[outside[closer]] = on_edge
    return weights


def _box_distance(points: Array, low: Array, high: Array) -> Array:
    """Return (p,) squared distances of points to boxes."""
    away: Array = (np.maximum(np.maximum(low - points, points - high), 0.0) ** 2).sum(axis=1)
    return away


def _morton(points: Array) -> Array:
    """Return (p,) uint64 places along a curve on which neighbors are near each other."""
    low = points.min(axis=0)
    extent = max(float((points.max(axis=0) - low).max()), 1e-300)
    cells = ((points - low) / extent * ((1 << MORTON_BITS) - 1)).astype(np.uint64)
    code = np.zeros(len(points), dtype=np.uint64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return code
