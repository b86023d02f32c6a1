"""The single measurements, each the work of a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from . import rooms
from .recording import Stopwatch, solver_figures, watched_bake


def prepare(job: dict[str, Any]) -> dict[str, Any]:
    from .prepare import prepare as prepare_case

    return prepare_case(job)


def cycles(job: dict[str, Any]) -> dict[str, Any]:
    """Bake with Cycles: `samples`, `seed`; the pixels go to `pixels`."""
    from . import cycles as baking
    from .prepare import case_of, open_prepared

    case = case_of(job)
    scene = open_prepared(Path(job["folder"]))
    baking.set_up(scene, job["threads"])
    watch = Stopwatch()
    with watch.running():
        pixels = baking.bake_light(scene, case.resolution, job["samples"], job["seed"])
    save_whole(Path(job["pixels"]), pixels)
    return watch.figures


def ours(job: dict[str, Any]) -> dict[str, Any]:
    """Bake with the add-on: `run` holds the settings; the pixels go to `pixels`."""
    import bpy

    from radiosity_addon.blender.scene_export.export import export_scene

    from .prepare import case_of, open_prepared

    settings = settings_of(
        job["run"], resolution=case_of(job).resolution, threads=job["threads"], keep_uvs=True
    )
    open_prepared(Path(job["folder"]))
    watch = Stopwatch()
    with watch.running():
        bake_scene = export_scene(bpy.context, settings).bake_scene
        result, leaves = watched_bake(bake_scene, settings)
    if len(result.pages) != 1 or any(
        not np.array_equal(placed.uv, placed.object.uv) for placed in result.objects
    ):
        raise RuntimeError("the bake did not keep the layout: its texels are others than Cycles'")
    save_whole(Path(job["pixels"]), result.pages[0].pixels)
    return {**watch.figures, **solver_figures(result.solver, leaves), "stages": result.seconds}


def oidn(job: dict[str, Any]) -> dict[str, Any]:
    """Denoise a bake of Cycles'; the pixels of both filters go to `pixels`."""
    from .oidn import denoised

    noisy = np.load(job["noisy"])
    coverage = np.load(job["texels"])["compared"] | (noisy.max(axis=2) > 0)
    found: dict[str, Any] = {"filters": {}}
    pages = {}
    for name in ("RTLightmap", "RT"):
        watch = Stopwatch()
        with watch.running():
            pages[name] = denoised(noisy, coverage, name)
        found["filters"][name] = watch.figures
    np.savez(job["pixels"], **pages)
    return found


def room(job: dict[str, Any]) -> dict[str, Any]:
    """Solve a closed room of `triangles`, or bake it where there is a `resolution`."""
    settings = settings_of({"quality": job["quality"]}, threads=job["threads"], keep_uvs=True,
                           resolution=job.get("resolution", 64))  # fmt: skip
    work: Callable[..., dict[str, Any]] = rooms.bake_room if "resolution" in job else rooms.solve_room
    return work(job["triangles"], settings)


def view(job: dict[str, Any]) -> dict[str, Any]:
    """Render a case to the file `picture`, lit by the pixels of `lightmap` alone if that is not None."""
    from .camera_view import render
    from .prepare import case_of

    lightmap = None if job["lightmap"] is None else Path(job["lightmap"])
    render(case_of(job), Path(job["folder"]), job["mean"], lightmap, Path(job["picture"]))
    return {}


TASKS = {"prepare": prepare, "cycles": cycles, "ours": ours, "oidn": oidn, "room": room, "view": view}


def settings_of(run: dict[str, Any], **more: Any) -> Any:
    """Return the `BakeSettings` of one of our bakes; what it says of solver and gather becomes the preset."""
    from radiosity_addon.bake import quality
    from radiosity_addon.options.bake_settings import BakeSettings

    given = {name: value for name, value in run.items() if name not in ("solver", "gather")}
    settings = BakeSettings(**given, **more)
    preset = quality.QUALITY_SETTINGS[settings.quality]
    solver, gather = replace(preset.solver, **run.get("solver", {})), run.get("gather", {})
    gather = {name: tuple(value) if isinstance(value, list) else value for name, value in gather.items()}
    quality.QUALITY_SETTINGS[settings.quality] = replace(
        preset, solver=solver, gather=replace(preset.gather, **gather)
    )
    return settings


def save_whole(path: Path, pixels: np.ndarray) -> None:
    """Write an array so that a file that is there is complete."""
    aside = path.with_name(f".{path.name}.part.npy")
    np.save(aside, pixels.astype(np.float32))
    aside.replace(path)
