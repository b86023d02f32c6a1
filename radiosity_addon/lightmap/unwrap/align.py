"""Turning charts so that their bounding boxes are smallest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...numerics import numbered

Float = NDArray[np.float64]
Int = NDArray[np.int64]


def chart_extents(uv: Float, chart: Int, count: int) -> Float:
    """Return (count, 2) width and height of charts; triangles of chart −1 are left out."""
    used = chart >= 0
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, chart[used], uv[used].min(axis=1))
    np.maximum.at(high, chart[used], uv[used].max(axis=1))
    return high - low


def align(uv: Float, chart: Int, count: int) -> Float:
    """Turn each chart so that its bounding box is smallest; its lower left corner becomes 0.

    The smallest box has a side along an edge of the chart's convex hull. Angles are searched
    in 2° steps, refined, and put on the nearest edge of the chart if that does no harm, so
    that a rectangle comes out exactly upright.
    """
    corners = np.column_stack((np.repeat(chart, 3), uv.reshape(-1, 2)))
    # Each corner once, chart by chart.
    points = corners[np.unique(numbered(corners), return_index=True)[1]]
    owner, points = points[:, 0].astype(np.int64), points[:, 1:]
    starts = np.searchsorted(owner, np.arange(count))
    angle = np.zeros(count)
    best = np.full(count, np.inf)
    for step, around in ((np.pi / 90, 45), (np.pi / 900, 12), (np.pi / 9000, 12)):
        middle = angle.copy()
        for k in range(around):
            trial = middle + (k - around // 2) * step
            area = _box_area(points, owner, starts, trial)
            better = area < best * (1 - 1e-12)
            best, angle = np.where(better, area, best), np.where(better, trial, angle)
    edge = (np.roll(uv, -1, axis=1) - uv).reshape(-1, 2)
    edge_owner = np.repeat(chart, 3)
    direction = -np.arctan2(edge[:, 1], edge[:, 0])
    miss = (direction - angle[edge_owner] + np.pi / 4) % (np.pi / 2) - np.pi / 4
    miss[(edge == 0).all(axis=1)] = np.inf
    nearest = np.lexsort((np.abs(miss), edge_owner))
    first = nearest[np.searchsorted(edge_owner[nearest], np.arange(count))]
    snapped = angle + np.where(np.isfinite(miss[first]), miss[first], 0.0)
    harmless = _box_area(points, owner, starts, snapped) <= best * (1 + 1e-6)
    turned = _turn(uv, chart, np.where(harmless, snapped, angle))
    low = np.full((count, 2), np.inf)
    np.minimum.at(low, chart, turned.min(axis=1))
    return np.asarray(turned - low[chart][:, None])


def _turn(uv: Float, chart: Int, angle: Float) -> Float:
    cos, sin = np.cos(angle)[chart, None], np.sin(angle)[chart, None]
    return np.stack((uv[..., 0] * cos - uv[..., 1] * sin, uv[..., 0] * sin + uv[..., 1] * cos), axis=-1)


def _box_area(points: Float, owner: Int, starts: Int, angle: Float) -> Float:
    """Return (count,) the areas of the boxes around charts, each turned by an angle.

    points (p, 2), owner (p,): Sorted by chart; `starts` (count,) is where each begins.
    """
    cos, sin = np.cos(angle)[owner], np.sin(angle)[owner]
    x, y = points[:, 0] * cos - points[:, 1] * sin, points[:, 0] * sin + points[:, 1] * cos
    width, height = (
        np.maximum.reduceat(along, starts) - np.minimum.reduceat(along, starts) for along in (x, y)
    )
    return np.asarray(width * height)
