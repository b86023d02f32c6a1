"""Laying polygons and charts flat, to scale: 1 UV unit is 1 m."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...numerics import double_area_vectors, signed_double_areas

Float = NDArray[np.float64]
Int = NDArray[np.int64]

_UNEVEN = 0.02
"""A polygon with normals farther (chord length) from its own than this may overlap itself."""

_UPRIGHT = 0.02
"""A triangle that keeps less of its area than this in its polygon's plane counts as folded."""


def project_polygons(triangles: Float, group: Int) -> Float:
    """Project each polygon along its Newell normal; a folded one is laid out convex instead.

    triangles (n, 3, 3): The polygons' triangles [m].
    group (n,) int64: Which polygon each triangle belongs to, 0 … n_groups − 1.
    Returns (n, 3, 2): [m], counter-clockwise seen from the front. Corners of a polygon that share a position
        share a UV. The plane of a non-planar polygon shortens what is steep in it: see `rescale_to_area`.
    """
    cross = double_area_vectors(triangles)
    count = int(group.max()) + 1 if len(group) else 0
    normal = np.zeros((count, 3))
    np.add.at(normal, group, cross)
    uv = project(triangles, normal[group])
    # Measured against the polygon, so that the rounding of a sliver is not taken for a fold.
    size = np.bincount(group, np.linalg.norm(cross, axis=1), count)[group]
    folded = signed_double_areas(uv) < _UPRIGHT * np.linalg.norm(cross, axis=1) - 1e-9 * size
    unit = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), np.finfo(float).tiny)
    axis = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    uneven = np.zeros(count, dtype=np.bool_)
    uneven[group[np.linalg.norm(unit - axis[group], axis=1) > _UNEVEN]] = True
    suspects = np.flatnonzero(uneven[group])
    overlapping = suspects[_overlapping(uv[suspects], group[suspects])]
    for polygon in np.union1d(group[folded], group[overlapping]):
        rows = np.flatnonzero(group == polygon)
        layout = _convex_layout(triangles[rows])
        if layout is not None:
            uv[rows] = layout
    return uv


def project(triangles: Float, normal: Float) -> Float:
    """Project (n, 3, 3) triangles to the planes at right angles to (n, 3) normals: (n, 3, 2)."""
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    unit = np.where(length > 0, normal / np.where(length > 0, length, 1.0), (0.0, 0.0, 1.0))
    # The tangent comes from the axis the normal is least along.
    helper = np.eye(3)[np.abs(unit).argmin(axis=1)]
    tangent = np.cross(helper, unit)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    basis = np.stack((tangent, np.cross(unit, tangent)), axis=-1)
    return np.asarray(triangles @ basis)


def rescale_to_area(uv: Float, triangles: Float, chart: Int, count: int) -> Float:
    """Scale each chart, the same in all directions, to the area it has in the scene."""
    flat = np.bincount(chart, np.abs(signed_double_areas(uv)), count)
    true = np.bincount(chart, np.linalg.norm(double_area_vectors(triangles), axis=1), count)
    scale = np.sqrt(true / np.where(flat > 0, flat, 1.0))
    return np.asarray(uv * np.where(flat > 0, scale, 1.0)[chart, None, None])


def undo_stretch(uv: Float, triangles: Float, chart: Int, count: int) -> Float:
    """Scale each chart along u and along v so that it is as isometric as that can make it.

    The factors are the root mean squares, weighted by area, of how far the surface moves for a
    step in u and in v: |∂p/∂u| and |∂p/∂v|.
    """
    edge_1, edge_2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    flat_1, flat_2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = signed_double_areas(uv)
    weight = np.linalg.norm(np.cross(edge_1, edge_2), axis=1)
    mean = np.bincount(chart, np.abs(area), count) / np.maximum(np.bincount(chart, minlength=count), 1)
    usable = np.abs(area) > 1e-3 * mean[chart]
    inverse = np.where(usable, weight, 0.0) / np.where(usable, area, 1.0) ** 2
    along_u = ((edge_1 * flat_2[:, 1:] - edge_2 * flat_1[:, 1:]) ** 2).sum(axis=1) * inverse
    along_v = ((edge_2 * flat_1[:, :1] - edge_1 * flat_2[:, :1]) ** 2).sum(axis=1) * inverse
    total = np.bincount(chart, np.where(usable, weight, 0.0), count)
    sums = np.stack([np.bincount(chart, part, count) for part in (along_u, along_v)], axis=-1)
    scale = np.sqrt(sums / np.where(total > 0, total, 1.0)[:, None])
    return np.asarray(uv * np.where(scale > 0, scale, 1.0)[chart, None, :])


def _overlapping(uv: Float, group: Int) -> NDArray[np.intp]:
    """Return triangles that lie over another one of their group, by separating sides.

    Triangles are positively oriented; those that only touch do not count.
    """
    order = np.argsort(group, kind="stable")
    found = []
    step = 1
    while len(pairs := np.flatnonzero(group[order[:-step]] == group[order[step:]])):
        one, other = order[pairs], order[pairs + step]
        apart = _separated(uv[one], uv[other]) | _separated(uv[other], uv[one])
        found.append(one[~apart])
        step += 1
    return np.concatenate(found) if found else np.zeros(0, dtype=np.intp)


def _separated(one: Float, other: Float) -> NDArray[np.bool_]:
    """Return whether a side of `one` (p, 3, 2) has all of `other` (p, 3, 2) on its outer side."""
    side = np.roll(one, -1, axis=1) - one
    offset = other[:, None] - one[:, :, None]
    inward = side[:, :, None, 0] * offset[..., 1] - side[:, :, None, 1] * offset[..., 0]
    tolerance = 1e-9 * (side**2).sum(axis=(1, 2))
    return np.asarray((inward <= tolerance[:, None, None]).all(axis=2).any(axis=1))


def _convex_layout(triangles: Float) -> Float | None:
    """Lay one triangulated polygon out on a circle, its corners spaced as its sides are long.

    Every triangulation of a convex polygon is free of overlaps, however the polygon is folded
    in space. None if the triangles' outline is not one closed line through every corner.
    """
    corners, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    sides = {(int(a), int(b)) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True)}
    following = {a: b for a, b in sides if (b, a) not in sides}
    outline = [int(faces[0, 0])]
    while len(outline) < len(corners):
        outline.append(following.get(outline[-1], outline[0]))
        if outline[-1] in outline[:-1]:
            return None
    if following.get(outline[-1]) != outline[0]:
        return None
    ring = corners[outline]
    length = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
    length = np.maximum(length, 1e-3 * length.sum() / len(ring))
    angle = 2 * np.pi * (np.cumsum(length) - length) / length.sum()
    radius = length.sum() / (2 * np.pi)
    place = np.empty((len(corners), 2))
    place[outline] = radius * np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    return np.asarray(place[faces])
