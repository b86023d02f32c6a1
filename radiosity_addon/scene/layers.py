"""Which of several surfaces in one place counts: what is covered neither sends, reflects nor absorbs.

The sides of coincident triangles that face the same way share their place. A ray meets one of them: the
outermost; in one plane one that emits before one that does not, a front before a back, and the one listed
first. The others are covered there, as if cut out: they weigh what is left of them, and a ray that meets
one is answered by its cover. A cover that is itself partly cut out covers by its opacity.

Two-sided triangles that face each other have something solid behind one of them, such as a box that stands
on a ground: their fronts touch, so both are covered, and their backs are what a ray meets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics import (
    Array,
    Stream,
    connected_components,
    cosine_hemisphere,
    edge_distances,
    points_at,
    run_numbers,
    stratified_square,
    to_world,
    weights_at,
)
from ..rays import NO_HIT, EmbreeCaster, Hits, surface_offset
from .coincident_pairs import CORNERS, CoincidentPairs, coincident_pairs, tolerances
from .surfaces import Surfaces
from .uncovered_parts import OwnParts, own_parts

NEAR_EMITTERS = 3.0
"""Emissive faces are covered by faces up to this many surface offsets in front: shadow rays miss those."""

ONE_PLANE = 0.5
"""Faces closer than this part of their tolerance count as coplanar: their order is lost in rounding."""

FINE = 1.0 / 64.0
"""Heights that round to the same multiple of this part of the tolerance are equal."""

PROBES = 32
"""Rays that decide whether a face belongs to a solid."""

MOST_CROSSINGS = 8
"""Surfaces that such a ray crosses at most."""

MANY_COPIES = 4
"""Beyond this number, exact copies of one triangle are not compared pair by pair."""

MOST_COVERS = 16
"""A hit is handed on from cover to cover this often at most."""

INSIDE = -1e-9
"""Points of a polygon's rim are in it."""

BOX_MARGIN = 1e-3
"""Points that far outside the box around a polygon are not in it, whatever is rounded."""


@dataclass(frozen=True)
class Covers:
    """c covered parts, sorted by side; side 2 t is the front of triangle t, 2 t + 1 its back.

    side, by (c,) int: What is covered, and what covers it.
    part (c, 8, 2): A convex polygon, in weights of the triangle's second and third corner, counter-clockwise.
    in_cover (c, 8, 2): The same in weights of the cover's triangle.
    """

    side: Array
    by: Array
    part: Array
    in_cover: Array

    def __len__(self) -> int:
        return len(self.side)

    def take(self, rows: Array) -> Covers:
        """Return some of them."""
        return Covers(self.side[rows], self.by[rows], self.part[rows], self.in_cover[rows])


class Layers:
    """The covered parts of a scene's sides."""

    def __init__(self, scene: Surfaces) -> None:
        self._scene = scene
        solid = np.flatnonzero((scene.areas > 0) & scene.in_bounces)
        tolerance = tolerances(scene.triangles)
        self.tolerance = tolerance
        """(t,) [m]: triangles no farther apart are in one place"""
        emits = scene.emission.max(axis=1, initial=0.0) > 0
        offset = surface_offset(scene.triangles)
        reach = np.where(emits, np.maximum(tolerance, NEAR_EMITTERS * offset), tolerance)
        copy, original = _many_copies(scene, solid, emits)
        pairs = coincident_pairs(scene.triangles, np.setdiff1d(solid, copy), tolerance, reach)
        contact, pressed = _contacts(scene, pairs, tolerance)
        covers = _covers(scene, pairs, tolerance, emits, contact)
        self.covers = _sorted([covers, _whole_covers(scene, copy, original)])
        first = np.searchsorted(self.covers.side, np.arange(2 * len(scene) + 1))
        self._covered = PolygonRuns(first, self.covers.part)
        first = np.searchsorted(pressed.side, 2 * np.arange(len(scene) + 1))
        self._pressed = PolygonRuns(first, pressed.part)

    def __bool__(self) -> bool:
        return len(self.covers) > 0

    @cached_property
    def own(self) -> OwnParts:
        """The uncovered parts of covered sides."""
        return own_parts(
            self.covers.side, self.covers.part, self.covers.by, self.covers.in_cover, self._scene
        )

    def owners(self, hits: Hits) -> Hits:
        """Return hits, with those on covered sides moved to their covers."""
        side = 2 * hits.triangle + ~hits.front
        moved = np.flatnonzero((hits.triangle != NO_HIT) & self._is_covered[side])
        if len(moved) == 0:
            return hits
        side, place = side[moved].astype(np.int64), hits.barycentric[moved].astype(np.float64)
        waiting = np.arange(len(moved))
        for _ in range(MOST_COVERS):
            row, cover = self._covered.holding(side[waiting], place[waiting])
            cut = None if self._scene.images is None else self._scene.images.cut_out
            if cut is not None:
                solid = ~cut[self.covers.by[cover] // 2]
                row, cover = row[solid], cover[solid]
            if len(row) == 0:
                break
            # Any cover will do: it passes the hit on to its own.
            row, only = np.unique(row, return_index=True)
            cover, waiting = cover[only], waiting[row]
            points = self.points(side[waiting], place[waiting])
            side[waiting] = self.covers.by[cover]
            place[waiting] = self.weights(side[waiting], points)
        triangle, front, barycentric = hits.triangle.copy(), hits.front.copy(), hits.barycentric.copy()
        triangle[moved], front[moved] = side // 2, side % 2 == 0
        barycentric[moved] = place
        return Hits(triangle, barycentric, front, hits.distance, hits.tint)

    def is_pressed(self, triangle: Array, barycentric: Array) -> Array:
        """Return (n,) whether points of triangles' fronts, (n,) and (n, 2), lie against another surface.

        Only of those fronts that something solid is behind.
        """
        found = np.zeros(len(triangle), dtype=bool)
        row, _ = self._pressed.holding(triangle, barycentric)
        found[row] = True
        return found

    @cached_property
    def pressed_triangles(self) -> Array:
        """(t,) bool: triangles of which some points are pressed."""
        return np.diff(self._pressed.first) > 0

    @cached_property
    def _is_covered(self) -> Array:
        return np.diff(self._covered.first) > 0

    def points(self, side: Array, place: Array) -> Array:
        """Return (n, 3) the points of sides at weights (n, 2) of their triangles' corners [m]."""
        return points_at(self._scene.triangles[side // 2], place)

    def weights(self, side: Array, points: Array) -> Array:
        """Return (n, 2) the weights of points in sides' triangles, drawn into them."""
        weights = np.maximum(weights_at(self._scene.triangles[side // 2], points[:, None])[:, 0, 1:], 0.0)
        return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1.0))


class PolygonRuns:
    """Runs of convex polygons (c, k, 2), one run for each row; `first` (r + 1,) int is where they begin."""

    def __init__(self, first: Array, polygons: Array) -> None:
        self.first, self._polygons = first, polygons
        # One row a coordinate: to take from a column, NumPy copies the whole column first.
        self._low = np.ascontiguousarray(polygons.min(axis=1).T - BOX_MARGIN)
        self._high = np.ascontiguousarray(polygons.max(axis=1).T + BOX_MARGIN)

    def holding(self, row: Array, place: Array) -> tuple[Array, Array]:
        """Return the pairs of points (n,) and polygons of their `row` (n,) that they lie in.

        place (n, 2).
        """
        count = self.first[row + 1] - self.first[row]
        point = np.repeat(np.arange(len(row)), count)
        polygon = run_numbers(count, self.first[row])
        for axis in range(2):
            along = place[:, axis].take(point)
            near = (along >= self._low[axis].take(polygon)) & (along <= self._high[axis].take(polygon))
            point, polygon = point[near], polygon[near]
        corners = self._polygons.shape[1]
        for edge in range(corners):
            # Most pairs fail at one of the first edges.
            side = self._polygons[polygon[:, None], [[edge, (edge + 1) % corners]]]
            inside = edge_distances(place[point][:, None], side, 0)[:, 0] >= INSIDE
            point, polygon = point[inside], polygon[inside]
        return point, polygon


def _contacts(scene: Surfaces, pairs: CoincidentPairs, tolerance: Array) -> tuple[Array, Covers]:
    """Find the pairs whose fronts touch.

    Returns contact (p,) bool.
    Returns pressed: Of fronts with something solid behind them, where they touch; sorted by side.
    """
    both = scene.two_sided[pairs.first] & scene.two_sided[pairs.second] & ~pairs.same
    near = np.abs(pairs.height) <= np.maximum(tolerance[pairs.first], tolerance[pairs.second])
    rows = np.flatnonzero(both & near)
    contact = np.zeros(len(pairs), dtype=bool)
    if len(rows) == 0:
        return contact, _no_covers()
    caster = EmbreeCaster(scene.triangles, only=scene.in_bounces)
    sides, others, parts, in_others = [], [], [], []
    for triangle, other, part, in_other in (
        (pairs.first, pairs.second, pairs.in_first, pairs.in_second),
        (pairs.second, pairs.first, pairs.in_second, pairs.in_first),
    ):
        behind = rows[_solid_behind(scene, caster, triangle[rows], part[rows], tolerance)]
        contact[behind] = True
        sides.append(2 * triangle[behind])
        others.append(2 * other[behind])
        parts.append(part[behind])
        in_others.append(in_other[behind])
    joined = Covers(*(np.concatenate(each) for each in (sides, others, parts, in_others)))
    return contact, _sorted([joined])


def _solid_behind(
    scene: Surfaces, caster: EmbreeCaster, triangle: Array, part: Array, tolerance: Array
) -> Array:
    """Return (n,) whether parts (n, k, 2) of triangles have something solid behind them, by most rays."""
    count, corners = len(triangle), scene.triangles[triangle]
    middle = part.mean(axis=1, keepdims=True)
    # Half way from the middle to the corners.
    spots = 0.5 * (middle + part)[:, np.arange(PROBES) % part.shape[1]]
    points = corners[:, :1] + np.einsum("npw,nwk->npk", spots, corners[:, 1:] - corners[:, :1])
    back = -scene.face_normals[triangle]
    lift = np.maximum(caster.surface_offset, 2.0 * tolerance[triangle])
    points = points + (lift[:, None] * back)[:, None]
    unit = stratified_square(np.arange(count), PROBES, Stream.BACK_PROBES)
    directions = to_world(cosine_hemisphere(unit), back)
    inner = _leaves_solid(caster, points.reshape(-1, 3), directions.reshape(-1, 3))
    return np.asarray(inner.reshape(count, PROBES).mean(axis=1) > 0.5)


def _leaves_solid(caster: EmbreeCaster, points: Array, directions: Array) -> Array:
    """Return (n,) whether rays leave more solids than they enter, up to some place on their way.

    What stands in a solid, as a mattress in its frame, is entered first.
    """
    points, left = points.copy(), np.zeros(len(points), dtype=np.int64)
    rows = np.arange(len(points))
    for _ in range(MOST_CROSSINGS):
        hits = caster.intersect(points[rows], directions[rows])
        met = np.flatnonzero(hits.triangle != NO_HIT)
        rows = rows[met]
        left[rows] += np.where(hits.front[met], -1, 1)
        points[rows] += (hits.distance[met, None] + caster.surface_offset) * directions[rows]
        rows = rows[left[rows] <= 0]
        if len(rows) == 0:
            break
    return np.asarray(left > 0)


def _covers(
    scene: Surfaces, pairs: CoincidentPairs, tolerance: Array, emits: Array, contact: Array
) -> Covers:
    """Return the covered parts and their covers."""
    first, second = pairs.first, pairs.second
    if len(pairs) == 0:
        return _no_covers()
    level, turned = _heights(scene, pairs, tolerance)
    flat = np.abs(pairs.height) <= ONE_PLANE * np.maximum(tolerance[first], tolerance[second])
    found: list[Covers] = []
    for backs in (False, True):
        # Of the first triangle its front, or its back; of the second what faces the same way.
        one_is_back = np.full(len(pairs), backs)
        other_is_back = one_is_back ^ ~pairs.same
        exists = (~one_is_back | scene.two_sided[first]) & (~other_is_back | scene.two_sided[second])
        # Heights are along a direction of the group: seen from the other side they count the other way.
        sign = np.where(one_is_back ^ turned[first], -1, 1)
        apart = sign * (level[first] - level[second])
        listed = np.where(one_is_back == other_is_back, first < second, ~one_is_back)
        wins = np.where(apart != 0, apart > 0, listed)
        wins = np.where(flat & (emits[first] != emits[second]), emits[first], wins)
        wins = np.where(contact, one_is_back, wins)
        rows = np.flatnonzero(exists)
        one, other = 2 * first[rows] + one_is_back[rows], 2 * second[rows] + other_is_back[rows]
        won = wins[rows]
        in_first, in_second = pairs.in_first[rows], pairs.in_second[rows]
        # The same corner by corner, in either orientation of the cover.
        turn = ~pairs.same[rows, None, None]
        which = won[:, None, None]
        found.append(
            Covers(
                np.where(won, other, one),
                np.where(won, one, other),
                np.where(which, in_second, in_first),
                np.where(
                    which,
                    np.where(turn, in_first[:, ::-1], in_first),
                    np.where(turn, in_second[:, ::-1], in_second),
                ),
            )
        )
    return _sorted(found)


def _sorted(covers: Sequence[Covers]) -> Covers:
    """Return all of several, sorted by side."""
    joined = Covers(*(np.concatenate([getattr(part, name) for part in covers]) for name in _NAMES))
    return joined.take(np.argsort(joined.side, kind="stable"))


def _no_covers() -> Covers:
    none = np.zeros(0, dtype=np.int64)
    return Covers(none, none, *np.zeros((2, 0, CORNERS, 2)))


def _many_copies(scene: Surfaces, solid: Array, emits: Array) -> tuple[Array, Array]:
    """Find opaque triangles of which there are many exact copies that face the same way.

    Pairs of a thousand copies would be a million: all are covered by the one that counts.

    Returns copy, original (c,) int.
    """
    none = np.zeros(0, dtype=np.int64)
    opaque = solid if scene.images is None else solid[~scene.images.cut_out[solid]]
    bits = np.ascontiguousarray(scene.triangles[opaque] + 0.0).view(np.uint64)
    # A number for each triangle that does not depend on its first corner.
    mixed = bits * _ODD
    number = (mixed[..., 0] ^ (mixed[..., 1] >> np.uint64(7)) ^ (mixed[..., 2] >> np.uint64(13))).sum(axis=1)
    _, group, count = np.unique(number, return_inverse=True, return_counts=True)
    rows = opaque[count[group.reshape(-1)] > MANY_COPIES]
    if len(rows) == 0:
        return none, none
    corners = scene.triangles[rows] + 0.0
    first = np.lexsort(corners.transpose(2, 0, 1), axis=1)[:, 0]
    turned = np.take_along_axis(corners, ((first[:, None] + np.arange(3)) % 3)[..., None], axis=1)
    kind = np.concatenate([turned.reshape(-1, 9), scene.two_sided[rows, None]], axis=1)
    order = np.lexsort((rows, ~emits[rows]))
    rows = rows[order]
    _, first_row, group, count = np.unique(
        kind[order], axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    group = group.reshape(-1)
    original = rows[first_row][group]
    chosen = (count[group] > MANY_COPIES) & (rows != original)
    return rows[chosen], original[chosen]


def _whole_covers(scene: Surfaces, copy: Array, original: Array) -> Covers:
    """Return covers of whole triangles, both sides of those that have two."""
    backs = np.flatnonzero(scene.two_sided[copy])
    side = np.concatenate([2 * copy, 2 * copy[backs] + 1])
    by = np.concatenate([2 * original, 2 * original[backs] + 1])
    whole = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])[[0, 1, 2, 2, 2, 2, 2, 2]]
    parts = np.broadcast_to(whole, (len(side), CORNERS, 2))
    return Covers(side, by, parts, parts)


_ODD = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)


_NAMES = ("side", "by", "part", "in_cover")


def _heights(scene: Surfaces, pairs: CoincidentPairs, tolerance: Array) -> tuple[Array, Array]:
    """Return (t,) how high triangles lie among those they coincide with, and whether they look down.

    Along the normal of the largest of each group, in small steps: an order without circles.
    """
    count = len(scene)
    group = connected_components(count, pairs.first, pairs.second)
    order = np.lexsort((np.arange(count), -scene.areas, group))
    _, start, number = np.unique(group[order], return_index=True, return_inverse=True)
    reference = np.empty(count, dtype=np.int64)
    reference[order] = order[start][number.reshape(-1)]
    normal = scene.face_normals[reference]
    apart = scene.triangles.mean(axis=1) - scene.triangles[reference].mean(axis=1)
    height = np.einsum("nk,nk->n", apart, normal)
    turned = np.einsum("nk,nk->n", scene.face_normals, normal) < 0
    return np.rint(height / (FINE * tolerance[reference])), turned
