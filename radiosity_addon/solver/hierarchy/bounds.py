"""Sizes, positions and directions of nodes, which decide initial links."""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from .nodes import Hierarchy


class NodeShapes:
    """Position, size and directions of every cluster and face, by node number.

    middle (n, 3).
    radius (n,): Of a sphere around the middle that holds the node [m].
    half (n, 3): Half the sides of its box [m].
    axis (n, 3): The mean normal, unit.
    cone (n,): Largest angle between the axis and a face's normal [rad].
    area (n,) [m²].
    """

    def __init__(self, hierarchy: Hierarchy) -> None:
        clusters, faces = hierarchy.clusters, hierarchy.faces
        lower, upper = faces.corners.min(axis=1), faces.corners.max(axis=1)
        self.count = len(clusters)
        self.middle = np.concatenate([clusters.middle, 0.5 * (lower + upper)])
        self.half = np.concatenate([0.5 * (clusters.upper - clusters.lower), 0.5 * (upper - lower)])
        self.radius = np.linalg.norm(self.half, axis=1)
        axis = clusters.normal / np.maximum(clusters.coherence, 1e-300)[:, None]
        self.axis = np.concatenate([axis, faces.normal])
        self.cone = np.concatenate([clusters.cone, np.zeros(len(faces))])
        self.area = np.concatenate([clusters.area, faces.area])

    def looks_large(self, one: Array, other: Array, size: float | Array) -> Array:
        """Return (n,) whether the radii of two nodes exceed `size` × their distance."""
        distance = np.linalg.norm(self.middle[other] - self.middle[one], axis=1)
        return np.asarray(self.radius[one] + self.radius[other] > size * distance)

    def exchange_bound(self, one: Array, other: Array) -> Array:
        """Return (n,) an estimate of the maximum exchange of two nodes, A F [m²], ignoring occlusion."""
        distance = np.linalg.norm(self.middle[other] - self.middle[one], axis=1)
        gap = np.maximum(distance - self.radius[one] - self.radius[other], 0.0)
        areas = self.area[one], self.area[other]
        least, product, square = np.minimum(*areas), areas[0] * areas[1], np.pi * gap**2
        # The quotient counts only where it is below `least`: elsewhere it could overflow.
        far = np.divide(product, square, out=least.copy(), where=product < least * square)
        return np.asarray(np.minimum(least, far))

    def may_see(self, one: Array, other: Array) -> Array:
        """Return (n,) False where one surely lies behind all faces of the other."""
        along = self.middle[other] - self.middle[one]
        return np.asarray(self._rises(one, other, along) & self._rises(other, one, -along))

    def _rises(self, one: Array, other: Array, along: Array) -> Array:
        """Return (n,) whether any part of the other may lie in front of a face of the one."""
        axis, cone = self.axis[one], self.cone[one]
        radii = self.radius[one] + self.radius[other]
        rise = np.einsum("nk,nk->n", along, axis)
        # Faces of one direction: boxes are exact.
        reach = np.einsum("nk,nk->n", self.half[one] + self.half[other], np.abs(axis))
        flat_rises = rise + reach > 1e-6 * radii
        # Others: the cone of directions between the two spheres.
        distance = np.maximum(np.linalg.norm(along, axis=1), 1e-300)
        spread = np.arcsin(np.minimum(radii / distance, 1.0))
        angle = np.arccos(np.clip(rise / distance, -1.0, 1.0))
        cone_rises = (distance <= radii) | (angle - spread - cone <= 0.5 * np.pi)
        return np.asarray(np.where(cone < 1e-6, flat_rises, cone_rises))
