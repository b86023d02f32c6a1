"""Parts of leaf elements whose points see each other: what answers a ray that hits a leaf.

A leaf may run on under a wall, and the hierarchy knows but one value for both sides. Were that
what a ray gets, one from inside a closed box would bring the lit floor outside with it. So a leaf
answers as the part of it that sees its *anchor*, a point inside. Hits that do not see the anchor
are answered by one of the leaf's sixteenths, each again the part that sees its own anchor.

Nor does a leaf look alike all over: next to a wall it is darker than in its middle, and what a panel or a
picture covers is black, though the gap below it lets lines of sight pass. So what is wider than a few texels
answers only where no finer cell is seen, or where leaves are cut no further; and below a hood only a cell
below it does, as with texels (`lightmap/texels/occlusion.py`).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ...numerics import Array, points_at, points_on_triangles, split_in_four, split_in_sixteen, weights_at
from ...rays import SIGHT_LIFT, Hits, RayCaster, free_segment
from ..hierarchy import Hierarchy
from .footprints import Footprints
from .hit_numbers import NOTHING

CELLS_PER_ELEMENT = 16
"""Smaller parts of a leaf: two levels of its quadtree further down. In large leaves each has as many."""

MAX_DEPTH = 3
"""How many times a large leaf is cut into sixteenths."""

FINE = 3.0
"""What is not wider than this many texels answers as a whole, …"""

FINEST = 0.75
"""… but for rays that are shorter than a part of its width: those ask cells down to this width, if it is
wider, …"""

NEAR = 0.5
"""… which is this part."""

HOOD = 0.25
"""What is nearer above a large leaf than this part of a texel's width hoods it."""

ANCHOR = np.array([0.3595, 0.3218, 0.3187])
"""Barycentric weights. Near the centroid, but off it: walls stand on round fractions of a floor."""

_CHILDREN = split_in_four(np.eye(3)[None])[0]
"""(4, 3, 3) weights of a triangle's corners at those of its four children."""

_SIXTEENTHS = split_in_sixteen(np.eye(3)[None])[0]
"""(16, 3, 3) weights of a triangle's corners at those of its sixteenths."""

_ANCHORS = ANCHOR @ _SIXTEENTHS
"""(16, 3) weights of a triangle's corners at the anchors of its sixteenths."""

STARTS = 16
"""Points of a part that its gather rays start from: each costs a ray to the anchor."""


class ElementCells:
    """Numbers the parts of all leaves: the e elements first, then the cells of each.

    hierarchy: Is not refined any more.
    finest: Width of a texel [m]; with endless ones every leaf answers as a whole.
    """

    def __init__(self, hierarchy: Hierarchy, caster: RayCaster, finest: float = np.inf) -> None:
        self._hierarchy, self._caster, self._finest = hierarchy, caster, finest
        self._size = np.sqrt(hierarchy.area[: hierarchy.n_elements])
        self._depth = self._levels(FINEST)
        self._enough = self._levels(FINE)
        counts = np.array([_STARTS[level] for level in range(1, MAX_DEPTH + 1)])
        ends = hierarchy.n_elements + np.cumsum(counts[self._depth - 1])
        self._first = np.concatenate([[hierarchy.n_elements], ends])

    def __len__(self) -> int:
        return int(self._first[-1])

    def leaf_of(self, part: Array) -> Array:
        """Return (p,) the leaf that each part is of."""
        cell = np.searchsorted(self._first, part, side="right") - 1
        return np.asarray(np.where(part < self._hierarchy.n_elements, part, cell))

    def renumbered(self, other: ElementCells) -> Array:
        """Return (parts,) int32 the numbers that these parts have among another's, or NOTHING."""
        part = np.arange(len(self))
        leaf = self.leaf_of(part)
        moved = part - self._first[leaf] + other._first[leaf]
        number = np.where(self._depth[leaf] == other._depth[leaf], moved, NOTHING)
        number[: self._hierarchy.n_elements] = leaf[: self._hierarchy.n_elements]
        return number.astype(np.int32)

    def at(self, leaf: Array, hits: Hits) -> Array:
        """Return (h,) int32: the part of its `leaf` that each hit sees the anchor of, the nearest of them.

        NOTHING where there is no leaf, or a spot that sees no anchor.
        """
        part = leaf.copy()
        rows = np.flatnonzero(leaf != NOTHING)
        hits, leaf = hits.take(rows), leaf[rows]
        normal = self._hierarchy.normal_of(leaf)
        position = self._positions(hits) + self._lift(normal)
        large = self._is_large(leaf)
        level = np.where(large, self._enough[leaf], 0)
        # What is close to a ray's start is as wide for it as many texels are from afar.
        near = self._size[leaf] > FINEST * self._finest
        near &= hits.distance < NEAR * self._size[leaf] / 4.0**level
        level[near] = self._depth[leaf[near]]
        whole = np.flatnonzero(level == 0)
        anchor = ANCHOR @ self._hierarchy.corners[leaf[whole]] + self._lift(normal[whole])
        level[whole[~free_segment(self._caster, position[whole], anchor)]] = 1
        cut = np.flatnonzero(level)
        part[rows[cut]] = self._cells_at(leaf[cut], position[cut], normal[cut], level[cut])
        return part

    def footprints(self, part: Array) -> Footprints:
        """Return parts as footprints: their samples see the anchor."""
        corners, leaf = self._corners(part), self.leaf_of(part)
        normal = self._hierarchy.normal_of(leaf)
        anchor, lift = ANCHOR @ corners, self._lift(normal)
        hooded = self._is_large(leaf) & (part >= self._hierarchy.n_elements)
        sample = partial(_sample, self, corners, anchor, lift, hooded)
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

    def _levels(self, texels: float) -> Array:
        """Return (e,) int8: how many times leaves are cut until their cells are so many texels wide."""
        levels = [self._size > texels * self._finest * 4**level for level in range(1, MAX_DEPTH)]
        return np.asarray(1 + sum(wider.astype(np.int8) for wider in levels))

    def _is_large(self, leaf: Array) -> Array:
        """Return (l,) bool: leaves of which texels would show more."""
        return np.asarray(self._size[leaf] > FINE * self._finest)

    def _cells_at(self, leaf: Array, position: Array, normal: Array, level: Array) -> Array:
        """Return (h,) the cells of a level, or a coarser one, whose anchors lifted points see, or NOTHING."""
        found = np.full(len(leaf), NOTHING, dtype=np.int32)
        for wanted in range(MAX_DEPTH, 0, -1):
            rows = np.flatnonzero((found == NOTHING) & (level >= wanted))
            if len(rows):
                found[rows] = self._cells_of_level(leaf[rows], position[rows], normal[rows], wanted)
        return found

    def _cells_of_level(self, leaf: Array, position: Array, normal: Array, level: int) -> Array:
        """Return (h,) the nearest cells of one level whose anchors lifted points see, or NOTHING."""
        lift, every = self._lift(normal), np.arange(len(leaf))
        corners, path = self._cells_around(leaf, position, level - 1)
        anchors = _ANCHORS @ corners + lift[:, None]
        apart = anchors - position[:, None]
        square = np.einsum("hkx,hkx->hk", apart, apart)
        number = self._first[leaf] + _STARTS[level - 1] + CELLS_PER_ELEMENT * path
        hooded = self._is_large(leaf)
        below = np.zeros(len(leaf), dtype=bool)
        below[hooded] = self.below_hood(position[hooded], normal[hooded])
        found = np.full(len(leaf), NOTHING, dtype=np.int32)
        waiting = every
        for _ in range(CELLS_PER_ELEMENT):
            if len(waiting) == 0:
                break
            cell = square[waiting].argmin(axis=1)
            square[waiting, cell] = np.inf
            anchor = anchors[waiting, cell]
            seen = free_segment(self._caster, position[waiting], anchor)
            asked = np.flatnonzero(seen & hooded[waiting])
            if len(asked):
                _, first, inverse = np.unique(
                    number[waiting[asked]] + cell[asked], return_index=True, return_inverse=True
                )
                one = asked[first]
                hides = self.below_hood(anchor[one], normal[waiting[one]])[inverse.reshape(-1)]
                seen[asked] = hides == below[waiting[asked]]
            rows = waiting[seen]
            found[rows] = number[rows] + cell[seen]
            waiting = waiting[~seen]
        return found

    def _cells_around(self, leaf: Array, position: Array, level: int) -> tuple[Array, Array]:
        """Return (h, 3, 3) the corners of the cells of a level below (h, 3) points, and their places."""
        corners, every = self._hierarchy.corners[leaf], np.arange(len(leaf))
        path = np.zeros(len(leaf), dtype=np.int64)
        weights = weights_at(corners, position[:, None])[:, 0]
        for _ in range(2 * level):
            child = np.where(weights.max(axis=1) >= 0.5, weights.argmax(axis=1), 3)
            at_corner = 2.0 * weights
            at_corner[every, np.minimum(child, 2)] -= 1.0
            weights = np.where((child == 3)[:, None], 1.0 - 2.0 * weights, at_corner)
            corners, path = _CHILDREN[child] @ corners, 4 * path + child
        return corners, path

    def sees(self, start: Array, end: Array) -> Array:
        """Return (n,) whether nothing lies between (n, 3) points."""
        return free_segment(self._caster, start, end)

    def below_hood(self, lifted: Array, normal: Array) -> Array:
        """Return (h,) whether something is close above (h, 3) lifted points."""
        lift = SIGHT_LIFT * self._caster.surface_offset
        height = np.full(len(lifted), max(HOOD * self._finest - lift, lift))
        return np.asarray(~self._caster.unoccluded(lifted, normal, height))

    def _corners(self, part: Array) -> Array:
        """Return (p, 3, 3) the corners of the triangles that parts are of."""
        leaf, count = self.leaf_of(part), self._hierarchy.n_elements
        corners = self._hierarchy.corners[leaf]
        number = part - self._first[leaf]
        for level in range(1, MAX_DEPTH + 1):
            of_level = (number >= _STARTS[level - 1]) & (number < _STARTS[level])
            rows = np.flatnonzero((part >= count) & of_level)
            path = number[rows] - _STARTS[level - 1]
            for step in range(level - 1, -1, -1):
                digit = path // CELLS_PER_ELEMENT**step % CELLS_PER_ELEMENT
                corners[rows] = _SIXTEENTHS[digit] @ corners[rows]
        return np.asarray(corners)

    def _positions(self, hits: Hits) -> Array:
        """Return (h, 3) where rays hit."""
        faces = self._hierarchy.faces
        corners = faces.corners[faces.of_triangle[0, hits.triangle]]
        return points_at(corners, hits.barycentric)

    def _lift(self, normal: Array) -> Array:
        return np.asarray(SIGHT_LIFT * self._caster.surface_offset * normal)


_STARTS = [sum(CELLS_PER_ELEMENT**level for level in range(1, depth + 1)) for depth in range(MAX_DEPTH + 1)]
"""Where the cells of each level begin among those of a leaf, from level 1, and where the last ones end."""


def _sample(
    cells: ElementCells, corners: Array, anchor: Array, lift: Array, hooded: Array, rows: Array, u: Array
) -> Array:
    """Return (r, k, 3) points of parts that see the anchor, or the anchor.

    hooded (p,) bool: Parts that lie below a hood, or not, as a whole.
    """
    points = points_on_triangles(corners[rows], u)
    back = np.broadcast_to(anchor[rows][:, None], points.shape)
    above = lift[rows][:, None]
    seen = cells.sees((points + above).reshape(-1, 3), (back + above).reshape(-1, 3))
    own = seen.reshape(points.shape[:2])
    asked = np.flatnonzero(hooded[rows])
    if len(asked):
        chosen = rows[asked]
        normal = lift[chosen] / np.linalg.norm(lift[chosen], axis=1, keepdims=True)
        below = cells.below_hood(anchor[chosen] + lift[chosen], normal)
        spots = (points[asked] + lift[chosen][:, None]).reshape(-1, 3)
        under = cells.below_hood(spots, np.repeat(normal, points.shape[1], axis=0))
        own[asked] &= under.reshape(len(asked), -1) == below[:, None]
    # What lies behind a wall, or beyond a hood's rim, is not of this part.
    return np.asarray(np.where(own[..., None], points, back))
