"""Finding triangles of one chart that lie over each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...numerics import numbered, run_numbers, run_starts, signed_double_areas

Float = NDArray[np.float64]
Int = NDArray[np.int64]

_A_TRIANGLE, _A_CHART = 128, 512
"""Texels at which a chart is drawn, by its area: for each of its triangles, and more."""

_BOX = 4.0
"""The box of a chart takes at most this many times as many."""

_LONGEST = 2048
"""Texels along a side of the box at most."""

_MARGIN = 1e-3
"""A center counts if it lies inside an edge by this part of the way to the texel's farthest corner."""


def overlapping_triangles(uv: Float, chart: Int) -> NDArray[np.intp]:
    """Return the triangles that overlap another one of their chart.

    Each chart is drawn by itself; a texel's center inside two triangles gives them away. Smaller overlaps
    go unseen. Triangles and rows of texels make spans, and a span's two ends are all that is drawn.

    uv (n, 3, 2): Every chart in its own place; charts may lie over each other.
    chart (n,) int64.
    """
    if not len(uv):
        return np.zeros(0, dtype=np.intp)
    chart = numbered(chart)
    corners, width, height = _drawn(uv, chart)
    # One column more, where the last span ends.
    begin = run_starts((width + 1) * height)
    triangle, row, first, end = _spans(corners)
    line = begin[chart[triangle]] + row * (width[chart[triangle]] + 1)
    steps = np.zeros(int(((width + 1) * height).sum()) + 1, dtype=np.int32)
    np.add.at(steps, line + first, 1)
    np.add.at(steps, line + end, -1)
    crowded = np.concatenate(([0], np.cumsum(np.cumsum(steps) > 1)))
    return np.unique(triangle[crowded[line + end] > crowded[line + first]]).astype(np.intp)


def _drawn(uv: Float, chart: Int) -> tuple[Float, Int, Int]:
    """Return corners (n, 3, 2) [texels], counter-clockwise, each chart from 0 on, and the charts' sizes."""
    count = int(chart.max()) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, chart, uv.min(axis=1))
    np.maximum.at(high, chart, uv.max(axis=1))
    extent = high - low
    double = signed_double_areas(uv)
    area = np.maximum(0.5 * np.bincount(chart, np.abs(double), count), 1e-300)
    texels = _A_TRIANGLE * np.bincount(chart, minlength=count) + _A_CHART
    scale = np.sqrt(texels / np.maximum(area, extent.prod(axis=1) / _BOX))
    scale = np.minimum(scale, _LONGEST / np.maximum(extent.max(axis=1), 1e-300))
    size = np.ceil(extent * scale[:, None]).astype(np.int64) + 1
    corners = (uv - low[chart][:, None]) * scale[chart, None, None]
    turned = double < 0
    corners[turned] = corners[turned, ::-1]
    return corners, size[:, 0], size[:, 1]


def _spans(corners: Float) -> tuple[Int, Int, Int, Int]:
    """Return triangle, row, first column and the one past the last of the centers inside triangles."""
    v = corners[..., 1]
    low = np.ceil(v.min(axis=1) - 0.5).astype(np.int64)
    count = np.maximum(np.floor(v.max(axis=1) - 0.5).astype(np.int64) + 1 - low, 0)
    triangle = np.repeat(np.arange(len(corners)), count)
    row = run_numbers(count, low)
    left, right = np.full(len(row), -np.inf), np.full(len(row), np.inf)
    for k in range(3):
        start = corners[:, k]
        along = corners[:, (k + 1) % 3] - start
        margin = 0.5 * _MARGIN * np.abs(along).sum(axis=1)
        # Inside is where along_x · (y − start_y) − along_y · (x − start_x) > margin.
        ahead = along[triangle, 0] * (row + 0.5 - start[triangle, 1]) - margin[triangle]
        rise = along[triangle, 1]
        at = start[triangle, 0] + ahead / np.where(rise == 0.0, 1.0, rise)
        right = np.where(rise > 0.0, np.minimum(right, at), right)
        left = np.where(rise < 0.0, np.maximum(left, at), left)
        right = np.where((rise == 0.0) & (ahead <= 0.0), -np.inf, right)
    some = np.flatnonzero(right > left)
    first = np.floor(left[some] - 0.5).astype(np.int64) + 1
    end = np.ceil(right[some] - 0.5).astype(np.int64)
    full = end > first
    some = some[full]
    return triangle[some], row[some], first[full], end[full]
