"""The bake as prose: unwrap, rasterise, solve, light the texels, encode.

A generator: each step yields `Progress`, so that a headless caller may exhaust it and a
window may advance it between two redraws. Closing it cancels; nothing outside was touched.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import TypeVar

import numpy as np

from .bake_scene import (
    BakedObject,
    BakeObject,
    BakeResult,
    BakeScene,
    BakeWarning,
    LightmapPage,
    Progress,
)
from .errors import BakeError, SceneError
from .lightmap.atlas import Atlas, AtlasInput, build_atlas
from .lightmap.dilate import dilate
from .lightmap.encode import to_quantity
from .lightmap.rasterise import rasterise
from .lightmap.reconstruct import reconstruct
from .lightmap.sweeps import TexelLight
from .lightmap.texel_geometry import TexelGeometry
from .quality import quality_of
from .settings import BakeSettings
from .solver import Solution, solve_progress

T = TypeVar("T")

UNWRAP, RASTERISE, SOLVE, LIGHT, ENCODE = 0.0, 0.15, 0.2, 0.5, 0.97
"""How far the whole is when each stage begins; rough, from bakes at medium quality."""


def bake(bake_scene: BakeScene, settings: BakeSettings) -> Generator[Progress, None, BakeResult]:
    """Bake lightmaps for a scene.

    Parameters
    ----------
    bake_scene : BakeScene
    settings : BakeSettings

    Yields
    ------
    progress : Progress

    Returns
    -------
    result : BakeResult

    Raises
    ------
    SceneError
        If no object is to get a lightmap.
    BakeError
        If the lightmaps cannot be laid out.
    """
    seconds: dict[str, float] = {}
    quality = quality_of(settings)
    baked = [item for item in bake_scene.objects if item.bake and item.count]
    if not baked:
        raise SceneError("nothing to bake: give the scene a render-visible mesh with faces")

    yield Progress("unwrap", UNWRAP)
    with _timed(seconds, "unwrap"):
        atlas = yield from _unwrap(bake_scene, baked, settings)
    yield Progress("rasterise", RASTERISE)
    with _timed(seconds, "rasterise"):
        geometry = _texels(bake_scene, baked, atlas)
    yield Progress("solve", SOLVE)
    with _timed(seconds, "solve"):
        steps = solve_progress(bake_scene.scene, quality.solver)
        solution = yield from _staged(steps, "solve", SOLVE, LIGHT)
    yield Progress("light", LIGHT)
    with _timed(seconds, "light"):
        texels = reconstruct(bake_scene.scene, solution.local_pass, geometry, quality.gather)
        light = yield from _staged(texels, "light", LIGHT, ENCODE)
    yield Progress("encode", ENCODE)
    with _timed(seconds, "encode"):
        pages = _encode(bake_scene, geometry, light, settings)
        _check(solution, pages)

    report = solution.final_report()
    warnings = (*bake_scene.warnings, *atlas.warnings, *_of_solution(solution))
    objects = tuple(
        BakedObject(item, placed.uv, placed.page) for item, placed in zip(baked, atlas.objects, strict=True)
    )
    return BakeResult(pages, objects, report, warnings, seconds)


def _unwrap(
    bake_scene: BakeScene, baked: list[BakeObject], settings: BakeSettings
) -> Generator[Progress, None, Atlas]:
    """Lay the objects' charts out on pages."""
    inputs = [
        AtlasInput(item.name, bake_scene.scene.triangles[item.rows], item.polygon, item.uv) for item in baked
    ]
    steps = build_atlas(inputs, settings.resolution, settings.texel_density, settings.atlas == "shared")
    for step in steps:
        if isinstance(step, Atlas):
            return step
        yield Progress("unwrap", UNWRAP + (RASTERISE - UNWRAP) * step)
    raise AssertionError("the atlas ended without a result")


def _texels(bake_scene: BakeScene, baked: list[BakeObject], atlas: Atlas) -> TexelGeometry:
    """Find the texels that the objects cover, and where they lie in the world."""
    count = len(bake_scene.scene)
    uv = np.zeros((count, 3, 2), dtype=np.float32)
    page_of_triangle = np.full(count, -1, dtype=np.int32)
    for item, placed in zip(baked, atlas.objects, strict=True):
        uv[item.rows] = placed.uv
        page_of_triangle[item.rows] = placed.page
    rows = [np.flatnonzero(page_of_triangle == page) for page in range(len(atlas.pages))]
    texels = [rasterise(uv[of], page.resolution) for of, page in zip(rows, atlas.pages, strict=True)]
    return TexelGeometry(bake_scene.scene, uv, page_of_triangle, texels, rows)


def _staged(
    steps: Generator[float, None, T], stage: str, begin: float, end: float
) -> Generator[Progress, None, T]:
    """Run steps that yield the fraction they have done as one stage, from `begin` to `end` of the whole."""
    while True:
        try:
            fraction = next(steps)
        except StopIteration as done:
            result: T = done.value
            return result
        yield Progress(stage, begin + (end - begin) * fraction)


def _encode(
    bake_scene: BakeScene, geometry: TexelGeometry, light: TexelLight, settings: BakeSettings
) -> tuple[LightmapPage, ...]:
    """Turn irradiance into pages of the quantity asked for, filled past the charts' borders."""
    irradiance = {
        "all": light.direct + light.indirect,
        "direct": light.direct,
        "indirect": light.indirect,
    }[settings.light]
    scene = bake_scene.scene
    emission = scene.emission[geometry.triangle]
    if settings.light == "indirect":
        emission = np.zeros_like(emission)
    values = to_quantity(irradiance, scene.reflectance[geometry.triangle], emission, settings.quantity)
    pages = []
    for number, index in enumerate(geometry.index):
        pixels = np.zeros((*index.shape, 3), dtype=np.float32)
        coverage = index >= 0
        pixels[coverage] = values[geometry.page == number][index[coverage] - geometry.first(number)]
        pages.append(LightmapPage(dilate(pixels, coverage), coverage))
    return tuple(pages)


def _check(solution: Solution, pages: tuple[LightmapPage, ...]) -> None:
    """Refuse to hand out a result that is not finite: a defect must not look like a dark room."""
    if not np.isfinite(solution.report["residual"]) or not all(np.isfinite(p.pixels).all() for p in pages):
        raise BakeError(
            "the solution is not finite: this is a defect of the solver; please report the scene, "
            "and try another quality meanwhile"
        )


def _of_solution(solution: Solution) -> tuple[BakeWarning, ...]:
    """Warn where nothing shines, or the solver had to stop at its budget of links."""
    warnings = []
    if solution.report["power_W"]["emitted"] == 0:
        warnings.append(
            BakeWarning(
                "scene",
                "no lamp, emissive material or world light reaches anything: the lightmaps are black; "
                "add a lamp, or bake with a sky",
            )
        )
    if solution.over_budget > 0:
        warnings.append(
            BakeWarning(
                "scene",
                f"refinement stopped at its budget of links; single links may misplace up to "
                f"{solution.over_budget:.2%} of the light: bake at a lower quality, or fewer objects",
            )
        )
    return tuple(warnings)


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Note how long a stage took."""
    started = time.perf_counter()
    try:
        yield
    finally:
        seconds[stage] = time.perf_counter() - started
