"""The bake as prose: unwrap, rasterize, solve, light, encode. Canceled or failed, it touched nothing else."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base import SILENT, BakeError, Progress
from ..lightmap.images import LightmapPage, Seams, find_seams, texel_pages
from ..lightmap.lighting import (
    LightSoFar,
    light_texels,
    light_within,
    residual_summary,
    texel_residual,
)
from ..lightmap.texels import FOOTPRINT, TexelGeometry, rasterize, texel_materials
from ..lightmap.transport import GatherSettings, TexelLight
from ..lightmap.unwrap import Atlas
from ..lights import grouped
from ..numerics import Array, Scratch, give_back, one_blas_thread, tiles
from ..options import BakeSettings
from ..rays import RayCaster
from ..scene import BakeObject, BakeScene
from ..solver import Solution, SolverSettings, SolverState, solve
from ..solver.element_transport import Relightable
from .bake_warnings import coincident_counts, of_coincident, of_kept_lamps, of_solution, small_objects
from .estimate import estimate_of, refuse_bake
from .layout import lay_out, padding
from .levels import with_levels
from .quality import MOST_RAYS, for_error, quality_of, used_settings
from .relight import (
    HierarchyReport,
    IncrementalState,
    KeptBake,
    are_wanted,
    group_pages,
    held_values,
)
from .result import (
    BakeResult,
    LightGroup,
    More,
    Picture,
    TexelPictures,
    baked_with_figures,
    more_of,
    solver_part,
)
from .stages import StageTimes, timed
from .texel_memory import refuse_large_pages, share_out_memory, texel_scratch
from .turned_faces import of_turned_faces


@dataclass(frozen=True, eq=False)
class TexelValues:
    """What texels hold, (n, 3), and what it was made of: a residual of nothing else."""

    values: Array
    caster: RayCaster
    light: TexelLight | None = None
    relightable: Relightable | None = None
    materials: tuple[Array, Array] | None = None


MOST_SHOWN = 1 << 22
"""More texels than these are not shown while they are lit: their pictures would take too much memory."""

DILATED = 8
"""Texels past the charts that are filled ring by ring, if not more are free."""

LAMPS_PER_RAY = 16
"""More lamps than so many for each shadow ray of one are grouped, or share rays if they are kept apart: alone
each asks two rays at least, together they ask 64 times as many as one where most of them disagree."""

RAYS_OF_MANY = 2
"""Times as many gather rays where many lamps are kept: few meet what one of them makes bright."""

PICTURE_SECONDS = 0.25
"""Time between two pictures of the solution: often enough to watch, too rarely to cost much."""


def bake(bake_scene: BakeScene, settings: BakeSettings, progress: Progress = SILENT) -> BakeResult:
    """Bake lightmaps for a scene.

    progress: Gets stages, and pictures of what is solved and lit.
    Raises SceneError if no object is to get a lightmap.
    Raises BakeError if the lightmaps cannot be laid out.
    """
    result, _ = _bake(bake_scene, settings, are_wanted(bake_scene, settings), progress)
    return result


def bake_and_keep(
    bake_scene: BakeScene, settings: BakeSettings, progress: Progress = SILENT
) -> tuple[BakeResult, KeptBake]:
    """Bake lightmaps, and keep what relighting needs (`kept_bake.py`).

    Every lamp gets shadow rays of its own, also those that are dark now, so that scenes of
    many lamps take longer than by `bake`. Parameters and errors are those of `bake`.

    Raises UsageError if the method keeps no links, or the quantity is the residual.
    """
    result, kept = _bake(bake_scene, settings, True, progress)
    assert kept is not None
    return result, kept


@one_blas_thread()
def _bake(
    bake_scene: BakeScene, settings: BakeSettings, keep: bool, progress: Progress
) -> tuple[BakeResult, KeptBake | None]:
    """Bake, and keep what relighting needs if asked to."""
    seconds = StageTimes()
    refuse_bake(bake_scene, settings, keep=keep)
    quality, baked = quality_of(settings), baked_objects(bake_scene)
    plan = estimate_of(bake_scene, settings)
    stages = plan.stages
    unwrapping, rasterizing, rest = progress.expecting([stages.unwrap, stages.rasterize, sum(stages[2:])])
    part = unwrapping.stage("unwrap", 0.0, 1.0)
    part.at(0.0)
    with timed(seconds, "unwrap"):
        atlas = lay_out(bake_scene, baked, settings, part)
    rasterizing.stage("rasterise", 0.0, 1.0).at(0.0)
    sizes = [page.resolution for page in atlas.pages]
    refuse_large_pages(sizes, settings)
    scratch = texel_scratch(sizes, settings)
    with timed(seconds, "rasterise"):
        geometry = texels_of(bake_scene, baked, atlas, scratch)
    give_back()
    # Texels are known now, and the time to light them is about in proportion.
    lighting_seconds = stages.light * len(geometry) / max(sum(plan.texels), 1.0)
    solving, lighting, encoding = rest.expecting([stages.solve, lighting_seconds, stages.encode])
    with timed(seconds, "solve"):
        solution = solve_scene(bake_scene, quality.solver, solving)
    lighting.stage("light", 0.0, 1.0).at(0.0)
    give_back()
    is_shown = share_out_memory(geometry, settings, keep, solution.n_elements)
    with timed(seconds, "light"):
        so_far = LightSoFar() if is_shown and len(geometry) <= MOST_SHOWN else None
        look = None if so_far is None else TexelPictures(so_far).next
        part = lighting.stage("light", 0.0, 1.0, look)
        lit = _texel_values(bake_scene, solution, geometry, quality.gather, settings, keep, so_far, part)
        del so_far, look, part
    encoding.stage("encode", 0.0, 0.0).at(0.0)
    report = solver_part(solution.final_report(), used_settings(quality.solver), bake_scene.objects)
    glass = [item.name for item in bake_scene.objects if item.glass is not None]
    report |= {"glass": glass} if glass else {}
    warnings = (
        *atlas.warnings,
        *of_turned_faces(bake_scene, baked, solution, geometry, lit.light),
        *of_solution(solution, quality.solver),
        *of_kept_lamps(lit.relightable),
    )
    solved = HierarchyReport(report, warnings)
    more = more_of(solution, baked, geometry, lit.light, settings.light)
    del solution  # its elements take as much as seams need
    give_back()
    return finish(bake_scene, settings, atlas, geometry, solved, lit, more, seconds, encoding)


def finish(
    bake_scene: BakeScene,
    settings: BakeSettings,
    atlas: Atlas,
    geometry: TexelGeometry,
    solved: HierarchyReport,
    lit: TexelValues,
    more: More,
    seconds: StageTimes,
    progress: Progress,
) -> tuple[BakeResult, KeptBake | None]:
    """Put texel values on pages, and report the bake; data to keep goes into the kept bake."""
    baked = baked_objects(bake_scene)
    progress.stage("encode", 0.0, 0.0).at(0.0)
    with timed(seconds, "encode"):
        seams = _seams(bake_scene, lit.caster, geometry, settings)
        rings = max(DILATED, padding(settings))
        pages = texel_pages(geometry, lit.values, seams, rings)
        _check(solved.report, pages)
    kept = None
    if lit.relightable and lit.materials and lit.light is not None and lit.light.kept is not None:
        reflectance, emission = lit.materials
        moves = None if lit.light.traced is None else IncrementalState(atlas, lit.light.traced, solved)
        kept = KeptBake(
            bake_scene,
            settings,
            solved=lit.relightable,
            lit=lit.light.kept,
            geometry=geometry,
            seams=seams,
            rings=rings,
            reflectance=reflectance,
            emission=emission,
            moves=moves,
        )
    groups: tuple[LightGroup, ...] = ()
    if kept is not None and are_wanted(bake_scene, settings):
        with timed(seconds, "groups"):
            groups = group_pages(kept, pages, progress=progress.stage("groups", 0.0, 1.0))

    report = dict(solved.report)
    if lit.light is not None:
        report["estimated_error"] = lit.light.error
    if settings.quantity == "residual":
        report["error_picture"] = residual_summary(lit.values)
    of_texels = small_objects(bake_scene, baked, geometry)
    coincident = coincident_counts(baked, bake_scene.scene)
    warnings = (*bake_scene.warnings, *of_texels, *of_coincident(coincident), *solved.warnings)
    pages_of = [placed.page for placed in atlas.objects]
    objects = baked_with_figures(baked, pages_of, geometry, bake_scene.scene.areas)
    light, details = more
    shown = with_levels(bake_scene, objects)
    if light:
        light = (*light, *({},) * (len(shown) - len(objects)))
    result = BakeResult(
        pages,
        shown,
        solver=report,
        warnings=warnings,
        seconds=seconds,
        performance=seconds.performance(len(geometry)),
        atlas=_page_facts(atlas, pages),
        groups=groups,
        light=light,
        coincident=coincident,
        details=details,
    )
    return result, kept


def baked_objects(bake_scene: BakeScene) -> list[BakeObject]:
    """Return the objects that get lightmaps."""
    return [item for item in bake_scene.objects if item.bake and item.count]


def texels_of(
    bake_scene: BakeScene, baked: list[BakeObject], atlas: Atlas, scratch: Scratch
) -> TexelGeometry:
    """Find the texels that the objects cover, and where they lie in the world."""
    count = len(bake_scene.scene)
    uv = np.zeros((count, 3, 2), dtype=np.float32)
    page_of_triangle = np.full(count, -1, dtype=np.int32)
    for item, placed in zip(baked, atlas.objects, strict=True):
        uv[item.rows] = placed.uv
        page_of_triangle[item.rows] = np.where(item.lit, placed.page, -1)
    # Triangles without area have no side to be lit from, even if their UVs have one.
    page_of_triangle[bake_scene.scene.areas == 0] = -1
    rows = [np.flatnonzero(page_of_triangle == page) for page in range(len(atlas.pages))]
    areas = bake_scene.scene.areas
    texels = [
        rasterize(uv[of], page.resolution, scratch, areas[of])
        for of, page in zip(rows, atlas.pages, strict=True)
    ]
    return TexelGeometry(bake_scene.scene, uv, page_of_triangle, texels, rows, scratch)


def solve_scene(bake_scene: BakeScene, settings: SolverSettings, progress: Progress) -> Solution:
    """Solve, many lamps as groups, with a picture of the solution at first, now and then, and at the end."""
    next_picture, last = 0.0, None

    def look(state: SolverState | None) -> Picture | None:
        nonlocal next_picture, last
        last = last if state is None else state
        if state is None or time.perf_counter() < next_picture:
            return None
        picture = _picture(state)
        next_picture = time.perf_counter() + PICTURE_SECONDS
        return picture

    solving = progress.stage("solve", 0.0, 1.0, look)
    solving.at(0.0)
    scene = bake_scene.scene
    scene = scene.with_lights(grouped(scene.lights, most=LAMPS_PER_RAY * settings.shadow_rays))
    solution = solve(scene, settings, solving)
    next_picture = 0.0
    solving.at(1.0, last)
    return solution


def _picture(state: SolverState) -> Picture | None:
    """Return what the solution looks like now; None while new elements have no radiosity yet."""
    hierarchy, radiosity = state.hierarchy, state.shown()
    if len(radiosity) < hierarchy.n_elements:
        return None
    leaves = hierarchy.leaves
    face = hierarchy.face[leaves]
    return Picture(
        hierarchy.corners[leaves].astype(np.float32),
        radiosity[leaves].astype(np.float32),
        hierarchy.faces.triangle[face],
        hierarchy.faces.front[face],
    )


def _texel_values(
    bake_scene: BakeScene,
    solution: Solution,
    geometry: TexelGeometry,
    gather: GatherSettings,
    settings: BakeSettings,
    keep: bool,
    so_far: LightSoFar | None,
    progress: Progress,
) -> TexelValues:
    """Compute the requested quantity at all texels, and estimate the light's relative error."""
    if settings.quantity == "residual":
        residual = texel_residual(solution, geometry, gather, progress)
        return TexelValues(residual, solution.local_pass.caster)
    relightable = None
    if keep:
        most = LAMPS_PER_RAY * quality_of(settings).solver.shadow_rays
        relightable = solution.relightable(bake_scene.emitter, bake_scene.scene.lights, most)
    local = solution.local_pass if relightable is None else relightable.local
    if local.direct.many:
        gather = replace(gather, rays=RAYS_OF_MANY * gather.rays)
    if settings.relative_error is None:
        light = light_texels(bake_scene.scene, local, geometry, gather, so_far=so_far, progress=progress)
    else:
        light = light_within(
            bake_scene.scene,
            local,
            geometry,
            for_error(settings.relative_error).gather,
            settings.relative_error,
            MOST_RAYS,
            so_far=so_far,
            progress=progress,
        )
    if not keep:
        # Hits were looked up in it: it is large, and stays in memory.
        light = replace(light, table=None)
    reflectance, emission = texel_materials(bake_scene.scene, geometry, FOOTPRINT)
    values = held_values(light, reflectance, emission, settings, geometry.scratch)
    return TexelValues(values, local.caster, light, relightable, (reflectance, emission))


def _seams(
    bake_scene: BakeScene, caster: RayCaster, geometry: TexelGeometry, settings: BakeSettings
) -> Seams | None:
    """Find the seams to stitch; None for an error picture, which is to show what is there."""
    if settings.quantity == "residual":
        return None
    seams = find_seams(bake_scene.scene, geometry, caster)
    return seams if settings.quantity != "radiosity" else seams.of_one_material(bake_scene.scene)


def _check(report: dict[str, Any], pages: tuple[LightmapPage, ...]) -> None:
    """Refuse to hand out a result that is not finite: a defect must not look like a dark room."""
    finite = all(
        np.isfinite(page.pixels[rows]).all() for page in pages for rows in tiles(len(page.pixels), 256)
    )
    if not np.isfinite(report["residual"]) or not finite:
        raise BakeError(
            "the solution is not finite: this is a bug of the solver; please report it with the scene, "
            "and try another quality"
        )


def _page_facts(atlas: Atlas, pages: tuple[LightmapPage, ...]) -> tuple[dict[str, Any], ...]:
    """Return what the report says of each page."""
    return tuple(
        {
            "resolution": laid.resolution,
            "texels_per_metre": laid.density,
            "utilisation": float(page.coverage.mean()),
            "objects": sum(item.page == number for item in atlas.objects),
            "stretched": _stretched(atlas, number),
        }
        for number, (laid, page) in enumerate(zip(atlas.pages, pages, strict=True))
    )


def _stretched(atlas: Atlas, page: int) -> dict[str, int]:
    """Return how many triangles of a page have stretched texels, by reason."""
    counts: dict[str, int] = {}
    for each in atlas.stretched:
        if each.page == page:
            counts[each.reason] = counts.get(each.reason, 0) + each.faces
    return counts
