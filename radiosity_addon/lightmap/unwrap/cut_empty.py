"""Cutting charts whose box is mostly empty: frames, angles, bent tubes, fans of slivers.

The polygons of such a chart are sorted by the direction in which they are long, and those of one direction
that hang together become a chart: the four bars of a frame. It is cut only if the parts, with their
gaps, take less of the page.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...numerics import connected_faces, numbered, signed_double_areas
from ..charts import Charts
from .align import align, chart_extents
from .collapse import THIN

Float = NDArray[np.float64]
Int = NDArray[np.int64]

EMPTY = 0.5
"""Charts that fill less of their box are tried."""

GAIN = 0.8
"""They are cut if the parts take less than this of the texels: a cut is a seam."""

DIRECTIONS = 4
"""Over half a turn."""


def cut_empty_charts(charts: Charts, polygon: Int, size: Float, density: float, padding: int) -> Charts:
    """Cut the charts of one object where that saves texels.

    polygon (n,) int: The polygon of each triangle; it stays whole.
    size (n,): The area that each triangle ought to have; parts are scaled to it.
    density: About how many texels a meter there will be.
    padding: Free texels between charts.
    """
    if not charts.count or density <= 0.0:
        return charts
    area = _sums(charts.chart, 0.5 * np.abs(signed_double_areas(charts.uv)), charts.count)
    several = _polygons_of(charts, polygon) > 1
    tried = several & (area < 0.9 * chart_extents(charts.uv, charts.chart, charts.count).prod(axis=1))
    rows = np.flatnonzero((charts.chart >= 0) & tried[charts.chart])
    if not len(rows):
        return charts
    chart = numbered(charts.chart[rows])
    count = int(chart.max()) + 1
    uv = align(charts.uv[rows], chart, count)
    extent = chart_extents(uv, chart, count)
    filled = _sums(chart, 0.5 * np.abs(signed_double_areas(uv)), count)
    empty = filled < EMPTY * extent.prod(axis=1)
    rows, uv, chart = (values[empty[chart]] for values in (rows, uv, chart))
    if not len(rows):
        return charts
    part = _parts(uv, chart, numbered(polygon[rows]))
    parts = int(part.max()) + 1
    turned = _upright(uv, part, parts)
    cost = _texels(chart_extents(turned, part, parts) * density, padding)
    of = np.zeros(parts, dtype=np.int64)
    of[part] = chart
    cut = _sums(of, cost, count) < GAIN * _texels(extent * density, padding)
    chosen = cut[chart]
    result = charts.chart.copy()
    result[rows[chosen]] = charts.count + part[chosen]
    used = result >= 0
    result[used] = numbered(result[used])
    scaled = charts.uv.copy()
    flat = _sums(part, 0.5 * np.abs(signed_double_areas(uv)), parts)
    factor = np.sqrt(_sums(part, size[rows], parts) / np.where(flat > 0, flat, 1.0))
    scaled[rows[chosen]] *= np.where(flat > 0, factor, 1.0)[part[chosen], None, None]
    return Charts(scaled, result, int(result.max()) + 1)


def _parts(uv: Float, chart: Int, polygon: Int) -> Int:
    """Return (n,) the part of its chart that each triangle belongs to, numbered through."""
    edge = np.roll(uv, -1, axis=1) - uv
    moments = [(edge[..., i] * edge[..., j]).sum(axis=1) for i, j in ((0, 0), (1, 1), (0, 1))]
    xx, yy, xy = (np.bincount(polygon, moment)[polygon] for moment in moments)
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    direction = np.rint(angle * DIRECTIONS / np.pi).astype(np.int64) % DIRECTIONS
    label = np.column_stack((np.repeat(chart * DIRECTIONS + direction, 3), uv.reshape(-1, 2)))
    parts: Int = connected_faces(numbered(label).reshape(-1, 3))
    # A polygon whose triangles hang together at other corners only stays whole.
    first = np.full(int(polygon.max()) + 1, len(parts), dtype=np.int64)
    np.minimum.at(first, polygon, parts)
    return numbered(first[polygon])


def _upright(uv: Float, part: Int, count: int) -> Float:
    """Turn each part so that its longest direction is along u."""
    edge = np.roll(uv, -1, axis=1) - uv
    moments = [(edge[..., i] * edge[..., j]).sum(axis=1) for i, j in ((0, 0), (1, 1), (0, 1))]
    xx, yy, xy = (np.bincount(part, moment, count) for moment in moments)
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    cos, sin = np.cos(angle)[part, None], np.sin(angle)[part, None]
    return np.stack((uv[..., 0] * cos + uv[..., 1] * sin, uv[..., 1] * cos - uv[..., 0] * sin), axis=-1)


def _texels(extent: Float, padding: int) -> Float:
    """Return (count,) texels that charts of an extent (count, 2) [texels] take, gaps included."""
    long, thin = extent.max(axis=1), extent.min(axis=1) < THIN
    return np.where(thin, np.ceil(long) + 1.0, (np.ceil(extent) + padding).prod(axis=1))


def _sums(chart: Int, values: Float, count: int) -> Float:
    used = chart >= 0
    return np.asarray(np.bincount(chart[used], values[used], count), dtype=np.float64)


def _polygons_of(charts: Charts, polygon: Int) -> Int:
    """Return (count,) how many polygons each chart has."""
    used = charts.chart >= 0
    pairs = np.unique(np.column_stack((charts.chart[used], polygon[used])), axis=0)
    return np.asarray(np.bincount(pairs[:, 0], minlength=charts.count), dtype=np.int64)
