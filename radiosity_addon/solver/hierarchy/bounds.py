"""Sizes, positions and directions of nodes, which decide initial links."""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from .nodes import Hierarchy


class NodeShapes:
    """Position, size and directions of clusters and faces, by node number.

    They are computed for the nodes asked about: stored for all of a million faces they would take 400 MB.
    """

    def __init__(self, hierarchy: Hierarchy) -> None:
        self._clusters, self._faces = hierarchy.clusters, hierarchy.faces
        self.count = len(hierarchy.clusters)

    def boxes(self, nodes: Array) -> tuple[Array, Array]:
        """Return the middle of each node's box and half its sides, both (n, 3) [m]."""
        lower, upper = np.empty((2, len(nodes), 3))
        single = nodes >= self.count
        grouped, corners = nodes[~single], self._faces.corners[nodes[single] - self.count]
        lower[~single], upper[~single] = self._clusters.lower[grouped], self._clusters.upper[grouped]
        lower[single], upper[single] = _least(corners), -_least(-corners)
        return 0.5 * (lower + upper), 0.5 * (upper - lower)

    def radius(self, nodes: Array) -> Array:
        """Return (n,) of a sphere around the middle of each node that holds it [m]."""
        return np.asarray(np.linalg.norm(self.boxes(nodes)[1], axis=1))

    def axis(self, nodes: Array) -> Array:
        """Return (n, 3) the unit mean normals."""
        single = nodes >= self.count
        normal = np.empty((len(nodes), 3))
        normal[single] = self._faces.normal[nodes[single] - self.count]
        mean = self._clusters.normal[nodes[~single]]
        normal[~single] = mean / np.maximum(np.linalg.norm(mean, axis=1), 1e-300)[:, None]
        return normal

    def cone(self, nodes: Array) -> Array:
        """Return (n,) the largest angle between the axis and a face's normal [rad]."""
        single = nodes >= self.count
        return np.where(single, 0.0, self._clusters.cone[np.where(single, 0, nodes)] if self.count else 0.0)

    def area(self, nodes: Array) -> Array:
        """Return (n,) [m²]."""
        single = nodes >= self.count
        area = np.empty(len(nodes))
        area[single], area[~single] = (
            self._faces.area[nodes[single] - self.count],
            self._clusters.area[nodes[~single]],
        )
        return area

    def looks_large(self, one: Array, other: Array, size: float | Array) -> Array:
        """Return (n,) whether the radii of two nodes exceed `size` × their distance."""
        (middle, half), (to, half_to) = self.boxes(one), self.boxes(other)
        distance = np.linalg.norm(to - middle, axis=1)
        radii = np.linalg.norm(half, axis=1) + np.linalg.norm(half_to, axis=1)
        return np.asarray(radii > size * distance)

    def exchange_bound(self, one: Array, other: Array) -> Array:
        """Return (n,) an estimate of the maximum exchange of two nodes, A F [m²], ignoring occlusion."""
        (middle, half), (to, half_to) = self.boxes(one), self.boxes(other)
        distance = np.linalg.norm(to - middle, axis=1)
        gap = np.maximum(distance - np.linalg.norm(half, axis=1) - np.linalg.norm(half_to, axis=1), 0.0)
        areas = self.area(one), self.area(other)
        least, product, square = np.minimum(*areas), areas[0] * areas[1], np.pi * gap**2
        # The quotient counts only where it is below `least`: elsewhere it could overflow.
        far = np.divide(product, square, out=least.copy(), where=product < least * square)
        return np.asarray(np.minimum(least, far))

    def may_see(self, one: Array, other: Array) -> Array:
        """Return (n,) False where one surely lies behind all faces of the other."""
        (middle, half), (to, half_to) = self.boxes(one), self.boxes(other)
        halves, along = half + half_to, to - middle
        radii = np.linalg.norm(half, axis=1) + np.linalg.norm(half_to, axis=1)
        return np.asarray(self._rises(one, along, halves, radii) & self._rises(other, -along, halves, radii))

    def _rises(self, one: Array, along: Array, halves: Array, radii: Array) -> Array:
        """Return (n,) whether any part of what lies `along` may lie in front of a face of the one."""
        axis, cone = self.axis(one), self.cone(one)
        rise = np.einsum("nk,nk->n", along, axis)
        # Faces of one direction: boxes are exact.
        reach = np.einsum("nk,nk->n", halves, np.abs(axis))
        flat_rises = rise + reach > 1e-6 * radii
        # Others: the cone of directions between the two spheres.
        distance = np.maximum(np.linalg.norm(along, axis=1), 1e-300)
        spread = np.arcsin(np.minimum(radii / distance, 1.0))
        angle = np.arccos(np.clip(rise / distance, -1.0, 1.0))
        cone_rises = (distance <= radii) | (angle - spread - cone <= 0.5 * np.pi)
        return np.asarray(np.where(cone < 1e-6, flat_rises, cone_rises))


def _least(corners: Array) -> Array:
    """Return (n, 3) the least of (n, 3, 3) corners; faster than a reduction over a short axis."""
    return np.asarray(np.minimum(np.minimum(corners[:, 0], corners[:, 1]), corners[:, 2]))
