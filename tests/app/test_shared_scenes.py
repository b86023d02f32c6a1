"""Scenes that other people made, up to 20,000 triangles: what must hold whatever is in them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.blender.files.files import open_scene
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.file_dump import differences_since, tidy_dump

QUICK = BakeSettings(resolution=64, quality="draft")

LAMPS = {
    "godot-tests/test01/boxes.blend": ("POINT", (0.0, -1.5, 4.0), 150.0),
    "godot-tests/test02/scene.blend": ("POINT", (0.0, -8.0, 12.0), 2000.0),
    "godot-tests/test02/monkey.blend": ("POINT", (2.0, -4.0, 3.0), 500.0),
    "godot-tests/test03/leaks.blend": ("SUN", (0.0, 0.0, 20.0), 3.0),
    "instancing/01_multiple_collection_instances.blend": ("POINT", (3.0, 1.0, 3.0), 300.0),
    "instancing/32_gpu_instancing_with_instancing.blend": ("SUN", (0.0, 0.0, 20.0), 3.0),
}
"""Kind, place and energy [W, or W/m²] of the lamp that suits each scene; none has its own."""

LIT_ALL_OVER = "instancing/01_multiple_collection_instances.blend"
"""Cubes side by side in the open: no spot is closed off from the sky."""

SOME_SIDE_OPEN = sorted(LAMPS.keys() - {"godot-tests/test01/boxes.blend", "godot-tests/test03/leaks.blend"})
"""Of every object some face sees the sky (boxes.blend has cubes walled in by others, leaks.blend a
closed box whose faces look inwards, which is black)."""

UNDER_A_SKY = sorted(LAMPS.keys() - {"godot-tests/test02/monkey.blend"})
"""The monkey's 15,744 triangles are baked once, for the time it takes."""


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    radiosity_addon.register()
    yield
    radiosity_addon.unregister()


@pytest.mark.parametrize("name", LAMPS)
def test_a_bake_succeeds_and_restore_leaves_no_difference(shared_scenes: Path, name: str) -> None:
    open_scene(shared_scenes / name)
    _add_lamp(*LAMPS[name])
    before = tidy_dump()
    report = _bake()

    assert report["solver"]["residual"] < 1e-3
    power = report["solver"]["power_W"]
    assert power["absorbed"] + power["escaped"] == pytest.approx(power["emitted"], rel=0.02)
    texels = _texels_by_object()
    assert len(texels) == len(report["objects"])
    for values in texels.values():
        assert np.isfinite(values).all()
        assert (values >= 0).all()
    assert max(values.max() for values in texels.values()) > 0.05
    if name in SOME_SIDE_OPEN:
        assert [which for which, values in texels.items() if values.max() <= 0] == []
    if name == LIT_ALL_OVER:
        assert min(values.min() for values in texels.values()) > 0

    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert differences_since(before, tidy_dump()) == []


@pytest.mark.parametrize("name", UNDER_A_SKY)
def test_under_a_sky_alone_nothing_outshines_the_sky(shared_scenes: Path, name: str) -> None:
    """Surfaces that reflect less than all they get cannot be brighter than what lights them."""
    open_scene(shared_scenes / name)
    _set_sky(1.0)
    _bake()
    texels = _texels_by_object()
    assert max(values.max() for values in texels.values()) <= 1.03
    assert max(values.max() for values in texels.values()) > 0.9


def test_closed_boxes_do_not_leak(shared_scenes: Path) -> None:
    """Walls that abut or meet in edges keep a lamp's light inside, and the dark in the others."""
    open_scene(shared_scenes / "godot-tests/test03/leaks.blend")
    _set_sky(0.0)
    _add_lamp("POINT", (15.0, 10.0, 4.0), 300.0)
    _bake()
    texels = _texels_by_object()
    lit_box = {f"Cube.{number:03d}" for number in range(1, 7)}
    brightest = max(texels[name].max() for name in lit_box)
    assert min(texels[name].max() for name in lit_box) > 0.05 * brightest
    leaks = {name: values.max() for name, values in texels.items() if name not in lit_box}
    assert len(leaks) == 13
    assert max(leaks.values()) == 0


def _bake() -> dict:
    """Bake the open scene through the job behind all front doors."""
    job = run_bake(bpy.context, QUICK, None)
    while True:
        try:
            next(job)
        except StopIteration as done:
            return done.value.as_dict()


def _texels_by_object() -> dict[str, np.ndarray]:
    """The texels that the middles of each baked object's triangles lie on, (n, 3) by object name."""
    shown = [obj for obj in bpy.context.scene.objects if obj.type == "MESH" and not obj.hide_render]
    texels = {}
    for obj in shown:
        layer = obj.data.uv_layers.get("Lightmap")
        if layer is None:
            continue
        obj.data.calc_loop_triangles()
        loops = np.array([triangle.loops[:] for triangle in obj.data.loop_triangles])
        uv = np.empty((len(obj.data.loops), 2), dtype=np.float32)
        layer.uv.foreach_get("vector", uv.reshape(-1))
        pixels = _pixels(_lightmap_of(obj))
        height, width = pixels.shape[:2]
        column, row = (uv[loops].mean(axis=1) * (width, height)).astype(int).T
        texels[obj.name] = pixels[row, column]
    return texels


def _lightmap_of(obj: bpy.types.Object) -> bpy.types.Image:
    nodes = obj.material_slots[0].material.node_tree.nodes
    group = next(node for node in nodes if node.type == "GROUP" and "Lightmap" in node.inputs)
    return group.inputs["Lightmap"].links[0].from_node.image


def _pixels(image: bpy.types.Image) -> np.ndarray:
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4)[..., :3]


def _add_lamp(kind: str, place: tuple[float, float, float], energy: float) -> None:
    data = bpy.data.lights.new("Added", kind)
    data.energy = energy
    lamp = bpy.data.objects.new("Added", data)
    lamp.location = place
    lamp.rotation_euler = (0.6, -0.5, 0.0)
    bpy.context.scene.collection.objects.link(lamp)


def _set_sky(radiance: float) -> None:
    background = next(node for node in bpy.context.scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (radiance, radiance, radiance, 1.0)
    background.inputs["Strength"].default_value = 1.0
