"""Lightmap coordinates of a coarser level of detail: those of the nearest surface of the finest one.

A polygon is put into one chart, and its corners to the closest points of this chart: so it shows no other
chart, and no corner is outside.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array, TriangleTree, connected_faces, double_area_vectors, numbered

TURNED = 0.05
"""Of the object's size: a surface at right angles seems as much farther. Thin things have two sides."""


def uvs_of_level(triangles: Array, polygon: Array, base: Array, base_uv: Array) -> Array:
    """Return the lightmap coordinates of a level's corners.

    triangles (t, 3, 3): Of the level, where the finest one is.
    polygon (t,): Which of the level's polygons each belongs to.
    base (b, 3, 3), base_uv (b, 3, 2): Triangles of the finest level, and their lightmap coordinates; b > 0.
    Returns uv (t, 3, 2) float32: Corners at one place of one polygon have equal coordinates.
    """
    uv = np.zeros((len(triangles), 3, 2), dtype=np.float32)
    chart = charts(base, base_uv)
    wanted = chart[_nearest_to_polygons(triangles, polygon, base)]
    rows = np.argsort(wanted, kind="stable")
    first = np.flatnonzero(np.diff(wanted[rows], prepend=-1))
    members = np.argsort(chart, kind="stable")
    starts = np.searchsorted(chart[members], np.arange(chart.max() + 2))
    for of in np.split(rows, first[1:]):
        number = wanted[of[0]]
        inside = members[starts[number] : starts[number + 1]]
        nearest, weights, _ = TriangleTree(base[inside]).nearest(triangles[of].reshape(-1, 3))
        uv[of] = np.einsum("pc,pck->pk", weights, base_uv[inside][nearest]).reshape(-1, 3, 2)
    return uv


def charts(triangles: Array, uv: Array) -> Array:
    """Return (t,) the chart of each triangle: joined where corners have one place, here and in the image."""
    corners = np.concatenate([triangles.reshape(-1, 3), uv.reshape(-1, 2)], axis=1)
    return connected_faces(numbered(corners).reshape(-1, 3))


def _nearest_to_polygons(triangles: Array, polygon: Array, base: Array) -> Array:
    """Return (t,) the triangle of `base` that is nearest to the middle of each triangle's polygon."""
    number = numbered(polygon)
    vectors = double_area_vectors(triangles)
    area = np.maximum(np.linalg.norm(vectors, axis=1), 1e-30)
    total = np.bincount(number, weights=area)
    middle, normal = (
        np.stack([np.bincount(number, weights=values[:, axis]) for axis in range(3)], axis=1)
        for values in (area[:, None] * triangles.mean(axis=1), vectors)
    )
    middle = middle / total[:, None]
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    size = float(np.linalg.norm(np.ptp(base.reshape(-1, 3), axis=0)))
    nearest, _, _ = TriangleTree(base).nearest(middle, normal, TURNED * size)
    found: Array = nearest[number]
    return found
