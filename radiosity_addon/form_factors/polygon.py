"""Closed forms for the cosine-weighted share of a point's hemisphere that a polygon fills.

The form factor from an oriented point to a shape is its projected solid angle over π. By
Stokes it is an integral along the outline, F = 1/(2π) n · ∮ ω × dω (Lambert 1760; handout
(2.20), (3.27) with the receiver a point), and the part below the receiver's horizon is left
out exactly: outlines are cut at the horizon and closed along it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Float64Array = npt.NDArray[np.float64]

CHUNK_CORNERS = 1 << 16
"""Polygon corners worked on at a time: their temporaries take some 20 MB."""

IN_PLANE = 1e-11
"""A point closer to a polygon's plane than this times its farthest corner lies in it."""

CONTACT = 1e-6
"""Faces whose normals are opposite up to this (1 + cosine) touch where they share a plane."""


def point_to_polygon(
    points: npt.ArrayLike,
    normals: npt.ArrayLike,
    polygons: npt.ArrayLike,
    both_sides: bool = False,
    contact: bool = True,
) -> Float64Array:
    """Return the form factor from oriented points to planar polygons, row by row.

    Unoccluded, clipped to the receiver's horizon, exact up to rounding. A point sees the
    polygon's front only, from where its corners run counter-clockwise. A point in the
    polygon's plane sees nothing of it, except where the two face each other in contact: then
    the factor is that of a vanishing gap (1 inside, 1/2 on an edge). Polygons without area
    give 0. Corners may run k ≥ 3, concave ones too, but not across each other.

    points (n, 3).
    normals (n, 3): Unit normals of the receiver at the points.
    polygons (n, k, 3): May be a broadcast view: rows are copied by chunks of `CHUNK_CORNERS` corners.
    both_sides: Count the polygon's back as well.
    contact: Whether faces in contact see each other. A surface's own back also lies in its plane and faces
        the other way, so callers that cannot distinguish the two pass False.
    Returns factors (n,) float64 in [0, 1].
    Raises ValueError if shapes do not match.
    """
    points, normals = np.asarray(points, dtype=np.float64), np.asarray(normals, dtype=np.float64)
    polygons = np.asarray(polygons, dtype=np.float64)
    count = len(points)
    if points.shape != (count, 3) or normals.shape != (count, 3):
        raise ValueError(f"points {points.shape} and normals {normals.shape} must both be (n, 3)")
    if polygons.ndim != 3 or len(polygons) != count or polygons.shape[1] < 3 or polygons.shape[2] != 3:
        raise ValueError(f"polygons have shape {polygons.shape}; ({count}, k ≥ 3, 3) is needed")
    factors = np.empty(count)
    step = max(CHUNK_CORNERS // polygons.shape[1], 1)
    for start in range(0, count, step):
        rows = slice(start, start + step)
        # One array a coordinate: (k, 3, rows) corners as seen from the point.
        corners = np.subtract(polygons[rows].transpose(1, 2, 0), points[rows].T, order="C")
        factors[rows] = _chunk_factors(corners, np.ascontiguousarray(normals[rows].T), both_sides, contact)
    return factors


def _chunk_factors(
    corners: Float64Array, normal: Float64Array, both_sides: bool, contact: bool
) -> Float64Array:
    """Return (m,) factors of (k, 3, m) corners relative to points with (3, m) normals."""
    area_vector = _area_vector(corners)
    area = np.sqrt(_dot(area_vector, area_vector))
    reach = np.sqrt(np.max(_dot(corners, corners), axis=0))
    # Volume under the polygon: positive where the point is on its front side.
    side = -_dot(corners[0], area_vector)
    off_plane = np.abs(side) > IN_PLANE * area * reach
    heights = _dot(corners, normal)
    seen = off_plane & (np.max(heights, axis=0) > 0.0)
    if not both_sides:
        seen &= side > 0.0
    whole = seen & (np.min(heights, axis=0) >= 0.0)
    cut = seen & ~whole

    # A front seen turns one way, a back the other, so the magnitude is the factor.
    turn = np.zeros(corners.shape[2], dtype=corners.dtype)
    rows = np.flatnonzero(whole)
    if 2 * len(rows) > len(turn):
        # Copying half of the rows costs more than processing the others needlessly.
        turn = np.where(whole, _closed_turn(corners, normal), 0.0)
    elif len(rows):
        turn[rows] = _closed_turn(corners.take(rows, axis=2), normal.take(rows, axis=1))
    rows = np.flatnonzero(cut)
    if len(rows):
        turn[rows] = _cut_turn(
            corners.take(rows, axis=-1),
            heights.take(rows, axis=-1),
            normal.take(rows, axis=-1),
            area_vector.take(rows, axis=-1),
        )
    rows = np.flatnonzero(~off_plane & (area > 0.0) & contact)
    if len(rows):
        facing = area_vector[:, rows] / area[rows]
        turn[rows] = _contact_turn(corners[:, :, rows], normal[:, rows], facing, both_sides)
    return np.minimum(np.abs(turn) / (2.0 * np.pi), 1.0)


def _closed_turn(corners: Float64Array, normal: Float64Array) -> Float64Array:
    """Return n · Σ γ Γ̂ over the edges: γ the angle an edge spans, Γ̂ the normal of its plane."""
    turn = np.zeros(corners.shape[2])
    for start, end in zip(np.roll(corners, 1, axis=0), corners, strict=True):
        turn += edge_turn(start, end, normal)
    return turn


def edge_turn(start: Float64Array, end: Float64Array, normal: Float64Array) -> Float64Array:
    """Return n · ∫ ω × dω along one edge, γ n · Γ̂; 0 for an edge that points at the origin.

    start, end, normal (3, m).
    """
    cross_x = start[1] * end[2] - start[2] * end[1]
    cross_y = start[2] * end[0] - start[0] * end[2]
    cross_z = start[0] * end[1] - start[1] * end[0]
    length = np.sqrt(cross_x * cross_x + cross_y * cross_y + cross_z * cross_z)
    angle = np.arctan2(length, _dot(start, end))
    along = cross_x * normal[0] + cross_y * normal[1] + cross_z * normal[2]
    return along * (angle / np.where(length > 0.0, length, 1.0))


def _cut_turn(
    corners: Float64Array, heights: Float64Array, normal: Float64Array, area_vector: Float64Array
) -> Float64Array:
    """Return the turn of the part of each outline above the horizon, closed along the horizon.

    All crossings lie on one line, where the polygon's plane cuts the horizon. Seen from the
    point that line spans less than a half turn, so the closing edges' angles are differences
    of azimuths about the line's foot, whichever crossings they join.
    """
    toward = area_vector - _dot(area_vector, normal) * normal
    toward *= -np.copysign(1.0, -_dot(corners[0], area_vector))
    across = np.stack(
        [
            normal[1] * toward[2] - normal[2] * toward[1],
            normal[2] * toward[0] - normal[0] * toward[2],
            normal[0] * toward[1] - normal[1] * toward[0],
        ]
    )
    turn = np.zeros(corners.shape[2])
    before, below = np.roll(corners, 1, axis=0), np.roll(heights, 1, axis=0)
    for start, end, low, high in zip(before, corners, below, heights, strict=True):
        rise = high - low
        crosses = (low < 0.0) != (high < 0.0)
        where = np.where(crosses, -low / np.where(crosses, rise, 1.0), 0.0)
        crossing = start + where * (end - start)
        azimuth = np.arctan2(_dot(crossing, across), _dot(crossing, toward))
        # The outline leaves the horizon's line where it rises, and enters it where it sinks.
        turn += np.where(crosses, np.sign(rise) * azimuth, 0.0)
        above_start = np.where(low < 0.0, crossing, start)
        above_end = np.where(crosses & (high < 0.0), crossing, end)
        turn += np.where((low < 0.0) & (high < 0.0), 0.0, edge_turn(above_start, above_end, normal))
    return turn


def _contact_turn(
    corners: Float64Array, normal: Float64Array, facing: Float64Array, both_sides: bool
) -> Float64Array:
    """Return the winding angle of outlines around points in their plane, where the faces touch."""
    cosine = _dot(normal, facing)
    touch = np.abs(cosine) if both_sides else -cosine
    return np.where(touch > 1.0 - CONTACT, _closed_turn(corners, facing), 0.0)


def _area_vector(corners: Float64Array) -> Float64Array:
    """Return (3, m) twice the polygon's area times its unit normal, of (k, 3, m) corners."""
    total: Float64Array = np.zeros(corners.shape[1:])
    edge = np.subtract(corners[1], corners[0], dtype=np.float64)
    for corner in corners[2:]:
        following = np.subtract(corner, corners[0], dtype=np.float64)
        total[0] += edge[1] * following[2] - edge[2] * following[1]
        total[1] += edge[2] * following[0] - edge[0] * following[2]
        total[2] += edge[0] * following[1] - edge[1] * following[0]
        edge[...] = following
    return total


def _dot(first: Float64Array, second: Float64Array) -> Float64Array:
    """Return the scalar products of (..., 3, m) coordinate arrays."""
    product: Float64Array = np.multiply(first[..., 0, :], second[..., 0, :])
    product += first[..., 1, :] * second[..., 1, :]
    product += first[..., 2, :] * second[..., 2, :]
    return product
