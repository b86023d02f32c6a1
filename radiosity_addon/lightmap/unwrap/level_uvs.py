"""Lightmap coordinates of a coarser level of detail: those of the nearest surface of the finest one.

A polygon is put into one chart, and its corners to the closest points of this chart: so it shows no other
chart, and no corner is outside.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array, TriangleTree, connected_faces, double_area_vectors, numbered
from ...rays import EmbreeCaster

TURNED = 0.05
"""Of the object's size: a surface at right angles seems as much farther, for thin things have two sides; and
surfaces are looked for as far in front of a level and behind it."""

_SAMPLES = np.array(
    [
        *([1 / 3] * 3, [0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]),
        *([0.45, 0.45, 0.1], [0.45, 0.1, 0.45], [0.1, 0.45, 0.45]),
    ]
)
"""Where it is looked which chart a triangle is nearest to: weights of its corners."""


def uvs_of_level(triangles: Array, polygon: Array, base: Array, base_uv: Array) -> Array:
    """Return the lightmap coordinates of a level's corners.

    triangles (t, 3, 3): Of the level, where the finest one is.
    polygon (t,): Which of the level's polygons each belongs to.
    base (b, 3, 3), base_uv (b, 3, 2): Triangles of the finest level, and their lightmap coordinates; b > 0.
    Returns uv (t, 3, 2) float32: Corners at one place of one polygon have equal coordinates.
    """
    uv = np.zeros((len(triangles), 3, 2), dtype=np.float32)
    chart = charts(base, base_uv)
    wanted = _chart_of_polygons(triangles, polygon, base, chart)
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


def _chart_of_polygons(triangles: Array, polygon: Array, base: Array, chart: Array) -> Array:
    """Return (t,) the chart that most of each triangle's polygon is nearest to."""
    number = numbered(polygon)
    vectors = double_area_vectors(triangles)
    normal = np.stack([np.bincount(number, weights=vectors[:, axis]) for axis in range(3)], axis=1)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    points = np.einsum("sc,tck->tsk", _SAMPLES, triangles).reshape(-1, 3)
    of = np.repeat(number, len(_SAMPLES))
    size = float(np.linalg.norm(np.ptp(base.reshape(-1, 3), axis=0)))
    nearest, _, distance = TriangleTree(base).nearest(points, normal[of], TURNED * size)
    # Within a head are surfaces that nobody sees, and that may be nearer: the outermost one counts.
    reach = max(TURNED * size, 1e-30)
    hits = EmbreeCaster(base, threads=1).intersect(points + reach * normal[of], -normal[of])
    seen = (hits.triangle >= 0) & hits.front & (hits.distance < 2.0 * reach)
    nearest = np.where(seen, hits.triangle, nearest)
    distance = np.where(seen, np.abs(hits.distance - reach), distance)
    area = np.repeat(np.maximum(np.linalg.norm(vectors, axis=1), 1e-30), len(_SAMPLES))
    pair, row = np.unique(np.stack([of, chart[nearest]], axis=1), axis=0, return_inverse=True)
    votes = np.bincount(row.reshape(-1), weights=area)
    away = np.bincount(row.reshape(-1), weights=area * distance) / votes
    order = np.lexsort((away, -votes, pair[:, 0]))
    first = order[np.flatnonzero(np.diff(pair[order, 0], prepend=-1))]
    found: Array = pair[first, 1][number]
    return found
