"""Charts of objects, and how those of a page are packed: all together, or each object in a rectangle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base import BakeError, Progress
from ...numerics import numbered, triangle_areas
from ..charts import Charts
from .atlas_input import AtlasInput, AtlasOptions
from .collapse import chart_places
from .dominant_object import greedy_object, share_of
from .packing import Packing, pack
from .rectangles import pack_rectangles, shape_of

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int64]


@dataclass(frozen=True)
class Layout:
    """One object's charts, and whether they are UVs to keep.

    shape: Objects of the same number have the same charts.
    """

    source: AtlasInput
    charts: Charts
    kept: bool
    shape: int


def pack_page(group: list[Layout], options: AtlasOptions, progress: Progress) -> Packing:
    """Pack the charts of several objects together; triangles without area get a harmless place."""
    resolution, density = options.resolution, options.texel_density
    uv = np.concatenate([layout.charts.uv for layout in group])
    first = np.cumsum([0] + [layout.charts.count for layout in group])
    chart = np.concatenate(
        [
            np.where(layout.charts.chart >= 0, layout.charts.chart + start, -1)
            for layout, start in zip(group, first[:-1], strict=True)
        ]
    )
    used = np.flatnonzero(chart >= 0)
    if not len(used):
        return Packing(np.full(uv.shape, 0.5, dtype=np.float32), resolution if density is None else 4, 0.0)
    try:
        if options.rectangles:
            return _pack_rectangles(group, options, progress)
        places = chart_places(_corners(group)[used], chart[used], _share_groups(group)[used])
        packing = pack(uv[used], chart[used], resolution, density, options.limits, progress, places)
    except BakeError as error:
        alone = f"object '{group[0].source.name}': " if len(group) == 1 else ""
        raise BakeError(f"{alone}{error}{greedy_of(group)[1]}") from None
    pages = np.empty(uv.shape, dtype=np.float32)
    pages[used] = packing.uv
    _park(pages, chart, [len(layout.source.triangles) for layout in group])
    return Packing(pages, packing.resolution, packing.density, packing.crowded)


def _pack_rectangles(group: list[Layout], options: AtlasOptions, progress: Progress) -> Packing:
    """Pack each object's charts apart, one layout for all objects of a shape."""
    layouts = {layout.shape: layout for layout in group}
    shapes = []
    for layout in layouts.values():
        charts, used = layout.charts, layout.charts.chart >= 0
        places = None
        if used.any():
            corners, kinds = _corners([layout])[used], _share_groups([layout])[used]
            places = chart_places(corners, charts.chart[used], kinds)
        shapes.append(shape_of(charts.uv, charts.chart, options.limits, places))
    number = {shape: row for row, shape in enumerate(layouts)}
    rows = [number[layout.shape] for layout in group]
    return pack_rectangles(shapes, rows, options.resolution, options.texel_density, options.limits, progress)


def _share_groups(group: list[Layout]) -> Int:
    """Return a number for each triangle: only those of one object and kind share texels, −1 for kept UVs."""
    number = np.repeat(np.arange(len(group)), [len(layout.source.triangles) for layout in group])
    kind = np.concatenate([_kinds(layout.source) for layout in group])
    kept = np.array([layout.kept for layout in group])
    return np.where(kept[number], -1, numbered(np.column_stack((number, kind))))


def _kinds(source: AtlasInput) -> Int:
    return np.zeros(len(source.triangles), dtype=np.int64) if source.kind is None else source.kind


def _park(uv: Float32, chart: Int, lengths: list[int]) -> None:
    """Put triangles without area on a corner of their own object, else of the page's first."""
    start = 0
    fallback = uv[np.flatnonzero(chart >= 0)[0], 0].copy()
    for length in lengths:
        rows = np.arange(start, start + length)
        placed = rows[chart[rows] >= 0]
        uv[rows[chart[rows] < 0]] = uv[placed[0], 0] if len(placed) else fallback
        start += length


def surface_of(group: list[Layout]) -> float:
    """Return the area of all triangles [m²]."""
    return float(triangle_areas(_corners(group)).sum())


def _corners(group: list[Layout]) -> Float:
    return np.concatenate([np.asarray(layout.source.triangles, dtype=np.float64) for layout in group])


def greedy_of(group: list[Layout]) -> tuple[str, str]:
    """Return which object takes nearly all of the surface, and words on it; empty if none does."""
    surfaces = [surface_of([layout]) * layout.source.scale**2 for layout in group]
    name = greedy_object([layout.source.name for layout in group], surfaces) or ""
    taken = share_of(max(surfaces), sum(surfaces)) if name else ""
    return name, name and f"; object '{name}' takes {taken} of the surface: lower its texel scale"
