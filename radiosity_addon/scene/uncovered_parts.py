"""Uncovered parts of sides: triangles in the weights of each side's corners."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics import (
    Array,
    areas,
    clip_half_plane,
    edge_distances,
    plane_weights_at,
    run_chunks,
    run_numbers,
    split_in_four,
)
from .surfaces import Surfaces

NOTHING_LEFT = 1e-9
"""Parts of a side smaller than this share of it are dropped."""

EVEN_OPACITY = 0.05
"""A cover whose opacity varies less over a part hides its mean, …"""

MAX_DIVISIONS = 5
"""… otherwise the part is split in four, at most this many times."""

CHUNK_PAIRS = 1 << 17
"""Elements and parts clipped at once; their temporaries take about 50 MB."""

_SPOTS = np.sort((np.arange(1, 17)[:, None] * (0.7548776662466927, 0.5698402909980532)) % 1.0, axis=1)
_SPOTS[:, 1] -= _SPOTS[:, 0]
"""(16, 2) weights of points spread over a triangle."""

_WHOLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


@dataclass(frozen=True)
class OwnParts:
    """The m uncovered parts of s sides.

    sides (s,) int: The partly covered sides, sorted; front 2 t and back 2 t + 1 of triangle t.
    side (m,) int: Whose part it is, sorted.
    corners (m, 3, 2): In weights of the triangle's second and third corner, counter-clockwise.
    level (m,): The share visible through covers with cut-outs; else 1.
    """

    sides: Array
    side: Array
    corners: Array
    level: Array

    @cached_property
    def share(self) -> Array:
        """(s,) float64: the uncovered share of each of `sides`."""
        left = 2.0 * areas(self.corners) * self.level
        return np.bincount(np.searchsorted(self.sides, self.side), left, minlength=len(self.sides))

    def share_of(self, side: Array) -> Array:
        """Return (n,) the uncovered share of sides; 1 if nothing covers them."""
        result = np.ones(len(side))
        place = np.minimum(np.searchsorted(self.sides, side), max(len(self.sides) - 1, 0))
        if len(self.sides):
            found = self.sides[place] == side
            result[found] = np.clip(self.share[place[found]], 0.0, 1.0)
        return result

    def parts_of(self, side: Array) -> tuple[Array, Array, Array]:
        """Return the parts of sides (n,): which row, (k,), the corners (k, 3, 2), and the level (k,).

        A side that nothing covers is one part.
        """
        begin, count = self._runs(side)
        whole = ~np.isin(side, self.sides)
        rows = np.repeat(np.arange(len(side)), np.where(whole, 1, count))
        part = run_numbers(np.where(whole, 1, count), begin)
        corners, level = np.empty((len(rows), 3, 2)), np.ones(len(rows))
        alone = whole[rows]
        corners[alone] = _WHOLE
        corners[~alone], level[~alone] = self.corners[part[~alone]], self.level[part[~alone]]
        return rows, corners, level

    def share_of_elements(self, side: Array, corners: Array) -> Array:
        """Return (n,) the uncovered share of counter-clockwise triangles (n, 3, 2) within sides (n,)."""
        result = np.ones(len(side))
        covered = np.flatnonzero(np.isin(side, self.sides))
        begin, count = self._runs(side[covered])
        result[covered] = 0.0
        for chunk in run_chunks(count, CHUNK_PAIRS):
            row = np.repeat(covered[chunk], count[chunk])
            part = run_numbers(count[chunk], begin[chunk])
            common = _clipped(self.corners[part], corners[row])
            result += np.bincount(row, areas(common) * self.level[part], minlength=len(side))
        result[covered] /= np.maximum(areas(corners[covered]), 1e-300)
        return np.clip(result, 0.0, 1.0)

    def _runs(self, side: Array) -> tuple[Array, Array]:
        begin = np.searchsorted(self.side, side, side="left")
        return begin, np.searchsorted(self.side, side, side="right") - begin


def own_parts(side: Array, part: Array, by: Array, in_cover: Array, scene: Surfaces) -> OwnParts:
    """Return the uncovered parts of sides.

    side (c,) int: What is covered; sorted.
    part (c, k, 2): Where: convex, counter-clockwise.
    by (c,) int: The side that covers it.
    in_cover (c, k, 2): Where on the cover's triangle, corner by corner the same.
    """
    sides, first, count = np.unique(side, return_index=True, return_counts=True)
    own = np.arange(len(sides))
    corners, level = np.broadcast_to(_WHOLE, (len(sides), 3, 2)).copy(), np.ones(len(sides))
    cut = np.zeros(len(scene), dtype=bool) if scene.images is None else scene.images.cut_out
    # A side's largest cover goes first: most often nothing is left then.
    order = np.lexsort((-areas(part), np.repeat(np.arange(len(sides)), count)))
    done: list[tuple[Array, Array, Array]] = []
    for number in range(int(count.max(initial=0))):
        # A floor may have thousands of covers, and most sides one.
        ready = count[own] <= number
        if ready.any():
            done.append((own[ready], corners[ready], level[ready]))
            own, corners, level = own[~ready], corners[~ready], level[~ready]
        cover = order[first[own] + number]
        # Most pieces of a large side are far from a small cover.
        covered = np.flatnonzero(_boxes_meet(corners, part[cover]))
        chosen = cover[covered]
        inner = _clipped(corners[covered], part[chosen])
        met = areas(inner) > NOTHING_LEFT
        covered, chosen, inner = covered[met], chosen[met], inner[met]
        left = np.ones(len(own), dtype=bool)
        left[covered] = False
        pieces = [(own[left], corners[left], level[left])]
        pieces += [
            (own[covered[row]], each, level[covered[row]])
            for row, each in _outside(corners[covered], part[chosen])
        ]
        seen_through = np.flatnonzero(cut[by[chosen] // 2])
        if len(seen_through):
            row, each = _fans(inner[seen_through])
            piece_row, piece_cover = covered[seen_through[row]], chosen[seen_through[row]]
            pieces.append(
                _shining_through(
                    own[piece_row], each, level[piece_row], piece_cover, part, in_cover, by, scene
                )
            )
        own, corners, level = (np.concatenate(values) for values in zip(*pieces, strict=True))
    own, corners, level = (
        np.concatenate(values) for values in zip(*done, (own, corners, level), strict=True)
    )
    kept = (level > NOTHING_LEFT) & (areas(corners) > NOTHING_LEFT)
    rows = np.flatnonzero(kept)
    rows = rows[np.argsort(own[rows], kind="stable")]
    return OwnParts(sides, sides[own[rows]], corners[rows], level[rows])


def _boxes_meet(triangles: Array, polygons: Array) -> Array:
    """Return (n,) whether the boxes around triangles (n, 3, 2) and polygons (n, k, 2) meet."""
    meet = np.ones(len(triangles), dtype=bool)
    for axis in range(2):
        one, other = triangles[..., axis].T, polygons[..., axis].T
        # Corner by corner: several times as fast as a reduction over a short axis.
        meet &= np.minimum.reduce(one) <= np.maximum.reduce(other)
        meet &= np.minimum.reduce(other) <= np.maximum.reduce(one)
    return meet


def _clipped(triangles: Array, polygons: Array) -> Array:
    """Return (n, …, 2) the intersections of triangles (n, 3, 2) and convex polygons (n, k, 2)."""
    result = triangles
    for edge in range(polygons.shape[1]):
        result = clip_half_plane(result, edge_distances(result, polygons, edge))
    return result


def _outside(triangles: Array, polygons: Array) -> list[tuple[Array, Array]]:
    """Return the parts of triangles (n, 3, 2) outside of convex polygons, as triangles with their rows."""
    found = []
    rest = triangles
    for edge in range(polygons.shape[1]):
        distance = edge_distances(rest, polygons, edge)
        # Polygons are padded: nothing is outside of an edge without length.
        is_edge = (polygons[:, edge] != polygons[:, (edge + 1) % polygons.shape[1]]).any(axis=1)
        found.append(_fans(clip_half_plane(rest, np.where(is_edge[:, None], -distance, -1.0))))
        rest = clip_half_plane(rest, distance)
    return found


def _fans(polygons: Array) -> tuple[Array, Array]:
    """Cut (n, k, 2) convex polygons into triangles with an area; return their rows and (m, 3, 2) corners."""
    size = polygons.shape[1]
    index = np.stack([np.zeros(size - 2, int), np.arange(1, size - 1), np.arange(2, size)], axis=1)
    corners = polygons[:, index].reshape(-1, 3, 2)
    row = np.repeat(np.arange(len(polygons)), size - 2)
    kept = areas(corners) > NOTHING_LEFT
    return row[kept], corners[kept]


def _shining_through(
    own: Array,
    corners: Array,
    level: Array,
    cover: Array,
    part: Array,
    in_cover: Array,
    by: Array,
    scene: Surfaces,
) -> tuple[Array, Array, Array]:
    """Return parts that lie under cut-out covers, split where the opacity varies, and their visible share."""
    assert scene.images is not None
    images = scene.images
    done = []
    for depth in range(MAX_DIVISIONS + 1):
        place = _moved(corners, part[cover], in_cover[cover])
        opacity = images.area_means(by[cover] // 2, place)[:, 6]
        spots = place[:, :1] + np.einsum("sw,nwk->nsk", _SPOTS, place[:, 1:] - place[:, :1])
        there = np.repeat(by[cover] // 2, len(_SPOTS))
        each = images.opacity_at(there, spots.reshape(-1, 2)).reshape(-1, len(_SPOTS))
        ready = (np.ptp(each, axis=1) < EVEN_OPACITY) | (depth == MAX_DIVISIONS)
        done.append((own[ready], corners[ready], level[ready] * (1.0 - opacity[ready])))
        open_ = ~ready
        if not open_.any():
            break
        own, cover, level = (np.repeat(values[open_], 4) for values in (own, cover, level))
        corners = split_in_four(corners[open_]).reshape(-1, 3, 2)
    all_own, all_corners, all_levels = (np.concatenate(values) for values in zip(*done, strict=True))
    return all_own, all_corners, all_levels


def _moved(points: Array, part: Array, in_cover: Array) -> Array:
    """Return points (n, p, 2), given along with polygons (n, k, 2), where the same polygons are elsewhere."""
    row = np.arange(len(part))
    # The map is affine: the three corners that span the most determine it.
    apart = part - part[:, :1]
    far = np.einsum("nkc,nkc->nk", apart, apart).argmax(axis=1)
    along = apart[row, far]
    wide = np.abs(along[:, None, 0] * apart[..., 1] - along[:, None, 1] * apart[..., 0]).argmax(axis=1)
    chosen = np.stack([np.zeros_like(far), far, wide], axis=1)
    weights = plane_weights_at(part[row[:, None], chosen], points)
    there = (in_cover - in_cover[:, :1])[row[:, None], chosen]
    return np.asarray(in_cover[:, :1] + weights @ there)
