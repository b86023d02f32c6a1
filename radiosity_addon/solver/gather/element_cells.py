"""Parts of leaf elements whose points see each other: what answers a ray that hits a leaf.

A leaf may run on under a wall, and the hierarchy knows but one value for both sides. Were that
what a ray gets, one from inside a closed box would bring the lit floor outside with it. So a leaf
answers as the part of it that sees its *anchor*, a point inside. Hits that do not see the anchor
are answered by one of the leaf's sixteenths, each again the part that sees its own anchor.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ...numerics import Array, points_at, points_on_triangles, split_in_sixteen
from ...rays import SIGHT_LIFT, Hits, RayCaster, free_segment
from ..hierarchy import Hierarchy
from .footprints import Footprints
from .hit_numbers import NOTHING

CELLS_PER_ELEMENT = 16
"""Smaller parts of a leaf: two levels of its quadtree further down."""

ANCHOR = np.array([0.3595, 0.3218, 0.3187])
"""Barycentric weights. Near the centroid, but off it: walls stand on round fractions of a floor."""

STARTS = 16
"""Points of a part that its gather rays start from: each costs a ray to the anchor."""


class ElementCells:
    """Numbers the parts of all leaves: the e elements first, then sixteen cells of each.

    hierarchy: Is not refined any more.
    """

    def __init__(self, hierarchy: Hierarchy, caster: RayCaster) -> None:
        self._hierarchy, self._caster = hierarchy, caster

    def __len__(self) -> int:
        return (1 + CELLS_PER_ELEMENT) * self._hierarchy.n_elements

    def leaf_of(self, part: Array) -> Array:
        """Return (p,) the leaf that each part is of."""
        count = self._hierarchy.n_elements
        return np.asarray(np.where(part < count, part, (part - count) // CELLS_PER_ELEMENT))

    def at(self, leaf: Array, hits: Hits) -> Array:
        """Return (h,) int32: the part of its `leaf` that each hit sees the anchor of, the nearest of them.

        NOTHING where there is no leaf, or a spot that sees no anchor.
        """
        part = leaf.copy()
        rows = np.flatnonzero(leaf != NOTHING)
        normal = self._hierarchy.normal_of(leaf[rows])
        position = self._positions(hits.take(rows)) + self._lift(normal)
        anchor = ANCHOR @ self._hierarchy.corners[leaf[rows]] + self._lift(normal)
        apart = np.flatnonzero(~free_segment(self._caster, position, anchor))
        part[rows[apart]] = self._cells_at(leaf[rows[apart]], position[apart], normal[apart])
        return part

    def footprints(self, part: Array) -> Footprints:
        """Return parts as footprints: their samples see the anchor."""
        corners, normal = self._corners(part), self._hierarchy.normal_of(self.leaf_of(part))
        anchor, lift = ANCHOR @ corners, self._lift(normal)
        sample = partial(_sample, self._caster, corners, anchor, lift)
        return Footprints(anchor, normal, part, sample, starts=STARTS)

    def radius(self, part: Array) -> Array:
        """Return (p,) how far parts reach from their anchors at most [m]."""
        corners = self._corners(part)
        apart = corners - (ANCHOR @ corners)[:, None]
        return np.asarray(np.linalg.norm(apart, axis=2).max(axis=1))

    def bounds(self, leaf: Array) -> tuple[Array, Array]:
        """Return (l, 3) twice: the corners of the boxes around leaves."""
        corners = self._hierarchy.corners[leaf]
        return corners.min(axis=1), corners.max(axis=1)

    def _cells_at(self, leaf: Array, position: Array, normal: Array) -> Array:
        """Return (h,) the cells of leaves whose anchors lifted points see, or NOTHING."""
        cells = split_in_sixteen(self._hierarchy.corners[leaf])
        anchors = np.einsum("c,hkcx->hkx", ANCHOR, cells) + self._lift(normal)[:, None]
        order = np.linalg.norm(anchors - position[:, None], axis=2).argsort(axis=1, kind="stable")
        found = np.full(len(leaf), NOTHING, dtype=np.int32)
        waiting = np.arange(len(leaf))
        for turn in range(CELLS_PER_ELEMENT):
            cell = order[waiting, turn]
            seen = free_segment(self._caster, position[waiting], anchors[waiting, cell])
            rows = waiting[seen]
            found[rows] = self._hierarchy.n_elements + CELLS_PER_ELEMENT * leaf[rows] + cell[seen]
            waiting = waiting[~seen]
        return found

    def _corners(self, part: Array) -> Array:
        """Return (p, 3, 3) the corners of the triangles that parts are of."""
        corners = self._hierarchy.corners[self.leaf_of(part)]
        count = self._hierarchy.n_elements
        small = np.flatnonzero(part >= count)
        cells = split_in_sixteen(corners[small])
        corners[small] = cells[np.arange(len(small)), (part[small] - count) % CELLS_PER_ELEMENT]
        return np.asarray(corners)

    def _positions(self, hits: Hits) -> Array:
        """Return (h, 3) where rays hit."""
        faces = self._hierarchy.faces
        corners = faces.corners[faces.of_triangle[0, hits.triangle]]
        return points_at(corners, hits.barycentric)

    def _lift(self, normal: Array) -> Array:
        return np.asarray(SIGHT_LIFT * self._caster.surface_offset * normal)


def _sample(caster: RayCaster, corners: Array, anchor: Array, lift: Array, rows: Array, u: Array) -> Array:
    """Return (r, k, 3) points of parts that see the anchor, or the anchor."""
    points = points_on_triangles(corners[rows], u)
    back = np.broadcast_to(anchor[rows][:, None], points.shape)
    above = lift[rows][:, None]
    seen = free_segment(caster, (points + above).reshape(-1, 3), (back + above).reshape(-1, 3))
    # What lies behind a wall is not of this part.
    return np.asarray(np.where(seen.reshape(*points.shape[:2], 1), points, back))
