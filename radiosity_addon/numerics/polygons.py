"""Clipping convex polygons by half-planes, a batch at a time.

Polygons are padded by repeating their last corner, which changes neither area nor shape, so a
batch of them is one array. Corners may carry more than two coordinates: all are interpolated.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array


def clip_half_plane(polygon: Array, distance: Array) -> Array:
    """Keep the part of (t, k, d) convex polygons where `distance` (t, k) ≥ 0: (t, k + 1, d).

    Sutherland & Hodgman, Reentrant polygon clipping (1974). What lies outside gives equal corners at 0.
    """
    count, size = distance.shape
    inside = distance >= 0
    result = np.empty((count, size + 1, polygon.shape[2]))
    result[:, :-1] = polygon
    result[:, -1] = polygon[:, -1]
    # Most polygons are on one side: only the others have to be cut.
    result[~inside.any(axis=1)] = 0.0
    cut = np.flatnonzero(inside.any(axis=1) & ~inside.all(axis=1))
    if len(cut):
        result[cut] = _cut_half_plane(polygon.take(cut, axis=0), distance.take(cut, axis=0))
    return result


def _cut_half_plane(polygon: Array, distance: Array) -> Array:
    """Do the same for polygons that lie on both sides."""
    count, size = distance.shape
    width = polygon.shape[2]
    bent = np.count_nonzero(np.diff(distance >= 0, axis=1, append=distance[:, :1] >= 0), axis=1) > 2
    if bent.any():
        distance = distance.copy()
        distance[bent] = _outside_once(distance[bent])
    inside = distance >= 0
    following = np.concatenate([polygon[:, 1:], polygon[:, :1]], axis=1)
    next_distance = np.concatenate([distance[:, 1:], distance[:, :1]], axis=1)
    crosses = inside != (next_distance >= 0)
    share = distance / np.where(crosses, distance - next_distance, 1.0)
    # Each side gives its start, if kept, and then its crossing, if any; close the gaps.
    corners = np.empty((count, size, 2, width))
    corners[:, :, 0] = polygon
    corners[:, :, 1] = polygon + share[..., None] * (following - polygon)
    given = np.stack((inside, crosses), axis=-1).reshape(count, 2 * size)
    place = np.cumsum(given, axis=1) - 1
    kept = np.flatnonzero(given)
    result = np.zeros((count * (size + 1), width))
    target = place.ravel().take(kept) + (size + 1) * (kept // (2 * size))
    result[target] = corners.reshape(-1, width).take(kept, axis=0)
    last = np.minimum(np.arange(size + 1), place[:, -1:]) + (size + 1) * np.arange(count)[:, None]
    return np.asarray(result.take(last, axis=0))


def _outside_once(distance: Array) -> Array:
    """Return (t, k) distances that are negative along one run of corners, the one with the smallest.

    A line meets the outline of a convex polygon twice; where corners lie on it, except for rounding, it
    seems to meet it more often.
    """
    size = distance.shape[1]
    turned = (np.argmin(distance, axis=1)[:, None] + np.arange(size)) % size
    values = np.take_along_axis(distance, turned, axis=1)
    outside = values < 0
    run = np.cumprod(outside, axis=1) | np.cumprod(outside[:, ::-1], axis=1)[:, ::-1]
    result = np.empty_like(distance)
    np.put_along_axis(result, turned, np.where(run, values, np.maximum(values, 0.0)), axis=1)
    return result


def areas(polygon: Array) -> Array:
    """Return (t,) the areas of (t, k, 2) convex counter-clockwise polygons."""
    apart = polygon[:, 1:] - polygon[:, :1]
    cross = apart[:, :-1, 0] * apart[:, 1:, 1] - apart[:, :-1, 1] * apart[:, 1:, 0]
    return np.asarray(0.5 * np.maximum(cross, 0.0).sum(axis=1))


def edge_distances(points: Array, polygon: Array, edge: int) -> Array:
    """Return (t, p) cross products that are ≥ 0 where points (t, p, 2) lie left of an edge of (t, k, 2)."""
    start, end = polygon[:, edge], polygon[:, (edge + 1) % polygon.shape[1]]
    along = end - start
    across = points[..., 1] - start[:, 1:]
    across *= along[:, :1]
    aside = points[..., 0] - start[:, :1]
    aside *= along[:, 1:]
    across -= aside
    return np.asarray(across)
