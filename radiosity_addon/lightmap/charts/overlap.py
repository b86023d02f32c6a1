"""Finding triangles of one chart that lie over each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...numerics import numbered, run_chunks, run_starts
from ..texels import overlapping_pairs

Float = NDArray[np.float64]
Int = NDArray[np.int64]


def overlapping_triangles(uv: Float, chart: Int) -> NDArray[np.intp]:
    """Return the triangles that overlap another one of their chart.

    The charts are drawn side by side at some two hundred texels a triangle, on a page of
    1448² at most; a texel's center inside two triangles gives them away. Smaller overlaps
    go unseen.

    uv (n, 3, 2): Every chart in its own place; charts may lie over each other.
    chart (n,) int64.
    """
    if not len(uv):
        return np.zeros(0, dtype=np.intp)
    chart = numbered(chart)
    page, resolution = _side_by_side(uv, chart)
    pairs = list(overlapping_pairs(page, resolution, centers_only=True))
    if not pairs:
        return np.zeros(0, dtype=np.intp)
    texel = np.concatenate([part.texel for part in pairs])
    triangle = np.concatenate([part.triangle for part in pairs])
    crowded = np.bincount(texel, minlength=resolution**2)[texel] > 1
    return np.unique(triangle[crowded]).astype(np.intp)


def _side_by_side(uv: Float, chart: Int) -> tuple[NDArray[np.float32], int]:
    """Place charts in shelves, one texel apart; return uv in [0, 1] and the page's resolution."""
    count = int(chart.max()) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, chart, uv.min(axis=1))
    np.maximum.at(high, chart, uv.max(axis=1))
    extent = high - low
    texels_in_all = float(np.clip(256 * len(uv), 2**14, 2**21))
    scale = np.sqrt(texels_in_all / max(float(extent.prod(axis=1).sum()), 1e-30))
    scale = min(scale, 2048 / max(float(extent.max()), 1e-30))
    size = np.ceil(extent * scale).astype(np.int64) + 1
    width = max(int(np.sqrt(size.prod(axis=1).sum())), int(size[:, 0].max()))
    order = np.argsort(-size[:, 1], kind="stable")
    corner = np.empty((count, 2))
    height = 0
    for part in run_chunks(size[order, 0], width):
        shelf = order[part]
        corner[shelf, 0] = run_starts(size[shelf, 0])
        corner[shelf, 1] = height
        height += int(size[shelf[0], 1])
    resolution: int = max(width, height)
    local = (uv - low[chart][:, None]) * scale + corner[chart][:, None]
    return (local / resolution).astype(np.float32), int(resolution)
