"""Convex polygons in the unit square: clipping, area and centroid, area-uniform points.

Polygons are padded by repeating their last corner, which changes neither area nor shape, so a
batch of them is one array.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...numerics import clip_half_plane, pick_in_rows

Float = NDArray[np.float64]


def clip_to_unit_square(triangles: Float) -> Float:
    """Clip (t, 3, 2) triangles to [0, 1]²; returns (t, 7, 2) counter-clockwise polygons.

    Sutherland & Hodgman, Reentrant polygon clipping (1974), over the four sides of the square.
    A triangle outside the square gives seven equal corners.
    """
    edge_1, edge_2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    clockwise = edge_1[:, 0] * edge_2[:, 1] < edge_1[:, 1] * edge_2[:, 0]
    polygon = np.where(clockwise[:, None, None], triangles[:, ::-1], triangles)
    for axis in (0, 1):
        polygon = clip_half_plane(polygon, polygon[..., axis])
        polygon = clip_half_plane(polygon, 1.0 - polygon[..., axis])
    return polygon


def area_in_unit_square(triangles: Float) -> Float:
    """Return (t,) the exact areas of (t, 3, 2) triangles within [0, 1]², without clipping them.

    By Green, the area under the outline, ∮ clamp(y) dx over the part of it with x in [0, 1]: below the
    square an edge counts 0, next to it half the sum of its heights, above it 1.
    """
    total = np.zeros(len(triangles))
    x, y = np.ascontiguousarray(triangles.transpose(2, 1, 0))
    for start in range(3):
        end = (start + 1) % 3
        run, rise = x[end] - x[start], y[end] - y[start]
        begin, stop = np.clip(x[start], 0.0, 1.0), np.clip(x[end], 0.0, 1.0)
        slope = rise / np.where(run == 0.0, 1.0, run)
        low, high = y[start] + (begin - x[start]) * slope, y[start] + (stop - x[start]) * slope
        height = high - low
        low_in, high_in = np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0)
        flat = height == 0.0
        per_height = 1.0 / np.where(flat, 1.0, height)
        level = np.where(flat, (low >= 0.0) & (low <= 1.0), (high_in - low_in) * per_height)
        above = np.where(flat, low > 1.0, (np.maximum(high, 1.0) - np.maximum(low, 1.0)) * per_height)
        total += (stop - begin) * (level * 0.5 * (low_in + high_in) + above)
    return np.abs(total)


def polygon_area_centroid(polygon: Float) -> tuple[Float, Float]:
    """Return areas (t,) and centroids (t, 2) of (t, k, 2) convex counter-clockwise polygons.

    A polygon without area has the mean of its corners as its centroid.
    """
    offset = polygon[:, 1:] - polygon[:, :1]
    cross = offset[:, :-1, 0] * offset[:, 1:, 1] - offset[:, :-1, 1] * offset[:, 1:, 0]
    cross = np.maximum(cross, 0)
    double_area = cross.sum(axis=1)
    moment = (cross[..., None] * (offset[:, :-1] + offset[:, 1:])).sum(axis=1) / 3
    flat = double_area <= 0
    mean = np.where(flat[:, None], offset.mean(axis=1), moment / np.where(flat, 1.0, double_area)[:, None])
    return 0.5 * double_area, polygon[:, 0] + mean


def sample_polygons(polygon: Float, u: Float) -> Float:
    """Map (t, k, 2) points of the unit square to area-uniform points of (t, c, 2) polygons.

    The first coordinate picks a triangle of the fan around corner 0 by cumulative area and is
    then stretched over it; the triangle is filled by the root map of Turk (Graphics Gems, 1990).
    """
    offset = polygon[:, 1:] - polygon[:, :1]
    cross = offset[:, :-1, 0] * offset[:, 1:, 1] - offset[:, :-1, 1] * offset[:, 1:, 0]
    area = np.maximum(cross, 0)
    part, along = pick_in_rows(area, u[..., 0])
    root = np.sqrt(u[..., 1])[..., None]
    second = np.take_along_axis(offset, part[..., None], axis=1)
    third = np.take_along_axis(offset, part[..., None] + 1, axis=1)
    share = along[..., None]
    return np.asarray(polygon[:, :1] + root * ((1 - share) * second + share * third))
