"""Light that points receive from elements: point-to-polygon factors times visibility by rays.

The row of a collocation matrix (handout §3.2.1): from one point to every element, whole or
shared out over the element's three corners.
"""

from __future__ import annotations

import numpy as np

from ...form_factors import MIN_SHARE, kernel, point_to_polygon
from ...numerics import Array, point_on_each_triangle, split_in_four, stratified_square
from ...rays import RayCaster

NEAR_SPLITS = ((1.21, 4), (2.07, 2), (4.13, 1))
"""(Distance over radius, generations): a nearer triangle is split this often before each part is
shared out among the corners. Odd numbers: on a regular grid rounding must not decide between two."""

CHUNK_PARTS = 1 << 17
"""Parts processed together; their arrays take some 50 MB."""

_CUBATURE = np.array([[2.0, 0.5, 0.5], [0.5, 2.0, 0.5], [0.5, 0.5, 2.0]]) / 3.0
"""Points of a triangle whose mean is exact to degree 2."""


def visible_share(
    caster: RayCaster,
    points: Array,
    normals: Array,
    corners: Array,
    source_normals: Array,
    keys: Array,
    seed: int,
) -> Array:
    """Return (n,) V: the share of the light from triangles to points that nothing blocks.

    A ray from each quarter of the triangle; where the four disagree, sixteen. 1 where no ray
    carries light.

    points, normals (n, 3).
    corners (n, 3, 3).
    source_normals (n, 3).
    keys (n,) int: With the seed, they place each pair's samples.
    """
    lit, total = np.zeros(len(points)), np.zeros(len(points))
    rows, first = np.arange(len(points)), 0
    for count in (4, 12):
        # Column k lies in quarter k mod 4.
        quarters = np.tile(split_in_four(corners[rows]), (1, count // 4, 1, 1))
        unit = stratified_square(keys[rows], count, seed, first)
        ends = point_on_each_triangle(quarters, unit)
        facing, back = normals[rows, None], source_normals[rows, None]
        weight = kernel(points[rows, None], facing, ends, back)
        pair, sample = np.nonzero(weight > 0)
        start = (points[rows] + caster.surface_offset * normals[rows])[pair]
        along = ends[pair, sample] + caster.surface_offset * source_normals[rows[pair]] - start
        distance = np.linalg.norm(along, axis=1)
        free = caster.passing(start, along / np.maximum(distance, 1e-300)[:, None], distance, MIN_SHARE)
        lit[rows] += np.bincount(pair, weight[pair, sample] * free, minlength=len(rows))
        total[rows] += weight.sum(axis=1)
        rows, first = np.flatnonzero((lit > 0) & (lit < total)), count
    return np.where(total > 0, lit / np.where(total > 0, total, 1.0), 1.0)


def corner_factors(points: Array, normals: Array, corners: Array, source_normals: Array) -> Array:
    """Return ∫ N_k κ dA of triangles' three hats N_k, unoccluded, as seen from points (3.13).

    The hats sum to 1, so these sum to the factor from the point to the triangle, exactly:
    only their distribution is by cubature, or by splitting where the triangle is near.

    points, normals (n, 3).
    corners (n, 3, 3).
    source_normals (n, 3).
    Returns factors (n, 3).
    """
    factors = np.empty((len(points), 3))
    center = corners.mean(axis=1)
    radius = np.linalg.norm(corners - center[:, None], axis=2).max(axis=1)
    ratio = np.linalg.norm(center - points, axis=1) / radius
    nearest = 0.0
    for farthest, generations in (*NEAR_SPLITS, (np.inf, 0)):
        rows = np.flatnonzero((ratio >= nearest) & (ratio < farthest))
        step = max(CHUNK_PARTS // 4**generations, 1)
        for start in range(0, len(rows), step):
            chunk = rows[start : start + step]
            factors[chunk] = _split_factors(
                points[chunk], normals[chunk], corners[chunk], source_normals[chunk], generations
            )
        nearest = farthest
    return factors


def _split_factors(
    points: Array, normals: Array, corners: Array, source_normals: Array, generations: int
) -> Array:
    """Return (n, 3) corner factors as sums over 4^generations parts of each triangle.

    A part's factor is exact; a few values of the kernel determine where on the part it comes from.
    """
    parts, weights = corners, np.eye(3)[None]
    for _ in range(generations):
        parts = split_in_four(parts.reshape(-1, 3, 3))
        weights = split_in_four(weights.reshape(-1, 3, 3))
    count = 4**generations
    parts, weights = parts.reshape(-1, 3, 3), _CUBATURE @ weights.reshape(-1, 3, 3)
    points, normals, source_normals = (np.repeat(a, count, axis=0) for a in (points, normals, source_normals))
    transfer = kernel(points[:, None], normals[:, None], _CUBATURE @ parts, source_normals[:, None])
    # Where all of these are below the horizon, they have equal weights.
    transfer += 1e-30
    transfer *= (point_to_polygon(points, normals, parts) / transfer.sum(axis=1))[:, None]
    return np.asarray(transfer.reshape(-1, 3 * count) @ weights.reshape(-1, 3))
