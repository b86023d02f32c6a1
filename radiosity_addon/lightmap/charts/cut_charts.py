"""Cutting objects into charts that lie flat, to scale and front side up.

A polygon must stay whole in one chart, because UVs are written per polygon corner; the chart
grower works on triangles and now and then cuts one. Such polygons get a chart of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...base import SILENT, Progress
from ...numerics import (
    connected_faces,
    double_area_vectors,
    map_chunks,
    numbered,
    run_chunks,
    signed_double_areas,
)
from .flatten import project, project_polygons, rescale_to_area, undo_stretch
from .join_coplanar import join_coplanar
from .overlap import overlapping_triangles

Float = NDArray[np.float64]
Int = NDArray[np.int64]

GrowCharts = Callable[[Float, Int, Int], tuple[Float, Int]]
"""(vertices (v, 3), faces (n, 3), object (n,)) → (uv (n, 3, 2), chart (n,), −1 where a face was left out)."""

PIECE = 20_000
"""Triangles of one object handed to the chart grower at once: it can neither report progress nor stop."""

BATCH = 8_000
"""Triangles of several objects that are cut together."""

JOINED = 100_000
"""Triangles of several objects whose charts are joined together: some 100 MB."""

_FLAT = 1e-7
"""A triangle whose height is less than this share of its longest side has no area."""

_COPLANAR = 1e-5
"""A chart whose normals all lie this close (chord length) to their mean is projected exactly."""


@dataclass(frozen=True)
class Charts:
    """The charts of one object, or of several.

    uv (n, 3, 2): 1 unit is 1 m; every chart has its own origin.
    chart (n,) int64: 0 … count − 1, or −1 for triangles of polygons without area.
    """

    uv: Float
    chart: Int
    count: int


def join_charts(parts: Sequence[Charts]) -> Charts:
    """Return the charts of several objects, one after the other."""
    count = np.cumsum([0, *(part.count for part in parts)])
    chart = [
        np.where(part.chart >= 0, part.chart + before, -1)
        for part, before in zip(parts, count[:-1], strict=True)
    ]
    return Charts(np.concatenate([part.uv for part in parts]), np.concatenate(chart), int(count[-1]))


def split_charts(charts: Charts, counts: Sequence[int]) -> list[Charts]:
    """Return the charts of each of several objects that have so many triangles."""
    parts, start = [], 0
    for end in np.cumsum(counts).tolist():
        chart = charts.chart[start:end].copy()
        used = chart >= 0
        chart[used] = numbered(chart[used])
        parts.append(Charts(charts.uv[start:end], chart, int(chart.max(initial=-1)) + 1))
        start = end
    return parts


def unwrap(
    triangles: Float,
    polygon: Int,
    grow: GrowCharts | None,
    progress: Progress = SILENT,
    threads: int = 1,
    owner: Int | None = None,
    abort: Callable[[], None] | None = None,
) -> Charts:
    """Cut objects into charts, batch by batch: many small objects, or a piece of a large one.

    triangles (n, 3, 3): Corners in world space [m].
    polygon (n,) int: The polygon of each triangle, in its object.
    grow: The chart grower; None gives every polygon a chart of its own.
    threads: Batches that are cut at once; 0 means all cores.
    owner (n,) int64: The object of each triangle, ascending; None for one object. No chart has several.
    abort: Makes the grower end soon, when canceled.
    """
    owner = np.zeros(len(triangles), dtype=np.int64) if owner is None else numbered(owner)
    polygon = numbered(np.column_stack((owner, polygon)))
    uv = np.zeros((len(triangles), 3, 2))
    chart = np.full(len(triangles), -1, dtype=np.int64)
    batches = list(_batches(triangles, polygon, owner))
    cut = partial(_unwrap_one, triangles, polygon, owner, grow, batches)
    count = 0
    for part, (batch_uv, batch_chart) in map_chunks(cut, len(batches), 1, threads, progress, abort):
        rows = batches[part.start]
        uv[rows] = batch_uv
        chart[rows] = np.where(batch_chart >= 0, batch_chart + count, -1)
        count = max(count, int(batch_chart.max(initial=-1)) + 1 + count)
    counts, start = np.bincount(owner), 0
    for part in run_chunks(counts, JOINED):
        end = start + int(counts[part].sum())
        rows = slice(start, end)
        uv[rows], chart[rows] = join_coplanar(uv[rows], triangles[rows], chart[rows], owner[rows])
        start = end
    used = chart >= 0
    chart[used] = numbered(np.column_stack((owner[used], chart[used])))
    return Charts(uv, chart, int(chart.max(initial=-1)) + 1)


def _unwrap_one(
    triangles: Float,
    polygon: Int,
    owner: Int,
    grow: GrowCharts | None,
    batches: list[NDArray[np.intp]],
    part: slice,
) -> tuple[Float, Int]:
    rows = batches[part.start]
    return _unwrap_batch(triangles[rows], polygon[rows], owner[rows], grow)


def _batches(triangles: Float, polygon: Int, owner: Int) -> Iterator[NDArray[np.intp]]:
    """Yield the rows of each batch: whole objects while they have few triangles, else a piece of one."""
    count = np.bincount(owner) if len(owner) else np.zeros(0, dtype=np.int64)
    start = np.concatenate(([0], np.cumsum(count)))
    for part in run_chunks(count, BATCH):
        rows = np.arange(start[part.start], start[part.stop])
        if len(rows) <= PIECE:
            yield rows
            continue
        for piece in _pieces(triangles[rows], numbered(polygon[rows])):
            yield rows[piece]


def _pieces(triangles: Float, polygon: Int) -> Iterator[NDArray[np.intp]]:
    """Halve the polygons across the longest axis until a piece has at most `PIECE` triangles."""
    count = int(polygon.max()) + 1 if len(polygon) else 0
    size = np.maximum(np.bincount(polygon, minlength=count), 1)
    middle = triangles.mean(axis=1)
    center = np.stack([np.bincount(polygon, middle[:, k], count) for k in range(3)], axis=-1) / size[:, None]
    waiting = [np.arange(count)]
    while waiting:
        part = waiting.pop()
        if size[part].sum() <= PIECE or len(part) < 2:
            yield np.flatnonzero(np.isin(polygon, part))
            continue
        axis = int(np.ptp(center[part], axis=0).argmax())
        part = part[np.argsort(center[part, axis], kind="stable")]
        waiting += [part[len(part) // 2 :], part[: len(part) // 2]]


def _unwrap_batch(
    triangles: Float, polygon: Int, owner: Int, grow: GrowCharts | None, again: int = 2
) -> tuple[Float, Int]:
    """Return uv (n, 3, 2) [m] and chart (n,) of a batch; charts are numbered without gaps.

    What overlaps within its chart is cut out and unwrapped by itself, `again` times by the
    grower, at last polygon by polygon.
    """
    count = len(triangles)
    polygon = numbered(polygon)
    corners = triangles.reshape(-1, 3)
    index = numbered(np.column_stack((np.repeat(owner, 3), corners)))
    faces = index.reshape(count, 3)
    solid = _has_area(triangles)
    uv = np.zeros((count, 3, 2))
    chart = np.full(count, -1, dtype=np.int64)
    if grow is not None and solid.any():
        vertices = np.empty((int(index.max()) + 1, 3))
        vertices[index] = _normalized(triangles, owner, solid).reshape(-1, 3)
        uv[solid], chart[solid] = grow(vertices, faces[solid], owner[solid])
    torn = _torn_polygons(uv, chart, faces, polygon, solid)
    own = torn[polygon]
    if own.any():
        chart = _split_parts(uv, np.where(own, -1, chart))
        number = numbered(polygon[own])
        uv[own] = project_polygons(triangles[own], number)
        chart[own] = chart.max() + 1 + number
    used = np.flatnonzero(chart >= 0)
    if not len(used):
        return uv, chart
    chart[used] = numbered(chart[used])
    uv[used] = _to_scale(uv[used], triangles[used], chart[used], own[used])
    # Separate charts were checked before.
    over = _overlapping_polygons(uv, np.where(own, -1, chart), polygon)
    if not len(over):
        return uv, chart
    redone = _unwrap_batch(triangles[over], polygon[over], owner[over], grow if again else None, again - 1)
    chart[over] = -1
    chart = _split_parts(uv, chart)
    uv[over], chart[over] = redone[0], redone[1] + chart.max() + 1
    chart[used] = numbered(chart[used])
    uv[used] = rescale_to_area(uv[used], triangles[used], chart[used], int(chart.max()) + 1)
    return uv, chart


def _overlapping_polygons(uv: Float, chart: Int, polygon: Int) -> NDArray[np.intp]:
    """Return the triangles to cut out until no overlap of a chart with itself is found."""
    # Two triangles side by side cannot overlap.
    left = np.flatnonzero(chart >= 0)
    left = left[np.bincount(chart[left])[chart[left]] > 2] if len(left) else left
    cut: list[NDArray[np.intp]] = []
    while len(over := left[overlapping_triangles(uv[left], chart[left])]):
        whole = np.isin(polygon[left], polygon[over])
        cut.append(left[whole])
        left = left[~whole]
    return np.concatenate(cut) if cut else np.zeros(0, dtype=np.intp)


def _split_parts(uv: Float, chart: Int) -> Int:
    """Renumber charts so that disconnected parts become separate charts."""
    used = np.flatnonzero(chart >= 0)
    if not len(used):
        return chart
    keys = np.column_stack((np.repeat(chart[used], 3), uv[used].reshape(-1, 2)))
    parts = np.full(len(chart), -1, dtype=np.int64)
    parts[used] = connected_faces(numbered(keys).reshape(-1, 3))
    return parts


def _has_area(triangles: Float) -> NDArray[np.bool_]:
    """Return which triangles are more than a line or a point."""
    sides = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2)
    longest = sides.max(axis=1)
    cross = double_area_vectors(triangles)
    return np.asarray((longest > 0) & (np.linalg.norm(cross, axis=1) > _FLAT * longest**2))


def _normalized(triangles: Float, owner: Int, solid: NDArray[np.bool_]) -> Float:
    """Move objects to the origin and scale them to a mean triangle of area 1: epsilons are absolute."""
    number = numbered(owner)
    count = int(number.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, number, triangles.min(axis=1))
    np.maximum.at(high, number, triangles.max(axis=1))
    area = np.linalg.norm(double_area_vectors(triangles[solid]), axis=1)
    having = np.maximum(np.bincount(number[solid], minlength=count), 1)
    size = np.sqrt(0.5 * np.bincount(number[solid], area, count) / having)
    middle, size = 0.5 * (low + high), np.where(size > 0, size, 1.0)
    return np.asarray((triangles - middle[number][:, None]) / size[number][:, None, None])


def _torn_polygons(
    uv: Float, chart: Int, faces: Int, polygon: Int, solid: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return which polygons need a chart of their own.

    Those cut by the grower, left out by it, turned over against the rest of their chart, or
    with a triangle without area next to one that has some (the grower never saw it).
    """
    count = int(polygon.max()) + 1
    torn = np.zeros(count, dtype=np.bool_)
    alive = np.zeros(count, dtype=np.bool_)
    alive[polygon[solid]] = True
    torn[polygon[(chart < 0)]] = True

    placed = np.flatnonzero(chart >= 0)
    if len(placed):
        area = signed_double_areas(uv[placed])
        total = np.bincount(chart[placed], area)
        torn[polygon[placed[area * total[chart[placed]] <= 0]]] = True
        first = np.full(count, -1, dtype=np.int64)
        first[polygon[placed]] = chart[placed]
        torn[polygon[placed[chart[placed] != first[polygon[placed]]]]] = True
        # Corners of one polygon at one position must share their UV.
        owner = np.repeat(polygon[placed], 3)
        key = owner * (int(faces.max()) + 1) + faces[placed].reshape(-1)
        _, start, same = np.unique(key, return_index=True, return_inverse=True)
        flat = uv[placed].reshape(-1, 2)
        torn[owner[(flat != flat[start[same.reshape(-1)]]).any(axis=1)]] = True
    return torn & alive


def _to_scale(uv: Float, triangles: Float, chart: Int, projected: NDArray[np.bool_]) -> Float:
    """Bring charts to world scale and front side up; planar ones exactly, by projection."""
    count = int(chart.max()) + 1
    cross = double_area_vectors(triangles)
    mean = np.stack([np.bincount(chart, cross[:, k], count) for k in range(3)], axis=-1)
    grown = np.flatnonzero(~projected)
    if len(grown):
        turned = np.bincount(chart[grown], signed_double_areas(uv[grown]), count) < 0
        uv = uv.copy()
        uv[grown, :, 0] *= np.where(turned, -1.0, 1.0)[chart[grown], None]
        uv[grown] = undo_stretch(uv[grown], triangles[grown], chart[grown], count)
        unit = cross / np.linalg.norm(cross, axis=1, keepdims=True).clip(np.finfo(float).tiny)
        axis = mean / np.linalg.norm(mean, axis=1, keepdims=True).clip(np.finfo(float).tiny)
        bent = np.zeros(count, dtype=np.bool_)
        bent[chart[np.linalg.norm(unit - axis[chart], axis=1) > _COPLANAR]] = True
        planar = grown[~bent[chart[grown]]]
        uv[planar] = project(triangles[planar], mean[chart[planar]])
    return rescale_to_area(uv, triangles, chart, count)
