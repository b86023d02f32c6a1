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
from .cut_empty import cut_empty_charts
from .distortion import Stretched, stretched_faces, stretched_warnings
from .kept_uvs import are_apart, has_area, is_collapsed, overlaps
from .layouts import Layout, greedy_of, pack_page, surface_of
from .packing import Packing, page_size
from .page_assignment import ChartTotals, assign_pages
from .same_shapes import same_shapes

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
    shape = same_shapes(objects) if options.rectangles else list(range(len(objects)))
    different = sorted(set(shape))
    flat = _lay_flat([objects[each] for each in different], options, warnings, progress.part(0.0, 0.7))
    by_shape = dict(zip(different, _cut_empty(flat, options), strict=True))
    layouts = [
        replace(by_shape[each], source=source, shape=each)
        for source, each in zip(objects, shape, strict=True)
    ]
    laid = _lay_on_pages(layouts, options, progress.part(0.7, 1.0))
    placed: list[AtlasObject | None] = [None] * len(layouts)
    for number, (group, packing) in enumerate(laid):
        if packing.crowded:
            warnings.append(_crowded([layouts[each] for each in group], packing.resolution))
        ends = np.cumsum([len(layouts[each].source.triangles) for each in group])
        for each, uv in zip(group, np.split(packing.uv, ends[:-1]), strict=True):
            placed[each] = AtlasObject(uv, number)
    pages = tuple(_page(packing) for _, packing in laid)
    if options.shared and options.texel_density is None and len(pages) < options.pages:
        used = f"only {len(pages)} of {options.pages} pages {'is' if len(pages) == 1 else 'are'} used"
        warnings.append(BakeWarning("scene", f"{used}: all of an object lies on one page", is_note=True))
    all_placed = tuple(each for each in placed if each is not None)
    stretched = _stretched(layouts, all_placed, pages)
    return Atlas(all_placed, pages, (*warnings, *stretched_warnings(stretched)), tuple(stretched))


def _stretched(
    layouts: list[Layout], placed: tuple[AtlasObject, ...], pages: tuple[AtlasPage, ...]
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


def _lay_on_pages(layouts: list[Layout], options: AtlasOptions, progress: Progress) -> _Laid:
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


def _cut_empty(layouts: list[Layout], options: AtlasOptions) -> list[Layout]:
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


def _totals(layouts: list[Layout], padding: int) -> ChartTotals:
    """Return the sums over each object's charts, at its scale."""
    areas = [surface_of([layout]) * layout.source.scale**2 for layout in layouts]
    lengths = [
        float(chart_extents(layout.charts.uv, layout.charts.chart, layout.charts.count).sum())
        for layout in layouts
    ]
    counts = [float(layout.charts.count) for layout in layouts]
    return ChartTotals(np.array(areas), np.array(lengths), np.array(counts), padding)


def _pack_group(group: list[Layout], options: AtlasOptions, progress: Progress) -> Packing:
    """Lay out one page, its kept UVs as they are where that is possible."""
    kept = _kept_as_they_are(group, options.resolution, options.texel_density, options.limits.side)
    if kept is not None:
        return kept
    return pack_page(group, options, progress)


def _lay_flat(
    objects: Sequence[AtlasInput], options: AtlasOptions, warnings: list[BakeWarning], progress: Progress
) -> list[Layout]:
    """Cut objects into charts, or take the UVs they have."""
    # A density's page is not known yet, and may be as large as any.
    probe = _PROBE if options.texel_density is not None else min(options.resolution, _PROBE)
    kept = [_kept_charts(source, probe, options, warnings) for source in objects]
    cut = [source for source, charts in zip(objects, kept, strict=True) if charts is None]
    found = iter(_unwrapped(cut, options, warnings, progress))
    return [
        Layout(
            source, _scaled(next(found) if charts is None else charts, source.scale), charts is not None, row
        )
        for row, (source, charts) in enumerate(zip(objects, kept, strict=True))
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
    # Batches are numbered by object.
    for number in sorted(grower.gave_up | grower.crashed):
        name = objects[number].name
        what = "crashed xatlas" if number in grower.crashed else f"took more than {seconds:g} s to unwrap"
        warnings.append(
            BakeWarning(
                name,
                f"object '{name}' {what}; the rest was cut by face "
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
    group: list[Layout], resolution: int, density: float | None, largest: int
) -> Packing | None:
    """Return the page of kept UVs left bit for bit, None if they must be packed."""
    if not all(layout.kept for layout in group):
        return None
    kept = [layout.source.uv for layout in group if layout.source.uv is not None]
    uv = np.concatenate(kept).astype(np.float32, copy=False)
    if len(group) > 1 and not are_apart(kept, min(resolution, _PROBE)):
        return None
    surface = surface_of(group)
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


def _page(packing: Packing) -> AtlasPage:
    area = 0.5 * np.abs(signed_double_areas(packing.uv.astype(np.float64))).sum()
    return AtlasPage(packing.resolution, packing.density, min(float(area), 1.0))


def _crowded(group: list[Layout], resolution: int) -> BakeWarning:
    count = sum(layout.charts.count for layout in group)
    greedy, fix = greedy_of(group)
    return BakeWarning(
        group[0].source.name if len(group) == 1 else greedy or "atlas",
        f"{resolution} px is too small to keep {count} charts apart, so light bleeds between them"
        + (fix or "; raise the resolution or the number of pages"),
    )
