"""The promises about scenes, undo and light (docs/promises.md), tested by the operators."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.blender.promised import (
    QUAD,
    bake,
    light_on,
    pixels_of,
    report_in,
    restore,
    save,
    set_quick,
    shader_of,
    uv_of,
)
from tests.reliability.folders import broken_result
from tests.reliability.light import lightmap_of
from tests.reliability.sandbox import add, paint
from tests.reliability.snapshot import differences, snapshot

pytestmark = pytest.mark.usefixtures("registered")


def test_restore_gives_the_file_back_exactly(room: Path) -> None:
    """The fuzz test tries it on random scenes."""
    before = snapshot()
    bake()
    restore()
    assert differences(before, snapshot()) == []


def test_restore_keeps_objects_that_share_a_baked_mesh(room: Path) -> None:
    bake()
    mine = bpy.data.objects.new("Mine", bpy.data.objects["Cube"].data)
    linked = bpy.data.objects["Floor"].copy()
    for obj in (mine, linked):
        bpy.context.scene.collection.objects.link(obj)
    name = linked.name
    restore()
    assert len(bpy.data.objects["Mine"].data.polygons) > 0
    assert len(bpy.data.objects[name].data.polygons) == 1
    assert [slot.material.name for slot in bpy.data.objects[name].material_slots] == ["White"]


def test_restore_keeps_library_overrides(room: Path, tmp_path: Path) -> None:
    save(tmp_path / "library.blend")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_found, linked):
        linked.objects = ["Floor", "Lamp", "Cube"]
    for obj in linked.objects:
        bpy.context.scene.collection.objects.link(obj)
        obj.override_create(remap_local_usages=True)
    set_quick(bpy.context.scene)
    save(tmp_path / "user" / "user.blend")
    objects = set(bpy.context.scene.objects.keys())
    bake()
    assert lightmap_of(bpy.context.scene.objects["Floor"]) is not None
    restore()
    assert set(bpy.context.scene.objects.keys()) == objects
    for name in ("Floor", "Cube"):
        obj = bpy.context.scene.objects[name]
        assert obj.override_library is not None
        assert obj.data is not None
        assert obj.data.library is not None
        assert lightmap_of(obj) is None


@pytest.mark.parametrize("again", [False, True], ids=["restore", "bake and restore"])
def test_mesh_edits_survive(again: bool, room: Path) -> None:
    bake()
    bpy.data.objects["Floor"].data.vertices[0].co.z = 0.25
    if again:
        bake()
        assert bpy.data.objects["Floor"].data.vertices[0].co.z == 0.25
    restore()
    assert bpy.data.objects["Floor"].data.vertices[0].co.z == 0.25


@pytest.mark.parametrize("name", ["Cube", "Twin A"])
def test_mesh_edits_on_stand_ins_are_never_dropped_in_silence(
    name: str, room: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """With a modifier or a shared mesh: the edit is in the file, or a message names the object."""
    bake()
    bpy.data.objects[name].data.vertices[0].co.z = 4.125
    capfd.readouterr()
    restore()
    anywhere = any(vertex.co.z == 4.125 for mesh in bpy.data.meshes for vertex in mesh.vertices)
    said = capfd.readouterr()
    assert anywhere or name in said.out + said.err


@pytest.mark.parametrize("again", [False, True], ids=["restore", "bake and restore"])
def test_new_materials_survive(again: bool, room: Path) -> None:
    bake()
    blue = paint("Blue", (0.1, 0.1, 0.8))
    bpy.data.objects["Floor"].material_slots[0].material = blue
    bpy.data.objects["Cube"].data.materials.append(paint("Green", (0.1, 0.8, 0.1)))
    if again:
        bake()
    restore()
    assert bpy.data.objects["Floor"].material_slots[0].material.name == "Blue"
    assert bpy.data.objects["Wall"].material_slots[0].material.name == "Red"
    assert "Green" in bpy.data.materials


@pytest.mark.parametrize("again", [False, True], ids=["restore", "bake and restore"])
def test_base_color_edits_survive(again: bool, room: Path) -> None:
    bake()
    shown = bpy.data.objects["Floor"].material_slots[0].material
    shader_of(shown).inputs["Base Color"].default_value = (0.5, 0.25, 0.125, 1)
    if again:
        bake()
    restore()
    material = bpy.data.objects["Floor"].material_slots[0].material
    assert material.name == "White"
    assert tuple(shader_of(material).inputs["Base Color"].default_value) == (0.5, 0.25, 0.125, 1)


@pytest.mark.parametrize("scope", ["all", "changed"])
def test_edited_materials_take_part_in_the_next_bake(scope: str, room: Path) -> None:
    """A ceiling gets no indirect light from a black floor, if there is nothing else, and gives less back."""
    mesh = bpy.data.meshes.new("Ceiling")
    mesh.from_pydata([(2 * x, -2 * y, z) for x, y, z in QUAD], [], [(0, 1, 2, 3)])
    add("Ceiling", mesh, (0, 0, 2))
    # What else is lit would light the ceiling too.
    for name in ("Wall", "Cube", "Twin A", "Twin B", "Panel"):
        bpy.data.objects[name].radiosity_mode = "IGNORE"
    bpy.context.scene.radiosity.light = "indirect"
    # At draft few rays of the ceiling, which Changed does not bake, tell how bright it is.
    bpy.context.scene.radiosity.quality, bpy.context.scene.radiosity.resolution = "medium", 64
    bake()
    before = report_in(room / "lightmaps")[1]
    shown = bpy.data.objects["Floor"].material_slots[0].material
    shader_of(shown).inputs["Base Color"].default_value = (0, 0, 0, 1)
    bpy.context.scene.radiosity.scope = scope
    bake()
    after = report_in(room / "lightmaps")[1]
    # Only Changed bakes the floor alone; less light comes back to it from the ceiling.
    name, share = ("Ceiling", 0.1) if scope == "all" else ("Floor", 0.9)
    assert light_on(after, name) < share * light_on(before, name)


def test_a_selected_bake_leaves_the_others_theirs(room: Path) -> None:
    bake()
    image = lightmap_of(bpy.data.objects["Wall"])
    before, uv = pixels_of(image), uv_of(bpy.data.objects["Wall"])
    bpy.ops.object.select_all(action="DESELECT")
    bpy.data.objects["Floor"].select_set(True)
    bpy.context.scene.radiosity.scope = "selected"
    bake()
    now = lightmap_of(bpy.data.objects["Wall"])
    assert now is not None
    np.testing.assert_array_equal(pixels_of(now), before)
    np.testing.assert_array_equal(uv_of(bpy.data.objects["Wall"]), uv)
    assert lightmap_of(bpy.data.objects["Floor"]) is not None
    assert broken_result(room / "lightmaps") == []


def test_undo_of_a_bake_brings_picture_and_uvs_back_together(room: Path) -> None:
    bpy.ops.ed.undo_push(message="Before")
    bake()
    first = pixels_of(lightmap_of(bpy.data.objects["Floor"])), uv_of(bpy.data.objects["Floor"])
    bpy.data.objects["Cube"].location.x = 1.2
    bpy.context.scene.radiosity.resolution = 24
    bpy.ops.ed.undo_push(message="Moved")
    bake()
    second = pixels_of(lightmap_of(bpy.data.objects["Floor"])), uv_of(bpy.data.objects["Floor"])
    for step, (pixels, uv) in ((bpy.ops.ed.undo, first), (bpy.ops.ed.redo, second), (bpy.ops.ed.undo, first)):
        step()
        image = lightmap_of(bpy.data.objects["Floor"])
        image.reload()  # what is on the disk, as after saving and opening again
        np.testing.assert_array_equal(pixels_of(image), pixels)
        np.testing.assert_array_equal(uv_of(bpy.data.objects["Floor"]), uv)


def test_undo_of_a_relight_brings_the_picture_back(room: Path) -> None:
    bake()
    bpy.ops.ed.undo_push(message="Baked")
    before = pixels_of(lightmap_of(bpy.data.objects["Floor"]))
    bpy.data.lights["Lamp"].energy = 500
    bpy.ops.ed.undo_push(message="Turned up")
    assert bpy.ops.radiosity.relight("EXEC_DEFAULT", True) == {"FINISHED"}
    after = pixels_of(lightmap_of(bpy.data.objects["Floor"]))
    assert after.mean() > before.mean()
    for step, pixels in ((bpy.ops.ed.undo, before), (bpy.ops.ed.redo, after)):
        step()
        image = lightmap_of(bpy.data.objects["Floor"])
        np.testing.assert_array_equal(pixels_of(image), pixels)
        image.reload()
        np.testing.assert_array_equal(pixels_of(image), pixels)


def measured_floor(layers: int, gap: float) -> float:
    """Bake a floor below glowing sheets that are `gap` meters apart; returns the light on it."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    floor = bpy.data.meshes.new("Floor")
    floor.from_pydata(QUAD, [], [(0, 1, 2, 3)])
    add("Floor", floor, (0, 0, 0))
    corners = [(0.5 * x, 0.5 * y, 1 + number * gap) for number in range(layers) for x, y, _ in QUAD]
    glow = bpy.data.meshes.new("Glow")
    glow.from_pydata(corners, [], [tuple(range(4 * n, 4 * n + 4)) for n in range(layers)])
    glow.materials.append(paint("Glow", (0, 0, 0), 0.0))
    shader = shader_of(glow.materials[0])
    shader.inputs["Emission Color"].default_value = (1, 1, 1, 1)
    shader.inputs["Emission Strength"].default_value = 10
    add("Glow", glow, (0, 0, 0))
    settings = bpy.context.scene.radiosity
    settings.quality, settings.quantity = "sketch", "irradiance"
    # By density, so that the floor's texels do not depend on how many sheets share the page.
    settings.size_mode, settings.texel_density = "density", 10.0
    bake()
    pixels = pixels_of(lightmap_of(bpy.data.objects["Floor"])).reshape(-1, 4)[:, :3]
    assert np.isfinite(pixels).all()
    assert pixels.min() >= 0
    image = lightmap_of(bpy.data.objects["Floor"])
    width, height = image.size
    uv = uv_of(bpy.data.objects["Floor"]).reshape(-1, 2)
    low, high = uv.min(axis=0), uv.max(axis=0)
    grid = pixels.reshape(height, width, 3)
    rows = slice(math.ceil(low[1] * height), math.floor(high[1] * height))
    columns = slice(math.ceil(low[0] * width), math.floor(high[0] * width))
    return float(grid[rows, columns].mean())


@pytest.mark.parametrize("gap", [0.0, 1e-7, 1e-6])
def test_emitters_in_one_place_light_once(gap: float) -> None:
    assert measured_floor(5, gap) == pytest.approx(measured_floor(1, 0.0), rel=0.02)


def test_undo_of_restore_offers_no_relight_that_fails(room: Path) -> None:
    bake()
    bpy.ops.ed.undo_push(message="Baked")
    restore()
    bpy.ops.ed.undo()
    assert lightmap_of(bpy.data.objects["Floor"]) is not None
    bpy.data.lights["Lamp"].energy = 500
    if bpy.ops.radiosity.relight.poll():
        assert bpy.ops.radiosity.relight("EXEC_DEFAULT", True) == {"FINISHED"}
