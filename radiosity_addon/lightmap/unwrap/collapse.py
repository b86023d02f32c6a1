"""Charts smaller than a texel: collapsed to points and lines that need no gaps.

A chart that is smaller than a texel both ways becomes a *point*, the center of a texel, which it shares with
others of its object that are close and face the same way. One that is thinner than a texel becomes a *line*
through the centers of a row of texels. Bilinear filtering reads no other texel there, so points and lines lie
side by side in one block of rows; only between it and the other charts there is a gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...numerics import double_area_vectors, numbered, run_chunks, run_numbers, run_starts

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

THIN = 1.5
"""Texels; what is narrower is collapsed."""

STRETCH = 2.0
"""What is longer than the page is shrunk along its length by up to this factor."""

NEIGHBORHOOD = 1.0
"""Texels; points share a texel if their centers are in one cell of a lattice of this width."""


FACINGS = 2.0
"""Normals face the same way if they are alike in units of a half."""


@dataclass(frozen=True)
class ChartPlaces:
    """Where charts are in the scene.

    group (count,) int64: Charts of different groups share no texel; −1 for charts that must keep their shape.
    center, normal (count, 3): The centroid [m], and the mean normal times the area.
    """

    group: Int
    center: Float
    normal: Float


def chart_places(triangles: Float, chart: Int, group: Int) -> ChartPlaces:
    """Return where charts are; a chart belongs to the group of its largest triangle.

    triangles (n, 3, 3) [m], chart (n,) int64 from 0 without gaps, group (n,) int64.
    """
    count = int(chart.max()) + 1
    cross = double_area_vectors(triangles)
    area, middle = np.linalg.norm(cross, axis=1), triangles.mean(axis=1)
    total = np.maximum(np.bincount(chart, area, count), 1e-300)
    center = np.stack([np.bincount(chart, area * middle[:, k], count) / total for k in range(3)], axis=-1)
    normal = np.stack([np.bincount(chart, cross[:, k], count) for k in range(3)], axis=-1)
    order = np.lexsort((-area, chart))
    largest = order[np.searchsorted(chart[order], np.arange(count))]
    return ChartPlaces(group[largest], np.asarray(center), np.asarray(normal, dtype=np.float64))


@dataclass(frozen=True)
class Block:
    """Collapsed charts, in rows of texels.

    is_in (count,) bool: The charts that are collapsed.
    length (count,) int64: Texels that a chart takes in its row; 1 for points.
    column, row (count,) int64: Its first texel.
    rows: Of the block.
    """

    is_in: Bool
    length: Int
    column: Int
    row: Int
    rows: int


def collapse(places: ChartPlaces | None, extent: Float, scale: float, width: int) -> Block | None:
    """Arrange the charts that are thinner than a texel; None if one is longer than a row.

    extent (count, 2): Width and height of the charts [texels].
    scale: Texels per meter.
    width: Of the rows [texels].
    """
    count = len(extent)
    is_in = np.zeros(count, dtype=np.bool_)
    length, column, row = (np.zeros(count, dtype=np.int64) for _ in range(3))
    if places is None:
        return Block(is_in, length, column, row, 0)
    is_in = (extent.min(axis=1) < THIN) & (places.group >= 0)
    long = extent.max(axis=1)
    is_line = is_in & (long >= 1.0)
    lines = np.flatnonzero(is_line)
    # Both ends lie on the centers of texels.
    length[lines] = np.minimum(np.ceil(long[lines]).astype(np.int64) + 1, width)
    if len(lines) and float(long[lines].max()) > STRETCH * width:
        return None
    lines = lines[np.argsort(-length[lines], kind="stable")]
    filled = []
    for number, part in enumerate(run_chunks(length[lines], width)):
        of = lines[part]
        row[of], column[of] = number, run_starts(length[of])
        filled.append(int(length[of].sum()))
    points = np.flatnonzero(is_in & ~is_line)
    length[points] = 1
    shared = _shared(places, points, scale)
    left = np.array([width - taken for taken in filled], dtype=np.int64)
    texels = int(shared.max()) + 1 if len(points) else 0
    rows = len(filled) + max(0, -(-(texels - int(left.sum())) // width))
    room = np.concatenate((left, np.full(rows - len(filled), width, dtype=np.int64)))
    begin = np.concatenate((np.array(filled, dtype=np.int64), np.zeros(rows - len(filled), dtype=np.int64)))
    free_row, free_column = np.repeat(np.arange(rows), room), run_numbers(room, begin)
    row[points], column[points] = free_row[shared], free_column[shared]
    return Block(is_in, length, column, row, rows)


def _shared(places: ChartPlaces, points: Int, scale: float) -> Int:
    """Number the texels that points share."""
    normal = places.normal[points]
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facing = np.rint(FACINGS * normal / np.where(length > 0, length, 1.0)).astype(np.int64)
    cell = np.floor(places.center[points] * scale / NEIGHBORHOOD).astype(np.int64)
    return numbered(np.column_stack((places.group[points], facing, cell)))


def collapsed_corners(block: Block, uv: Float, chart: Int, extent: Float) -> Float:
    """Return (n, 3, 2) where the corners of collapsed charts' triangles lie [texels of the block].

    uv (n, 3, 2): The charts, each from 0 to its extent [any unit].
    chart (n,) int64: The chart of each triangle.
    extent (count, 2).
    """
    upright = extent[:, 1] > extent[:, 0]
    long = np.where(upright, extent[:, 1], extent[:, 0])[chart, None]
    along = np.where(upright[chart, None], uv[..., 1], uv[..., 0])
    share = np.clip(along / np.where(long > 0, long, 1.0), 0.0, 1.0)
    u = block.column[chart, None] + 0.5 + share * (block.length[chart, None] - 1)
    v = np.broadcast_to(block.row[chart, None] + 0.5, u.shape)
    return np.stack((u, v), axis=-1)
