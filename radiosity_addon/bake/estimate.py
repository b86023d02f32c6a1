"""Estimates of a bake before it begins: pages, texels, memory and time, by rule of thumb.

Nothing is unwrapped and no ray is traced. The rules were fitted to the Cornell box, the office and rooms of
a thousand to a million triangles (bench/results), two cores; tests hold them to a factor of 1.5 there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..base import SceneError, UsageError
from ..lightmap.unwrap import ChartTotals, Limits, assign_pages, padding_for, page_size
from ..lights import Lamp
from ..numerics import Array, give_back, thread_count
from ..options import BakeSettings
from ..scene import BakeScene
from ..solver.state import lit_sides
from .importance import Extent, justified_scales, may_thin_out
from .relight import are_wanted, check_groups
from .scene_memory import refuse_many_triangles, solving_bytes, waiting_bytes
from .texel_memory import least_bytes, pages_of, process_bytes, refuse_large_pages, room

CHARTS = 6.0
"""Charts of an object whose faces look all ways; a heavy mesh has more: one for this many …"""

TRIANGLES_A_CHART = 24.0
"""… triangles (the office)."""

MOST_GAPS = 0.12
"""Of `ChartTotals`: few charts are most of the surface, and the others need hardly any gaps. Fitted, as is
what charts fill of a page, to the classroom, the staircase, the office and the Cornell box at 512² and 1024²:
utilization and texels per meter are right within 10 % there."""

RAYS_IN_CHARTS = {"sketch": 28.0, "draft": 47.0, "medium": 120.0, "high": 390.0}
"""Rays for each texel of a large chart, …"""

RAYS_AT_EDGES = 5200.0
"""… and this / √n more in charts of n texels, at medium quality: texels next to others are divided."""

MOST_AT_EDGES = 700.0
"""All texels are next to others where charts are small; more rays than these none of them takes."""

WORK = {"sketch": 0.42, "draft": 0.65, "medium": 1.0, "high": 1.65}
"""Times as much work at edges and for sources: finer points share what is done once."""

SECONDS_A_RAY, SECONDS_A_SOURCE = 0.25e-6, 18e-6
"""Of a ray, with all that is done with what it meets; of a texel at medium quality for each lamp, patch of
the sky and emissive object: on two cores that take 13.4 s for 256 samples of Cycles in the Cornell box of
bench. Fitted to that box, an office, homes, a classroom and a staircase."""

MOST_SOURCES = 64
"""More are grouped."""

SOLVE_SECONDS = {"sketch": 0.055, "draft": 0.07, "medium": 0.07, "high": 0.07}
"""Time to solve a scene of one triangle; others by the number of triangles to the power 0.45."""

UNWRAP_SECONDS, KEPT_SECONDS = 25e-6, 3e-6
"""A triangle's time to be unwrapped, and if its layout is kept."""

FIND_SECONDS, FIND_KEPT_SECONDS, FIND_TEXEL_SECONDS = 15e-6, 3e-6, 7e-6
"""The same to be found again on the page, and each texel's."""

ENCODE_SECONDS, REPORT_SECONDS = 1.5e-6, 6e-6
"""A texel's time to be put on its page, with its seams, and an unwrapped triangle's to be reported on."""

CORES = 2
"""Of the machine all this was measured on; more help by the power 0.6."""

BYTES_A_RAY, BYTES_A_TEXEL, BYTES_A_PIXEL, BYTES_AT_LEAST = 8.5, 380.0, 40.0, 30e6
"""Memory of texels, which is in files beyond the memory limit: what a ray met is kept while light is swept;
where texels lie, and their light; the pages."""

UNSURE = 0.8
"""Pages that follow from a density are refused before they are laid out if so much of their width would."""


@dataclass(frozen=True)
class LightmappedObject:
    """An object that is to get a lightmap.

    area: In world space [m²].
    scale: Its texels per meter, relative to the other objects.
    box (2, 3): Around it [m]; None if it is not known.
    keeps_uvs: Whether its layout is kept.
    page: The shared page that it is to be on, from 1; 0 for any.
    """

    name: str
    triangles: int
    area: float
    scale: float = 1.0
    box: Array | None = None
    keeps_uvs: bool = False
    page: int = 0

    @property
    def surface(self) -> float:
        """Its share of the texels [m² of objects at scale 1]."""
        return self.area * self.scale**2

    @property
    def charts(self) -> float:
        """About how many charts it has; of a layout that is kept nothing is known, and people make few."""
        if self.keeps_uvs:
            return min(self.triangles / 2.0, CHARTS)
        return max(min(self.triangles / 2.0, CHARTS), self.triangles / TRIANGLES_A_CHART)


class StageSeconds(NamedTuple):
    """How long each stage of a bake takes [s]."""

    unwrap: float
    rasterize: float
    solve: float
    light: float
    encode: float


@dataclass(frozen=True)
class Estimate:
    """What a bake will be.

    pages: Each page's width and height in texels.
    texels: Parallel to the objects: about how many each gets.
    densities: Parallel to the objects: about how many texels per meter.
    thinned: Parallel to the objects: below 1 for those that reach far beyond the others.
    memory: What this process takes at the peak, with what it takes now [bytes], …
    files: … and what does not fit into the memory limit: temporary files take it [bytes].
    seconds: None where it depends on the results: bakes to a target error, and methods for study.
    stages: How long each stage takes by the hierarchical method [s]; of another method, or to a target error,
        only how they compare.
    """

    pages: tuple[int, ...]
    texels: tuple[float, ...]
    memory: float
    files: float
    seconds: float | None
    stages: StageSeconds
    densities: tuple[float, ...] = ()
    thinned: tuple[float, ...] = ()

    @property
    def utilization(self) -> float:
        """About which part of the pages shows a surface."""
        return min(sum(self.texels) / max(sum(page**2 for page in self.pages), 1), 1.0)


def estimate_bake(
    objects: Sequence[LightmappedObject],
    triangles: int,
    settings: BakeSettings,
    faces: int | None = None,
    textures: float = 0.0,
    sources: int = 1,
) -> Estimate:
    """Reckon what a bake will be.

    objects: Those that get a lightmap.
    triangles: Of the whole scene, what only lights and blocks among them.
    faces: Their sides that take part in the light; None for both of each.
    textures: What evaluating the materials will take [bytes]: 0 once that is done.
    sources: Lamps, bright patches of the sky and emissive objects.
    """
    faces = 2 * triangles if faces is None else faces
    thinned = _thinned(objects, settings)
    objects = [replace(item, scale=item.scale * scale) for item, scale in zip(objects, thinned, strict=True)]
    pages, texels = _pages(objects, settings)
    total = sum(texels)
    crowded = math.sqrt(sum(item.charts for item in objects) / max(total, 1.0))
    at_edges = WORK[settings.quality] * min(RAYS_AT_EDGES * crowded, MOST_AT_EDGES)
    rays = total * (RAYS_IN_CHARTS[settings.quality] + at_edges)
    of_texels = (
        BYTES_AT_LEAST
        + BYTES_A_RAY * rays
        + BYTES_A_TEXEL * total
        + BYTES_A_PIXEL * sum(page**2 for page in pages)
    )
    # Only what belongs to texels can be in files.
    of_scene = waiting_bytes(triangles, faces)
    most = max(room(settings) - textures - of_scene, least_bytes(pages, settings))
    kept = sum(item.triangles for item in objects if item.keeps_uvs)
    stages = _stages(triangles, kept, total, rays, sources, settings)
    known = settings.method == "hierarchical" and settings.relative_error is None
    in_memory = min(of_texels, most)
    densities = tuple(
        math.sqrt(count / item.area) if item.area > 0 else 0.0
        for count, item in zip(texels, objects, strict=True)
    )
    return Estimate(
        tuple(pages),
        tuple(texels),
        process_bytes() + textures + max(of_scene + in_memory, solving_bytes(triangles, faces, settings)),
        of_texels - in_memory,
        sum(stages) if known else None,
        stages,
        densities,
        tuple(thinned),
    )


def estimate_of(bake_scene: BakeScene, settings: BakeSettings) -> Estimate:
    """Reckon what a bake of an exported scene will be."""
    areas, triangles = bake_scene.scene.areas, bake_scene.scene.triangles
    objects = [
        LightmappedObject(
            item.name,
            item.count,
            float(areas[item.rows] @ item.lit),
            item.texel_scale * item.thinning,
            np.stack([triangles[item.rows].min(axis=(0, 1)), triangles[item.rows].max(axis=(0, 1))]),
            item.uv is not None,
            item.page,
        )
        for item in bake_scene.objects
        if item.bake and item.count
    ]
    scene = bake_scene.scene
    emits = scene.emission.any(axis=1)
    sources = sum(isinstance(light, Lamp) for light in scene.lights)
    sources += sum(bool(emits[item.rows].any()) for item in bake_scene.objects)
    return estimate_bake(objects, len(scene), settings, sources=sources)


def _stages(
    triangles: int, kept: int, texels: float, rays: float, sources: int, settings: BakeSettings
) -> StageSeconds:
    """Return how long stages take. `kept` of the triangles keep their layout."""
    of_sources = WORK[settings.quality] * SECONDS_A_SOURCE * texels * min(sources, MOST_SOURCES)
    parallel = (CORES / thread_count(settings.threads)) ** 0.6
    return StageSeconds(
        unwrap=UNWRAP_SECONDS * (triangles - kept) + KEPT_SECONDS * kept,
        rasterize=FIND_SECONDS * (triangles - kept) + FIND_KEPT_SECONDS * kept + FIND_TEXEL_SECONDS * texels,
        solve=parallel * SOLVE_SECONDS[settings.quality] * max(triangles, 1) ** 0.45,
        light=parallel * (SECONDS_A_RAY * rays + of_sources),
        encode=ENCODE_SECONDS * texels + REPORT_SECONDS * (triangles - kept),
    )


def _thinned(objects: Sequence[LightmappedObject], settings: BakeSettings) -> list[float]:
    """Return a factor for each object's scale, below 1 for one that reaches far beyond the others."""
    if not may_thin_out(settings) or any(item.box is None for item in objects):
        return [1.0] * len(objects)
    return justified_scales(
        [
            Extent(item.box, item.surface, item.scale == 1.0 and not item.keeps_uvs, item.triangles)
            for item in objects
            if item.box is not None
        ]
    )


def refuse_bake(bake_scene: BakeScene, settings: BakeSettings, *, keep: bool) -> None:
    """Refuse what cannot be baked, as far as that is known before unwrapping: areas tell the pages' size.

    Raises SceneError if no object is to get a lightmap.
    Raises UsageError if the bake cannot be kept as wanted, its light groups do not fit the scene, or it will
        not fit into the memory limit (`refuse_many_triangles`, `refuse_large_pages`).
    """
    grouped = are_wanted(bake_scene, settings)
    if (keep or grouped) and settings.quantity == "residual":
        raise UsageError("a residual is of all light together: bake another quantity to relight it")
    if grouped:
        check_groups(bake_scene, settings)
    if not any(item.bake and item.count for item in bake_scene.objects):
        raise SceneError("nothing to bake: give the scene a render-visible mesh with faces")
    faces = lit_sides(bake_scene.scene)
    give_back()  # what the export freed, and finding closed solids
    refuse_many_triangles(len(bake_scene.scene), faces, settings)
    sizes = pages_of(settings)
    if sizes is None:
        sizes = estimate_of(bake_scene, settings).pages
    if settings.texel_density is not None:
        # It is known roughly; what unwrapping finds decides.
        sizes = tuple(int(UNSURE * size) for size in sizes)
    refuse_large_pages(sizes, settings)


def _pages(objects: Sequence[LightmappedObject], settings: BakeSettings) -> tuple[list[int], list[float]]:
    """Return the size of each page, and about how many texels each object gets."""
    padding = padding_for(settings.mip_levels) if settings.padding is None else settings.padding
    largest, density = Limits(settings.max_resolution, padding).side, settings.texel_density
    totals, count = _totals(objects, padding), settings.pages
    taken = totals.texels(totals.density(count * settings.resolution**2) if density is None else density)
    if density is not None:
        count = math.ceil(float(taken.sum()) / largest**2)
    shared = settings.atlas != "per-object"
    wanted = [item.page for item in objects]
    groups = assign_pages(taken, count, wanted) if shared else [[each] for each in range(len(objects))]
    pages, texels = [], [0.0] * len(objects)
    for group in groups:
        size, finest = settings.resolution, density
        if finest is None:
            finest = _totals([objects[number] for number in group], padding).density(size**2)
        else:
            size = min(page_size(math.sqrt(float(taken[group].sum()))), largest)
        pages.append(size)
        for number in group:
            texels[number] = objects[number].surface * finest**2
    return pages, texels


def _totals(objects: Sequence[LightmappedObject], padding: int) -> ChartTotals:
    """Take each object's charts for squares of the same size."""
    area = np.array([item.surface for item in objects], dtype=np.float64)
    count = np.array([item.charts for item in objects], dtype=np.float64)
    return ChartTotals(area, 2.0 * np.sqrt(area * count), count, padding, MOST_GAPS)
