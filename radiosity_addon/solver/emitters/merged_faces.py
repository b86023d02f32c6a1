"""Faces of one plane merged: a panel of ten thousand triangles is a lamp of two.

The light of emissive faces at a point is evaluated exactly, face by face. Where the faces tile a flat
polygon, a few triangles that tile it send the same light. Faces are joined across shared edges; the
outline of the result, without the corners on its sides, is cut into triangles by their ears (Meisters,
Polygons have ears, 1975). Faces whose outline is not one simple polygon stay as they were.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...numerics import Array, connected_components, double_area_vectors, numbered, weld

PLANE_TOLERANCE = 1e-6
"""Faces lie in one plane if their normals agree to this, and their corners to this part of their extent."""

WELD = 1e-9
"""Corners are one if they are no farther apart than this part of the extent."""

SAME_AREA = 1e-7
"""A triangulation must have the area of what it replaces, to this part."""

_ASIDE = np.array([0.358, 0.471, 0.806])
"""Separates faces turned along it from those turned against it: hardly any surface is parallel to it."""

MOST_CORNERS = 64
"""Outlines of more corners are left: the ears of k corners take k² steps."""


def merge_flat(corners: Array) -> tuple[Array, Array]:
    """Replace triangles that tile a flat polygon by as few as it takes.

    corners (m, 3, 3): Triangles with an area.
    Returns corners (k, 3, 3): Of the same surface, with the same sides in front; k ≤ m.
    Returns first (k,) int: A triangle of those given that each lies in the plane of.
    """
    everything = np.arange(len(corners))
    if len(corners) < 3:
        return corners, everything
    twice = double_area_vectors(corners)
    area = 0.5 * np.linalg.norm(twice, axis=1)
    normal = twice / (2.0 * area[:, None])
    points = corners.reshape(-1, 3)
    # A surface's two sides share no corners.
    place = numbered(np.stack([weld(points, WELD), np.repeat(normal @ _ASIDE > 0, 3)], axis=1))
    points, index = points[np.unique(place, return_index=True)[1]], place.reshape(-1, 3)
    start, end, twin = _edges(index, len(points))
    one, other = np.flatnonzero(twin >= 0) // 3, twin[twin >= 0] // 3
    alike = (np.abs(normal[one] - normal[other]) <= PLANE_TOLERANCE).all(axis=1)
    label = connected_components(len(corners), one[alike], other[alike])
    inner = twin >= 0
    inner[inner] = label[one] == label[other]
    size = np.bincount(label, minlength=len(corners))
    kept, parts, firsts = size[label] < 3, [], []
    order = np.argsort(label, kind="stable")
    ends = np.cumsum(size)
    for name in np.flatnonzero(size >= 3):
        faces = order[ends[name] - size[name] : ends[name]]
        rim = (3 * faces[:, None] + np.arange(3)).ravel()
        rim = rim[~inner[rim]]
        frame = normal[faces[0]]
        flat = (np.abs(normal[faces] - frame) <= 2.0 * PLANE_TOLERANCE).all() and _in_plane(
            corners[faces], frame
        )
        loop = _outline(start[rim], end[rim]) if flat else None
        fewer = None
        if loop is not None:
            fewer = _triangulated(points[loop], frame, area[faces].sum(), len(faces))
        if fewer is None:
            kept[faces] = True
        else:
            parts.append(fewer)
            firsts.append(np.full(len(fewer), faces[0]))
    if not parts:
        return corners, everything
    return np.concatenate([corners[kept], *parts]), np.concatenate([everything[kept], *firsts])


def _edges(index: Array, points: int) -> tuple[Array, Array, Array]:
    """Return starts, ends and twins of the (3 m,) directed edges of (m, 3) triangles.

    A twin runs the other way; −1 where there is none, or where several edges run alike.
    """
    start, end = index.ravel(), index[:, [1, 2, 0]].ravel()
    forth, back = start.astype(np.int64) * points + end, end.astype(np.int64) * points + start
    keys, first, count = np.unique(forth, return_index=True, return_counts=True)
    found = np.minimum(np.searchsorted(keys, back), len(keys) - 1)
    own = count[np.searchsorted(keys, forth)]
    single = (keys[found] == back) & (count[found] == 1) & (own == 1)
    return start, end, np.where(single, first[found], -1)


def _in_plane(corners: Array, normal: Array) -> bool:
    """Return whether (f, 3, 3) triangles lie in one plane."""
    points = corners.reshape(-1, 3)
    height = (points - points[0]) @ normal
    return bool(np.ptp(height) <= PLANE_TOLERANCE * np.ptp(points, axis=0).max())


def _outline(start: Array, end: Array) -> Array | None:
    """Return the corners of directed edges that form one loop through each of them once, else None."""
    if len(np.unique(start)) < len(start):
        return None
    following = dict(zip(start.tolist(), end.tolist(), strict=True))
    corner = first = int(start[0])
    loop = []
    for _ in range(len(start)):
        loop.append(corner)
        if corner not in following:
            return None
        corner = following[corner]
        if corner == first:
            break
    return np.array(loop) if len(loop) == len(start) and corner == first else None


def _triangulated(loop: Array, normal: Array, area: float, most: int) -> Array | None:
    """Return (k, 3, 3) triangles of a simple outline (n, 3), fewer than `most`; None if it is no such."""
    axis = int(np.abs(normal).argmax())
    flat = loop[:, [(axis + 1) % 3, (axis + 2) % 3]] * (np.sign(normal[axis]), 1.0)
    scale = np.ptp(flat, axis=0).max()
    along = flat - np.roll(flat, 1, axis=0)
    turn = _cross(along, np.roll(along, -1, axis=0))
    # What bends no more than rounding does is on a side. Corners that turn back are not.
    straight = np.abs(turn) <= PLANE_TOLERANCE * PLANE_TOLERANCE * scale * scale
    straight &= np.einsum("nk,nk->n", along, np.roll(along, -1, axis=0)) > 0
    loop, flat = loop[~straight], flat[~straight]
    if not 3 <= len(loop) <= MOST_CORNERS or len(loop) - 2 >= most:
        return None
    ears = list(_ears(flat))
    if len(ears) < len(loop) - 2:
        return None
    found = loop[np.array(ears)]
    twice = double_area_vectors(found)
    if not (twice @ normal > 0).all() or abs(0.5 * (twice @ normal).sum() - area) > SAME_AREA * area:
        return None
    return np.asarray(found)


def _ears(flat: Array) -> Iterator[tuple[int, int, int]]:
    """Yield the n − 2 triangles of a simple counter-clockwise outline (n, 2); fewer if it is no such."""
    left = list(range(len(flat)))
    at, tried = 1, 0
    while len(left) > 2 and tried < len(left):
        at %= len(left)
        before, here, after = left[at - 1], left[at], left[(at + 1) % len(left)]
        triangle = flat[[before, here, after]]
        others = flat[[corner for corner in left if corner not in (before, here, after)]]
        sides = [_cross(triangle[k] - triangle[k - 1], others - triangle[k - 1]) for k in range(3)]
        inside = (np.array(sides) >= 0).all(axis=0).any()
        if _cross(triangle[1] - triangle[0], triangle[2] - triangle[1]) > 0 and not inside:
            yield before, here, after
            del left[at]
            tried = 0
        else:
            tried += 1
        at += 1


def _cross(one: Array, other: Array) -> Array:
    """Return the (…,) cross products of plane vectors (…, 2)."""
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])
