"""Making a case's scene file: built or opened, laid out, and which of its texels are compared."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np

from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.files.files import empty_scene, open_scene
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.lightmap.texels.rasterization import rasterize, sample_footprints
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.scene.bake_scene import LIGHTMAP_UV_LAYER
from radiosity_addon.scene.scene import Scene
from tests.golden import cornell_reference

from . import cycles
from .cases import CASES, SMALL_CASES, Case, Lamp
from .flatten import flatten
from .interior.homes import build_apartment, build_living_room
from .interior.office import build_office
from .layout import lay_out, project_smart, write_layout

INTERIORS = {"interior": build_office, "living-room": build_living_room, "apartment": build_apartment}

SCENE, TEXELS = "scene.blend", "texels.npz"

COINCIDENT = 1e-3
"""Faces so near each other are coincident: Cycles bakes them black, or lit through each other [m]."""

ALONG, PART = 4, 0.1
"""A texel lies on coincident faces if this part of ALONG × ALONG points on it do."""


def case_of(job: dict[str, Any]) -> Case:
    """Return the case a job names."""
    return (SMALL_CASES if job["small"] else CASES)[job["case"]]


def reference_path(folder: Path, samples: int, seed: int) -> Path:
    """Return where a reference is kept."""
    return folder / f"reference-{samples}-bounces-{cycles.BOUNCES}-seed-{seed}.npy"


def prepare(job: dict[str, Any]) -> dict[str, Any]:
    """Write a case's scene, with its UV layer, and its compared texels into `job["folder"]`."""
    case, folder = case_of(job), Path(job["folder"])
    golden = _build(case)
    layout = golden.uv if golden is not None else lay_out(case.resolution)
    write_layout(layout)
    if case.smart_uvs:
        project_smart(bpy.context.scene, case.resolution)
    folder.mkdir(parents=True, exist_ok=True)
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / SCENE), compress=True)
    inside, coincident, uv = _center_inside(case)
    scene = bpy.context.scene
    cycles.set_up(scene, job["threads"])
    compared = inside & cycles.covered(scene, case.resolution)
    if golden is not None:
        for seed, pixels in enumerate((golden.first, golden.second), start=1):
            np.save(reference_path(folder, 2048, seed), pixels)
    # Last: that it is there means that all is.
    np.savez_compressed(folder / TEXELS, compared=compared, coincident=coincident, triangles=len(uv))
    return {"texels": int(compared.sum()), "triangles": len(uv)}


def _build(case: Case) -> cornell_reference.Reference | None:
    """Have the case as the open scene; return the layout and references that are there already."""
    if case.builder == "cornell":
        empty_scene()
        build_cornell_box()
        golden = cornell_reference.load()
        return golden if golden.resolution == case.resolution else None
    if case.builder in INTERIORS:
        empty_scene()
        INTERIORS[case.builder](**case.parameters)
        return None
    assert case.file is not None
    open_scene(case.file)
    if case.lamp is not None:
        _add_lamp(case.lamp)
    flatten(case.sky)
    return None


def _add_lamp(lamp: Lamp) -> None:
    data = bpy.data.lights.new("Added", lamp.kind)
    data.energy, data.shadow_soft_size = lamp.energy, lamp.radius
    obj = bpy.data.objects.new("Added", data)
    obj.location = lamp.place
    bpy.context.scene.collection.objects.link(obj)


def _center_inside(case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the texels whose center is on a reflecting triangle, those on coincident faces, and UVs.

    (n, n) bool twice, and (t, 3, 2).
    """
    scene = export_scene(bpy.context, BakeSettings(resolution=case.resolution, keep_uvs=True)).bake_scene
    uv = np.concatenate(
        [np.zeros((item.count, 3, 2), np.float32) if item.uv is None else item.uv for item in scene.objects]
    )
    texels = rasterize(uv, case.resolution)
    inside, coincident = np.zeros((2, case.resolution, case.resolution), dtype=bool)
    own = texels.center_inside & (scene.scene.reflectance[texels.triangle].min(axis=1) > 0)
    inside[texels.row[own], texels.column[own]] = True
    spots = (np.stack(np.meshgrid(np.arange(ALONG), np.arange(ALONG)), axis=-1).reshape(-1, 2) + 0.5) / ALONG
    spots = np.broadcast_to(spots, (len(texels), ALONG**2, 2))
    weights = sample_footprints(texels, spots, 1.0).reshape(-1, 3)
    points = _lies_against(scene.scene, np.repeat(texels.triangle, ALONG**2), weights)
    against = points.reshape(len(texels), -1).mean(axis=1) >= PART
    coincident[texels.row[against], texels.column[against]] = True
    return inside, coincident, uv


def _lies_against(scene: Scene, triangle: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return (n,) whether another triangle is next to points, at (n, 3) weights of their own triangles."""
    point = np.einsum("nc,nck->nk", weights, scene.triangles[triangle])
    normal, caster = scene.face_normals[triangle], EmbreeCaster(scene.triangles)
    found = np.zeros(len(point), dtype=bool)
    for side in (normal, -normal):
        hits = caster.intersect(point + COINCIDENT * side, -side)
        found |= (hits.triangle != triangle) & (hits.distance < 2.0 * COINCIDENT)
    return found


def open_prepared(folder: Path) -> bpy.types.Scene:
    """Open a case's scene file."""
    open_scene(folder / SCENE)
    scene = bpy.context.scene
    assert any(LIGHTMAP_UV_LAYER in o.data.uv_layers for o in scene.objects if o.type == "MESH")
    return scene
