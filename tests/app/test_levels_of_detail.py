"""Levels of detail on the command line: kept bakes, relit and moved, and names that are asked for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from .conftest import QUICK, add_quad, build_room, read_report, save

Run = Callable[..., object]

SHELF = ((-1, 0, 1), (0, 0, 1), (0, 1, 1), (-1, 1, 1))


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """The room with a shelf of two levels."""
    build_room()
    add_quad("Shelf_LOD0", SHELF)
    add_quad("Shelf_LOD1", SHELF)
    return save(tmp_path / "scene" / "room.blend")


def coordinates(folder: Path) -> list[np.ndarray]:
    """The lightmap coordinates of both levels in baked.blend."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "baked.blend"))
    found = []
    for name in ("Shelf_LOD0", "Shelf_LOD1"):
        layer = bpy.data.objects[name].data.uv_layers["Lightmap"]
        found.append(np.array([tuple(each.vector) for each in layer.uv]))
    return found


def test_kept_bakes_know_levels(run: Run, scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("bake", scene, "--output", out, *QUICK, "--keep").code == 0
    fine, coarse = coordinates(out)
    np.testing.assert_allclose(coarse, fine, atol=1e-6)
    assert np.ptp(fine, axis=0).min() > 0.0
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    bpy.data.lights["Lamp"].energy = 50.0
    save(scene)
    done = run("bake", scene, "--output", out, "--relight", "--no-preview")
    assert (done.code, done.err) == (0, "")
    for found, before in zip(coordinates(out), (fine, coarse), strict=True):
        np.testing.assert_array_equal(found, before)
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    bpy.data.meshes[bpy.data.objects["Shelf_LOD1"].data.name].vertices[0].co.z += 0.2
    save(scene)
    done = run("bake", scene, "--output", out, "--relight", "--no-preview")
    assert done.code == 1
    assert "'Shelf_LOD1' has moved, or changed its shape" in done.err


def test_a_level_that_is_asked_for_is_baked_with_its_finest(run: Run, scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("bake", scene, "--output", out, *QUICK, "--objects", "Shelf_LOD1").code == 0
    assert {entry["object"] for entry in read_report(out)["objects"]} == {"Shelf_LOD0", "Shelf_LOD1"}


def test_with_an_image_for_each_object_levels_have_that_of_the_finest(
    run: Run, scene: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    assert run("bake", scene, "--output", out, *QUICK, "--atlas", "per-object").code == 0
    images = {entry["object"]: entry["image"] for entry in read_report(out)["objects"]}
    assert images["Shelf_LOD1"] == images["Shelf_LOD0"] == "Shelf_LOD0.exr"
    assert len(set(images.values())) == 4


def test_each_level_can_have_its_own_lightmap(run: Run, scene: Path, tmp_path: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    bpy.data.objects["Shelf_LOD1"].name = "Shelf far"
    save(scene)
    out = tmp_path / "out"
    assert run("bake", scene, "--output", out, *QUICK, "--atlas", "per-object").code == 0
    images = {entry["object"]: entry["image"] for entry in read_report(out)["objects"]}
    assert len(set(images.values())) == 5
