"""Lamps of very many faces: from afar, groups of faces send like a rectangle.

A bulb of ten thousand triangles cannot be evaluated triangle by triangle at every texel. A binary tree
groups the faces by position and orientation; each point descends it until a group is small for its
distance and faces one way (Walter et al., Lightcuts: a scalable approach to illumination, 2005).
Such a group sends like the rectangle that has its area vector, its centroid and its second moments;
single faces are evaluated exactly. Groups that face many ways, as bulbs do, send from afar what a table of
directions says (`direction_table.py`). Which groups a point uses depends on the point alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...form_factors import point_to_polygon
from ...numerics import Array, running_sums, tiles, triangle_areas
from .direction_table import DirectionTable

NEAREST = 3.0
"""A flat group is evaluated as one from this many times its radius on, …"""

CURVED = 4.0
"""… one that is not flat from this many, if its normals span little …"""

MOST_SLANT = 0.35
"""… (the sine of the angle to the farthest from their mean), and none of its faces is turned away."""

FAR = 10.0
"""From this many radii on a node above the horizon sends like a disk of its area, or by its table."""

FLAT_SINE = 1e-5
"""Sine of the angle to the farthest normal of a flat group."""

TURN = 0.25
"""A group's normals count like places that are apart by this part of its extent: bulbs are told apart
before their sides are."""

LEAST_SENT = 1e-3
"""A group is chosen as if it sent this part of its area at least: that it sends none is an estimate."""

MOST_TABLES = 512
"""Groups that have a table of directions at most, the largest first: 12 kB each."""

MOST_PAIRS = 1 << 17
"""Pairs of points and nodes that are looked at at once; their temporaries take some 30 MB."""

CHUNK_PAIRS = 1 << 14
"""Pairs that are evaluated in closed form at once; their temporaries take some ten MB."""

THINNEST = 1e-3
"""A rectangle's shorter side, as a part of its longer one, at least."""


class EmitterPairs(NamedTuple):
    """The nodes that light n points: p pairs sorted by point.

    row, node (p,) int.
    factor (p,): What the point gets from the node per unit of strength; above 0.
    """

    row: Array
    node: Array
    factor: Array


class EmitterTree:
    """Emissive faces under a balanced binary tree.

    corners (m, 3, 3).
    normals (m, 3).
    weight (m,) [m²]: Areas, times what part of the lamp's strength each face emits.
    lift: Points count as lying so far above their surfaces [m]: one that is rounded behind its own would
        see all of that surface's back.
    """

    def __init__(self, corners: Array, normals: Array, weight: Array, lift: float = 0.0) -> None:
        self._lift = lift
        self.order, levels = _sorted_tree(corners.mean(axis=1), normals)
        """(m,) int: the faces by their place in the tree: every node holds a run of them"""
        corners, normals, weight = corners[self.order], normals[self.order], weight[self.order]
        self.begin = np.concatenate([level[:-1] for level in levels])
        self.end = np.concatenate([level[1:] for level in levels])
        """(k,) int: the run of each node; level by level from the root, each node's two children follow"""
        self._levels = np.cumsum([0] + [len(level) - 1 for level in levels])
        depth = np.repeat(np.arange(len(levels)), np.diff(self._levels))
        self._child = self._levels[1:][depth] + 2 * (np.arange(len(depth)) - self._levels[depth])
        self._single = self.end - self.begin == 1
        self.running = running_sums(weight)
        """(m + 1,) float64: summed weights along the order"""
        self._describe(corners, normals, weight)

    def _describe(self, corners: Array, normals: Array, weight: Array) -> None:
        """Find every node's center, radius, spread of normals, and rectangle."""
        origin = corners.reshape(-1, 3).mean(axis=0)
        local, centroid = corners - origin, corners.mean(axis=1) - origin
        total = self._sums(weight)
        heavy = np.maximum(total, 1e-300)
        self.center = self._sums(weight[:, None] * centroid) / heavy[:, None]
        vector = self._sums(weight[:, None] * normals)
        length = np.linalg.norm(vector, axis=1)
        facing = vector / np.maximum(length, 1e-300)[:, None]
        # ∫ x xᵀ over a triangle of area 1: (Σ v vᵀ + 9 c cᵀ) / 12.
        square = np.einsum("mci,mcj->mij", local, local) + 9.0 * centroid[:, :, None] * centroid[:, None]
        moment = self._sums(weight[:, None, None] * square / 12.0) / heavy[:, None, None]
        moment -= self.center[:, :, None] * self.center[:, None]
        across = np.eye(3) - facing[:, :, None] * facing[:, None]
        width, axes = np.linalg.eigh(across @ moment @ across)
        half = np.sqrt(3.0 * np.maximum(width[:, 1:], 0.0))
        half[:, 0] = np.maximum(half[:, 0], THINNEST * half[:, 1])
        one, other = axes[:, :, 1] * half[:, :1], axes[:, :, 2] * half[:, 1:]
        turned = np.einsum("ki,ki->k", np.cross(one, other), facing) < 0
        other[turned] *= -1.0
        around = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        self.center += origin
        self.polygon = self.center[:, None] + around[:, :1] * one[:, None] + around[:, 1:] * other[:, None]
        self._scale = length / np.maximum(4.0 * half.prod(axis=1), 1e-300)
        single = np.flatnonzero(self._single)
        face = self.begin[single]
        # A repeated corner is an edge of no length.
        self.polygon[single] = corners[face][:, [0, 1, 2, 2]]
        self._scale[single] = weight[face] / np.maximum(triangle_areas(local[face]), 1e-300)
        self.facing, self._vector = facing, length
        self.radius, self._slant = self._extremes(corners, normals)
        flat, coherent = self._slant <= FLAT_SINE, self._slant <= MOST_SLANT
        self._smallness = np.where(flat, 1.0 / NEAREST, np.where(coherent, 1.0 / CURVED, 0.0))
        turning = np.flatnonzero(~coherent & (self.end - self.begin > 1))[:MOST_TABLES]
        self._tables = DirectionTable(
            centroid + origin, normals, weight, self.center[turning], self.begin[turning], self.end[turning]
        )
        self._table = np.full(len(self.begin), -1)
        self._table[turning] = np.arange(len(turning))

    def _sums(self, values: Array) -> Array:
        """Return (k, …) the sums over every node's faces of (m, …)."""
        running = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
        return np.asarray(running[self.end] - running[self.begin])

    def _extremes(self, corners: Array, normals: Array) -> tuple[Array, Array]:
        """Return (k,) each center's farthest corner, and the farthest normal's sine; 1 past 90°."""
        radius, cosine = np.zeros((2, len(self.begin)))
        for first, last in zip(self._levels[:-1], self._levels[1:], strict=True):
            held = first + np.flatnonzero(self.end[first:last] > self.begin[first:last])
            node = np.repeat(held, self.end[held] - self.begin[held])
            apart = np.linalg.norm(corners - self.center[node][:, None], axis=2).max(axis=1)
            radius[held] = np.maximum.reduceat(apart, self.begin[held])
            along = np.einsum("mi,mi->m", normals, self.facing[node])
            cosine[held] = np.minimum.reduceat(along, self.begin[held])
        sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        return radius, np.where(cosine > 0.0, sine, 1.0)

    def ask(self, points: Array, normals: Array) -> EmitterPairs:
        """Return what points (n, 3) that face along `normals` get from nodes that together are all faces."""
        found = []
        waiting = [(np.arange(len(points)), np.zeros(len(points), dtype=np.int64))]
        while waiting:
            row, node = waiting.pop()
            if len(row) > MOST_PAIRS and row.min() < row.max():
                # By points: so each meets its nodes in an order that depends on no other.
                first = row < (row.min() + row.max() + 1) // 2
                waiting += [(row[~first], node[~first]), (row[first], node[first])]
                continue
            done, row, node = self._step_down(points, normals, row, node)
            found += done
            if len(row):
                waiting.append((row, node))
        row, node, factor = (np.concatenate(part) for part in zip(*found, strict=True))
        lit = np.flatnonzero(factor > 0)
        lit = lit[np.argsort(row[lit], kind="stable")]
        return EmitterPairs(row[lit], node[lit], factor[lit])

    def _step_down(
        self, points: Array, normals: Array, row: Array, node: Array
    ) -> tuple[list[EmitterPairs], Array, Array]:
        """Evaluate the pairs whose nodes may stand for their faces; return them, and the others' children."""
        along = points.take(row, axis=0) - self.center.take(node, axis=0)
        distance = np.sqrt(np.einsum("pk,pk->p", along, along))
        radius = self.radius.take(node)
        slant = self._slant.take(node) * distance
        # All below the point's horizon, or all faces turned away: a fan of normals within an angle
        # and a ball within another are both left behind by the sum of their sines at most.
        height = np.einsum("pk,pk->p", along, normals.take(row, axis=0))
        front = np.einsum("pk,pk->p", along, self.facing.take(node, axis=0))
        seen = (height <= radius) & (front >= -(radius + slant))
        single = self._single.take(node)
        whole = (slant <= FLAT_SINE * distance) | (front >= radius + slant)
        settled = single | (whole & (radius <= self._smallness.take(node) * distance))
        far = seen & (distance > FAR * radius) & (height < -radius)
        simple = far & settled
        done = np.flatnonzero(simple)
        factor = _disk_factor(-height[done], front[done], distance[done], self._vector[node[done]])
        found = [EmitterPairs(row[done], node[done], factor)]
        done = self._in_front(row, node, np.flatnonzero(seen & settled & ~simple), front, normals)
        factor = self._closed(points, normals, row[done], node[done])
        found.append(EmitterPairs(row[done], node[done], factor))
        tabled = far & ~settled & (self._table.take(node) >= 0)
        done = np.flatnonzero(tabled)
        facing = normals.take(row[done], axis=0)
        factor = self._tables.factors(
            self._table[node[done]], along[done], facing, -height[done], distance[done]
        )
        found.append(EmitterPairs(row[done], node[done], factor))
        more = np.flatnonzero(seen & ~settled & ~tabled)
        child = self._child.take(node[more])
        return found, np.repeat(row[more], 2), np.stack([child, child + 1], axis=1).ravel()

    def _in_front(self, row: Array, node: Array, pairs: Array, front: Array, normals: Array) -> Array:
        """Return those of some pairs whose lifted points are in front of their nodes, if these are flat."""
        facing = self.facing.take(node[pairs], axis=0)
        rise = np.einsum("pk,pk->p", normals.take(row[pairs], axis=0), facing)
        flat = self._slant[node[pairs]] <= FLAT_SINE
        return np.asarray(pairs[~flat | (front[pairs] + self._lift * rise > 0.0)])

    def descend(self, points: Array, node: Array, u: Array) -> tuple[Array, Array, Array]:
        """Choose below nodes that send by a table one that does not, in proportion to what it sends.

        points (p, 3), node (p,), u (p,): The last is in [0, 1), and used up in part.
        Returns node (p,), u (p,), and the probability of the choice (p,).
        """
        node, u, chance = node.copy(), u.copy(), np.ones(len(node))
        rows = np.flatnonzero(self._table[node] >= 0)
        while len(rows):
            along = points[rows] - self.center[node[rows]]
            along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
            first = self._child[node[rows]]
            one, other = (self._sent(first + step, along) for step in (0, 1))
            split = one / np.maximum(one + other, 1e-300)
            right = u[rows] >= split
            part = np.where(right, 1.0 - split, split)
            # A number that was rounded up to 1 chooses a node that sends nothing: with a chance of 0.
            rest = (u[rows] - np.where(right, split, 0.0)) / np.maximum(part, 1e-300)
            u[rows] = np.clip(rest, 0.0, 1.0 - 1e-12)
            chance[rows] *= part
            node[rows] = first + right
            rows = rows[self._table[node[rows]] >= 0]
        return node, u, chance

    def _sent(self, node: Array, along: Array) -> Array:
        """Return (p,) about what nodes send along unit directions (p, 3): their visible areas [m²]."""
        weight = self.running[self.end[node]] - self.running[self.begin[node]]
        front = np.einsum("pk,pk->p", along, self.facing[node])
        sent = self._vector[node] * np.maximum(front, 0.0)
        # Few faces that face many ways.
        many = self._slant[node] > MOST_SLANT
        sent[many] = 0.25 * weight[many]
        table = self._table[node]
        known = np.flatnonzero(table >= 0)
        sent[known] = self._tables.area(table[known], along[known])
        return np.asarray(sent + LEAST_SENT * weight + np.where(weight > 0.0, 1e-300, 0.0))

    def _closed(self, points: Array, normals: Array, row: Array, node: Array) -> Array:
        """Return (p,) what points get from nodes in closed form."""
        factor = np.empty(len(row))
        for pairs in tiles(len(row), CHUNK_PAIRS):
            point, shape = row[pairs], self.polygon.take(node[pairs], axis=0)
            factor[pairs] = point_to_polygon(
                points.take(point, axis=0), normals.take(point, axis=0), shape, contact=False
            )
        return factor * self._scale.take(node)


def _disk_factor(rise: Array, front: Array, distance: Array, area: Array) -> Array:
    """Return (p,) factors to disks: `rise` and `front` are the cosines times the distance."""
    square = distance * distance
    return np.asarray(rise * np.maximum(front, 0.0) * area / (square * (np.pi * square + area)))


def _sorted_tree(places: Array, normals: Array) -> tuple[Array, list[Array]]:
    """Sort faces into a balanced tree by halving runs along their widest axis of six.

    Returns order (m,) int.
    Returns levels list of (2^l + 1,) int: Where the runs of each level begin, and the last one ends; the last
        level's hold one face each, or none.
    """
    keys = np.concatenate([places, normals], axis=1)
    count = len(places)
    order, bounds = np.arange(count), np.array([0, count])
    levels = [bounds]
    while (np.diff(bounds) > 1).any():
        run = np.repeat(np.arange(len(bounds) - 1), np.diff(bounds))
        sorted_keys = keys[order]
        held = np.flatnonzero(np.diff(bounds) > 0)
        low = np.minimum.reduceat(sorted_keys, bounds[held], axis=0)
        high = np.maximum.reduceat(sorted_keys, bounds[held], axis=0)
        widest = np.zeros(len(bounds) - 1, dtype=np.int64)
        extent = high - low
        extent[:, 3:] *= TURN * np.linalg.norm(extent[:, :3], axis=1, keepdims=True)
        widest[held] = extent.argmax(axis=1)
        along = np.take_along_axis(sorted_keys, widest[run][:, None], axis=1)[:, 0]
        order = order[np.lexsort((along, run))]
        middle = (bounds[:-1] + bounds[1:] + 1) // 2
        bounds = np.append(np.stack([bounds[:-1], middle], axis=1).ravel(), count)
        levels.append(bounds)
    return order, levels
