"""What must hold of every bake, whatever the scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy
import numpy as np

from radiosity_addon.bake.plan import BakePlan
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.base.errors import SceneError, UsageError
from radiosity_addon.base.steps import drain
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.jobs import job
from radiosity_addon.lights.environment import EnvironmentImage
from radiosity_addon.lights.sun_and_sky import EnvironmentLight
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.scene.scene import Scene
from tests.blender.file_dump import differences_since, dump_file

from .scenes import build

BALANCE = 0.05
"""Power that may be made: of what is emitted, by a draft of a few elements."""

OVERSHOOT = 1.05
"""A texel is interpolated between gather points, and a seam's are stitched."""


def check(seed: int, /, **changed: Any) -> bool:
    """Build, bake, look at, and restore the scene of a seed; returns whether it could be baked.

    changed: Settings that are not those of the seed.

    Raises
    ------
    AssertionError
        If what must hold does not.
    """
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    settings = replace(build(seed), **changed)
    before = dump_file()
    seen: list[tuple[BakeScene, BakeResult]] = []
    try:
        _bake(settings, seen)
    except (SceneError, UsageError):
        pass  # told in a line of its own
    else:
        for scene, result in seen:
            _check_texels(scene, result, settings)
            _check_power(result)
        restore(bpy.context)
    bpy.context.scene.property_unset("radiosity")
    left = differences_since(before)
    assert left == [], f"not restored: {left[:5]}"
    return bool(seen)


def _bake(settings: BakeSettings, seen: list[tuple[BakeScene, BakeResult]]) -> None:
    """Bake the open scene, and keep what the pipeline was given and gave."""
    run_pipeline = job.run_pipeline

    def watched(plan: BakePlan, *given: Any):
        result, kept = run_pipeline(plan, *given)
        seen.append((plan.bake_scene, result))
        return result, kept

    job.run_pipeline = watched
    try:
        drain(job.run_bake(bpy.context, settings, None))
    finally:
        job.run_pipeline = run_pipeline


def _check_texels(scene: BakeScene, result: BakeResult, settings: BakeSettings) -> None:
    """Texels are numbers, not negative, and no brighter than the light allows."""
    brightest = np.zeros(3)
    for number, page in enumerate(result.pages):
        assert np.isfinite(page.pixels).all(), f"page {number} holds NaN or infinity"
        assert page.pixels.min() >= 0, f"page {number} holds {page.pixels.min()}"
        brightest = np.maximum(brightest, page.pixels.max(axis=(0, 1)))
    if any(not isinstance(light, EnvironmentLight) for light in scene.scene.lights):
        return  # nothing bounds the light of a lamp but the distance to it
    bound = _brightest(scene.scene)
    if settings.quantity == "irradiance_over_pi":
        bound /= np.pi
    assert (brightest <= OVERSHOOT * bound).all(), f"a texel of {brightest} where {bound} is the most"


def _brightest(scene: Scene) -> np.ndarray:
    """Return (3,) what no irradiance [W/m²] in a scene without lamps exceeds, nor any radiosity."""
    emission, reflectance = scene.emission.max(axis=0), scene.reflectance.max(axis=0)
    if scene.images is not None:
        detail = scene.images.values.max(axis=(0, 1))
        emission, reflectance = np.maximum(emission, detail[3:6]), np.maximum(reflectance, detail[:3])
    sky = np.zeros(3)
    for light in scene.lights:
        most = np.max(light.image) if isinstance(light, EnvironmentImage) else 1.0
        sky += np.pi * light.strength * most
    # ‖H‖ ≤ ‖B‖ ≤ E + ρ ‖H‖ in the maximum's norm.
    return (emission + sky) / (1 - reflectance)


def _check_power(result: BakeResult) -> None:
    """Light is not made: what is absorbed and escapes was emitted."""
    power = result.solver["power_W"]
    arrived = power["absorbed"] + power["escaped"]
    assert np.isfinite(arrived)
    assert arrived <= (1 + BALANCE) * power["emitted"] + 1e-12, f"{power} W"
