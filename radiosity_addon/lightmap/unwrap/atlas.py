"""Lightmap UVs for all objects of a bake: charts, pages, and what becomes of UVs to keep.

Kept UVs (an existing layer) stay as they are, bit for bit, wherever that is possible: on an
object's own page always, on a shared page when all objects bring UVs and none lies over another's.
Otherwise each object's kept layout is packed, as one chart of unchanged shape, next to the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base import SILENT, BakeError, BakeWarning, Progress
from ...numerics import numbered, signed_double_areas, triangle_areas
from ..charts import Charts, PatientGrower, join_charts, rescale_to_area, split_charts, unwrap
from ..texels import coverage_sum
from .align import chart_extents
from .atlas_input import AtlasInput, AtlasOptions
from .collapse import chart_places
from .cut_empty import cut_empty_charts
from .distortion import Stretched, stretched_faces, stretched_warnings
from .dominant_object import greedy_object, share_of
from .kept_uvs import are_apart, has_area, is_collapsed, overlaps
from .packing import Limits, Packing, pack, page_size
from .page_assignment import ChartTotals, assign_pages

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int64]

_PROBE = 1024
"""Kept UVs are searched for overlaps at no more than this resolution: a finer one finds no larger ones."""


@dataclass(frozen=True)
class AtlasObject:
    """Where one object lies: its UVs (n, 3, 2) float32 in [0, 1], v up, and its page."""

    uv: Float32
    page: int


@dataclass(frozen=True)
class AtlasPage:
    """One page.

    Parameters
    ----------
    resolution : int
        Width and height in texels.
    density : float
        Texels per meter of objects at scale 1, the mean over all their surface; 0 if there is none.
    utilisation : float
        The share of the page that charts cover, 0 to 1.
    """

    resolution: int
    density: float
    utilisation: float


@dataclass(frozen=True)
class Atlas:
    """All objects, in the order they were given, and the pages they lie on."""

    objects: tuple[AtlasObject, ...]
    pages: tuple[AtlasPage, ...]
    warnings: tuple[BakeWarning, ...] = ()
    stretched: tuple[Stretched, ...] = ()


@dataclass(frozen=True)
class _Layout:
    """One object's charts, and whether they are UVs to keep."""

    source: AtlasInput
    charts: Charts
    kept: bool


def build_atlas(objects: Sequence[AtlasInput], options: AtlasOptions, progress: Progress = SILENT) -> Atlas:
    """Lay out all objects.

    Parameters
    ----------
    objects : sequence of AtlasInput
    options : AtlasOptions

    Raises
    ------
    BakeError
        If there is nothing to lay out, or the density needs a page that is too large.
    """
    if not objects:
        raise BakeError("there is no mesh to lay out: give an object with faces to bake")
    warnings: list[BakeWarning] = []
    layouts = _lay_flat(objects, options, warnings, progress.part(0.0, 0.7))
    layouts = _cut_empty(layouts, options)
    laid = _lay_on_pages(layouts, options, progress.part(0.7, 1.0))
    placed: list[AtlasObject | None] = [None] * len(layouts)
    for number, (group, packing) in enumerate(laid):
        if packing.crowded:
            warnings.append(_crowded([layouts[each] for each in group], packing.resolution))
        ends = np.cumsum([len(layouts[each].source.triangles) for each in group])
        for each, uv in zip(group, np.split(packing.uv, ends[:-1]), strict=True):
            placed[each] = AtlasObject(uv, number)
    pages = tuple(_page(packing) for _, packing in laid)
    all_placed = tuple(each for each in placed if each is not None)
    stretched = _stretched(layouts, all_placed, pages)
    return Atlas(all_placed, pages, (*warnings, *stretched_warnings(stretched)), tuple(stretched))


def _stretched(
    layouts: list[_Layout], placed: tuple[AtlasObject, ...], pages: tuple[AtlasPage, ...]
) -> list[Stretched]:
    """Return what is stretched of the objects that were laid out here."""
    found: list[Stretched] = []
    for layout, each in zip(layouts, placed, strict=True):
        source = layout.source
        if not layout.kept and len(source.triangles):
            triangles = np.asarray(source.triangles, dtype=np.float64)
            polygon = np.asarray(source.polygon, dtype=np.int64)
            page = each.page, pages[each.page].resolution
            found += stretched_faces(
                source.name, triangles, numbered(polygon), layout.charts.uv, each.uv, page
            )
    return found


def run_atlas(
    objects: Sequence[AtlasInput],
    resolution: int = 512,
    texel_density: float | None = None,
    shared: bool = True,
    **options: Any,
) -> Atlas:
    """Return the `Atlas` by some options."""
    return build_atlas(objects, AtlasOptions(resolution, texel_density, shared, **options))


_Laid = list[tuple[list[int], Packing]]
"""Per page the numbers of its objects, and how they lie there."""


def _lay_on_pages(layouts: list[_Layout], options: AtlasOptions, progress: Progress) -> _Laid:
    """Pack objects on as many pages as are requested or needed."""
    density = options.texel_density
    totals = _totals(layouts, options.limits.padding)
    count, wanted = len(layouts), [layout.source.page for layout in layouts]
    if options.shared:
        count = options.pages
        if density is not None:
            count = totals.least_pages(density, options.limits.side)
    count = max(count, *wanted)
    before: list[list[int]] = []
    while True:
        common = totals.density(float(count * options.resolution**2)) if density is None else density
        texels = totals.texels(common)
        groups = assign_pages(texels, count, wanted) if options.shared else [[each] for each in range(count)]
        laid: _Laid = []
        group: list[int] = []
        try:
            for group in groups:
                laid.append((group, _pack_group([layouts[each] for each in group], options, progress)))
        except BakeError:
            # What does not fit at the requested density may fit on more pages.
            if density is None or len(group) == 1 or groups == before:
                raise
            count, before = max(count, len(groups)) + 1, groups
            continue
        return laid


def _cut_empty(layouts: list[_Layout], options: AtlasOptions) -> list[_Layout]:
    """Cut charts that are mostly empty at about the density that there will be."""
    padding, density = options.limits.padding, options.texel_density
    if density is None:
        pages = options.pages if options.shared else len(layouts)
        density = _totals(layouts, padding).density(float(pages * options.resolution**2))
    free = [layout for layout in layouts if not layout.kept]
    counts = [len(layout.source.triangles) for layout in free]
    if not sum(counts):
        return layouts
    size = np.concatenate(
        [
            triangle_areas(np.asarray(each.source.triangles, dtype=np.float64)) * each.source.scale**2
            for each in free
        ]
    )
    polygon = np.concatenate([np.asarray(each.source.polygon, dtype=np.int64) for each in free])
    polygon = numbered(np.column_stack((np.repeat(np.arange(len(free)), counts), polygon)))
    together = join_charts([each.charts for each in free])
    charts = iter(split_charts(cut_empty_charts(together, polygon, size, density, padding), counts))
    return [layout if layout.kept else replace(layout, charts=next(charts)) for layout in layouts]


def _totals(layouts: list[_Layout], padding: int) -> ChartTotals:
    """Return the sums over each object's charts, at its scale."""
    areas = [_surface([layout]) * layout.source.scale**2 for layout in layouts]
    lengths = [
        float(chart_extents(layout.charts.uv, layout.charts.chart, layout.charts.count).sum())
        for layout in layouts
    ]
    counts = [float(layout.charts.count) for layout in layouts]
    return ChartTotals(np.array(areas), np.array(lengths), np.array(counts), padding)


def _pack_group(group: list[_Layout], options: AtlasOptions, progress: Progress) -> Packing:
    """Lay out one page, its kept UVs as they are where that is possible."""
    kept = _kept_as_they_are(group, options.resolution, options.texel_density, options.limits.side)
    if kept is not None:
        return kept
    return _pack_page(group, options.resolution, options.texel_density, options.limits, progress)


def _lay_flat(
    objects: Sequence[AtlasInput], options: AtlasOptions, warnings: list[BakeWarning], progress: Progress
) -> list[_Layout]:
    """Cut objects into charts, or take the UVs they have."""
    # A density's page is not known yet, and may be as large as any.
    probe = _PROBE if options.texel_density is not None else min(options.resolution, _PROBE)
    kept = [_kept_charts(source, probe, options, warnings) for source in objects]
    cut = [source for source, charts in zip(objects, kept, strict=True) if charts is None]
    found = iter(_unwrapped(cut, options, warnings, progress))
    return [
        _Layout(source, _scaled(next(found) if charts is None else charts, source.scale), charts is not None)
        for source, charts in zip(objects, kept, strict=True)
    ]


def _unwrapped(
    objects: Sequence[AtlasInput], options: AtlasOptions, warnings: list[BakeWarning], progress: Progress
) -> list[Charts]:
    """Cut objects into charts."""
    counts = [len(source.triangles) for source in objects]
    if not sum(counts):
        return [Charts(np.zeros((0, 3, 2)), np.zeros(0, dtype=np.int64), 0)] * len(objects)
    triangles = np.concatenate([np.asarray(each.triangles, np.float64).reshape(-1, 3, 3) for each in objects])
    polygon = np.concatenate([np.asarray(each.polygon, dtype=np.int64) for each in objects])
    owner = np.repeat(np.arange(len(objects)), counts)
    seconds = options.unwrap_seconds
    with PatientGrower(seconds, len(triangles), options.threads, progress.in_window) as grower:
        charts = unwrap(triangles, polygon, grower, progress, options.threads, owner, grower.close)
    for number in sorted(grower.gave_up):
        # Batches are numbered by object.
        name = objects[number].name
        warnings.append(
            BakeWarning(
                name,
                f"object '{name}' took more than {seconds:g} s to unwrap; the rest was cut by face "
                "direction, which makes more seams: give it a UV layer Lightmap and keep UVs, or simplify it",
            )
        )
    return split_charts(charts, counts)


def _scaled(charts: Charts, scale: float) -> Charts:
    """Return an object's charts at its own scale; one that is 1 changes no bit."""
    return charts if scale == 1.0 else replace(charts, uv=charts.uv * scale)


def _kept_charts(
    source: AtlasInput, probe: int, options: AtlasOptions, warnings: list[BakeWarning]
) -> Charts | None:
    """Take an object's UVs as one chart at world scale; None without any, with a warning for useless ones.

    Overlaps are searched for on a page of `probe` texels a side.
    """
    if source.uv is None:
        return None
    uv = source.uv.astype(np.float64)
    collapsed = options.texel_density is None and is_collapsed(uv, options.resolution)
    if not np.isfinite(uv).all() or not (has_area(uv) or collapsed):
        warnings.append(
            BakeWarning(source.name, "its Lightmap UVs have no area or are not numbers; unwrapped again")
        )
        return None
    if uv.min() < -1e-6 or uv.max() > 1 + 1e-6:
        warnings.append(
            BakeWarning(source.name, "its Lightmap UVs leave the unit square; what is outside gets no light")
        )
    elif overlaps(coverage_sum(source.uv, probe)):
        warnings.append(
            BakeWarning(source.name, "its Lightmap UVs overlap; faces that share texels show the same light")
        )
    chart = np.zeros(len(uv), dtype=np.int64)
    triangles = np.asarray(source.triangles, dtype=np.float64).reshape(-1, 3, 3)
    return Charts(rescale_to_area(uv, triangles, chart, 1), chart, 1)


def _kept_as_they_are(
    group: list[_Layout], resolution: int, density: float | None, largest: int
) -> Packing | None:
    """Return the page of kept UVs left bit for bit, None if they must be packed."""
    if not all(layout.kept for layout in group):
        return None
    kept = [layout.source.uv for layout in group if layout.source.uv is not None]
    uv = np.concatenate(kept).astype(np.float32, copy=False)
    if len(group) > 1 and not are_apart(kept, min(resolution, _PROBE)):
        return None
    surface = _surface(group)
    flat = float(0.5 * np.abs(signed_double_areas(uv.astype(np.float64))).sum())
    if density is not None:
        size = density * np.sqrt(surface / flat)
        if not size <= largest:
            raise BakeError(
                f"a texel density of {density:g} px/m needs a page above {largest} px for the kept "
                f"UVs of {group[0].source.name}: lower the density"
            )
        resolution = page_size(size)
    return Packing(uv, resolution, resolution * float(np.sqrt(flat / surface)) if surface > 0 else 0.0)


def _pack_page(
    group: list[_Layout], resolution: int, density: float | None, limits: Limits, progress: Progress
) -> Packing:
    """Pack the charts of several objects together; triangles without area get a harmless place."""
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
    places = chart_places(_corners(group)[used], chart[used], _share_groups(group)[used])
    try:
        packing = pack(uv[used], chart[used], resolution, density, limits, progress, places)
    except BakeError as error:
        alone = f"object '{group[0].source.name}': " if len(group) == 1 else ""
        raise BakeError(f"{alone}{error}{_greedy(group)[1]}") from None
    pages = np.empty(uv.shape, dtype=np.float32)
    pages[used] = packing.uv
    _park(pages, chart, [len(layout.source.triangles) for layout in group])
    return Packing(pages, packing.resolution, packing.density, packing.crowded)


def _share_groups(group: list[_Layout]) -> Int:
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


def _page(packing: Packing) -> AtlasPage:
    area = 0.5 * np.abs(signed_double_areas(packing.uv.astype(np.float64))).sum()
    return AtlasPage(packing.resolution, packing.density, min(float(area), 1.0))


def _surface(group: list[_Layout]) -> float:
    """Return the area of all triangles [m²]."""
    return float(triangle_areas(_corners(group)).sum())


def _corners(group: list[_Layout]) -> Float:
    return np.concatenate([np.asarray(layout.source.triangles, dtype=np.float64) for layout in group])


def _greedy(group: list[_Layout]) -> tuple[str, str]:
    """Return which object takes nearly all of the surface, and words on it; empty if none does."""
    surfaces = [_surface([layout]) * layout.source.scale**2 for layout in group]
    name = greedy_object([layout.source.name for layout in group], surfaces) or ""
    taken = share_of(max(surfaces), sum(surfaces)) if name else ""
    return name, name and f"; object '{name}' takes {taken} of the surface: lower its texel scale"


def _crowded(group: list[_Layout], resolution: int) -> BakeWarning:
    count = sum(layout.charts.count for layout in group)
    greedy, fix = _greedy(group)
    return BakeWarning(
        group[0].source.name if len(group) == 1 else greedy or "atlas",
        f"{resolution} px is too small to keep {count} charts apart, so light bleeds between them"
        + (fix or "; raise the resolution or the number of pages"),
    )
