"""The promises of docs/promises.md, tested from outside: by operators and the command line.

Names of files in the panel's folder are read from its report.
"""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.cli import main
from tests.reliability.folders import broken_result, changes, images_of, listed, reports, tree
from tests.reliability.sandbox import add, build_room, paint
from tests.reliability.snapshot import differences, snapshot

QUICK = ("--resolution", "16", "--quality", "draft", "--min-area", "0.5")
QUAD = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))

Run = Callable[..., tuple[int, str]]


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    radiosity_addon.register()
    yield
    radiosity_addon.unregister()


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    """The command line in this process: returns its code and what it says of errors."""

    def call(*words: object) -> tuple[int, str]:
        capfd.readouterr()
        code = main([str(word) for word in words])
        told = capfd.readouterr().err
        assert "Traceback" not in told
        return code, told

    return call


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A room that is saved, open, and set to bake quickly; the folder it is in."""
    build_room()
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality, settings.min_area = 16, "draft", 0.5
    return save(tmp_path / "room" / "room.blend").parent


def save(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def bake() -> None:
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}


def refused(operator: Callable[..., set[str]]) -> str:
    """Run an operator that is to refuse; returns the line in which it does."""
    with pytest.raises(RuntimeError) as caught:
        operator("EXEC_DEFAULT", True)
    message = str(caught.value).strip().removeprefix("Error: ")
    assert len(message.splitlines()) == 1, message
    return message


def restore() -> None:
    assert bpy.ops.radiosity.restore("EXEC_DEFAULT", True) == {"FINISHED"}


def report_in(folder: Path) -> tuple[Path, dict[str, Any]]:
    """The one report in a folder."""
    ((path, told),) = reports(folder).items()
    return path, told


def light_on(report: dict[str, Any], name: str) -> float:
    """The mean irradiance that a report tells of an object."""
    return next(entry["irradiance_W_m2"]["mean"] for entry in report["objects"] if entry["object"] == name)


def lightmap_of(obj: bpy.types.Object) -> bpy.types.Image | None:
    """The image that an object's first material shows, itself or in a group."""
    trees = [slot.material.node_tree for slot in obj.material_slots[:1] if slot.material is not None]
    for of in trees:
        for node in of.nodes:
            if node.type == "GROUP" and node.node_tree is not None:
                trees.append(node.node_tree)
            elif node.type == "TEX_IMAGE" and node.image is not None:
                return node.image
    return None


def pixels_of(image: bpy.types.Image) -> np.ndarray:
    pixels = np.empty(image.size[0] * image.size[1] * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels


def uv_of(obj: bpy.types.Object) -> np.ndarray:
    layer = obj.data.uv_layers["Lightmap"]
    uv = np.empty(2 * len(obj.data.loops), dtype=np.float32)
    layer.data.foreach_get("uv", uv)
    return uv


def shader_of(material: bpy.types.Material) -> bpy.types.Node:
    return next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")


# Files


@pytest.mark.parametrize(
    "name", ["lightmap.exr", "preview.png", "report.json", "baked.blend", "lightmap.relight"]
)
def test_the_command_line_replaces_no_foreign_file(name: str, room: Path, run: Run) -> None:
    out = room / "out"
    out.mkdir()
    (out / name).write_text("mine")
    code, told = run("bake", room / "room.blend", "--output", out, *QUICK, "--keep")
    assert code in (1, 2)
    assert name in told
    assert told.count("\n") == 1
    assert [path.name for path in out.iterdir()] == [name]
    assert (out / name).read_text() == "mine"


def test_the_command_line_replaces_a_foreign_file_when_told_to(room: Path, run: Run) -> None:
    out = room / "out"
    out.mkdir()
    (out / "lightmap.exr").write_text("mine")
    code, _ = run("bake", room / "room.blend", "--output", out, *QUICK, "--overwrite")
    assert code == 0
    assert broken_result(out) == []


@pytest.mark.parametrize("atlas", ["shared", "per-object"])
def test_the_panel_replaces_no_foreign_file(atlas: str, room: Path) -> None:
    """Whatever the names of its files are: they are those of a bake that is gone."""
    bpy.context.scene.radiosity.atlas = atlas
    bake()
    lightmaps = room / "lightmaps"
    names = [path.name for path in lightmaps.iterdir()]
    restore()
    for name in names:
        shutil.rmtree(lightmaps)
        lightmaps.mkdir()
        (lightmaps / name).write_text("mine")
        assert name in refused(bpy.ops.radiosity.bake)
        assert [path.name for path in lightmaps.iterdir()] == [name]
        assert (lightmaps / name).read_text() == "mine"


def test_a_lightmap_that_was_painted_on_is_not_replaced(room: Path) -> None:
    bake()
    path, told = report_in(room / "lightmaps")
    lightmap = path.parent / images_of(told)[0]
    lightmap.write_bytes(lightmap.read_bytes() + b"painted")
    before = tree(room)
    assert lightmap.name in refused(bpy.ops.radiosity.bake)
    assert changes(before, tree(room)) == []


@pytest.mark.parametrize("place", ["out", "lightmaps"])
def test_textures_of_the_scene_are_never_replaced(place: str, room: Path, run: Run) -> None:
    folder = room / place
    bake()
    name = images_of(report_in(room / "lightmaps")[1])[0] if place == "lightmaps" else "lightmap.exr"
    restore()
    shutil.rmtree(room / "lightmaps")
    folder.mkdir()
    picture = bpy.data.images.new("Texture", 4, 4, float_buffer=True)
    picture.filepath_raw, picture.file_format = str(folder / name), "OPEN_EXR"
    picture.save()
    nodes = bpy.data.materials["White"].node_tree
    texture = nodes.nodes.new("ShaderNodeTexImage")
    texture.image = picture
    nodes.links.new(texture.outputs[0], shader_of(bpy.data.materials["White"]).inputs["Base Color"])
    save(room / "room.blend")
    before = tree(folder)
    if place == "out":
        code, told = run("bake", room / "room.blend", "--output", folder, *QUICK)
        assert code in (1, 2)
    else:
        told = refused(bpy.ops.radiosity.bake)
    assert name in told
    assert changes(before, tree(folder)) == []


def test_two_files_in_one_folder_keep_their_lightmaps(room: Path) -> None:
    bake()
    save(room / "room.blend")
    first = tree(room / "lightmaps")
    save(room / "other.blend")
    bpy.data.lights["Lamp"].energy = 10
    bake()
    assert changes(first, tree(room / "lightmaps"), new_allowed=True) == []
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    before = tree(room / "lightmaps")
    bpy.data.lights["Lamp"].energy = 1000
    bake()
    others = {name: of for name, of in before.items() if name not in first}
    assert changes(others, tree(room / "lightmaps"), new_allowed=True) == []


def second_scene() -> bpy.types.Scene:
    """Add a scene with a floor and a lamp of its own."""
    first = bpy.context.scene
    scene = bpy.data.scenes.new("Second")
    bpy.context.window.scene = scene
    mesh = bpy.data.meshes.new("Second floor")
    mesh.from_pydata(QUAD, [], [(0, 1, 2, 3)])
    add("Second floor", mesh, (0, 0, 0))
    lamp = bpy.data.lights.new("Second lamp", "POINT")
    lamp.energy = 50
    add("Second lamp", lamp, (0, 0, 1))
    settings = scene.radiosity
    settings.resolution, settings.quality, settings.min_area = 16, "draft", 0.5
    bpy.context.window.scene = first
    return scene


def test_two_scenes_of_a_file_keep_their_lightmaps(room: Path) -> None:
    """Files on disk, and what the objects show."""
    other = second_scene()
    save(room / "room.blend")
    bake()
    before = tree(room / "lightmaps")
    shown = {obj.name: lightmap_of(obj) for obj in bpy.context.scene.objects if obj.type == "MESH"}
    names = {name: image.name for name, image in shown.items()}
    light = {name: pixels_of(image) for name, image in shown.items()}
    bpy.context.window.scene = other
    bake()
    assert lightmap_of(bpy.data.objects["Second floor"]) is not None
    assert changes(before, tree(room / "lightmaps"), new_allowed=True) == []
    for name, image in names.items():
        now = lightmap_of(bpy.data.objects[name])
        assert now is not None, f"{name} shows no lightmap any more"
        assert now.name == image
        np.testing.assert_array_equal(pixels_of(now), light[name])


@pytest.mark.parametrize("option", ["--report", "--plot"])
def test_a_second_output_never_replaces_an_input_or_another_output(option: str, room: Path, run: Run) -> None:
    out, before = room / "out", tree(room)
    for target in (room / "room.blend", out / "baked.blend", out / "preview.png", Path("/dev/null")):
        if option == "--plot" and target.suffix != ".png":
            continue
        code, told = run("bake", room / "room.blend", "--output", room / "out", *QUICK, option, target)
        assert code in (1, 2), f"{option} {target}"
        assert told.count("\n") == 1
        assert changes(before, tree(room)) == []


def test_opening_a_file_touches_nothing(room: Path, tmp_path: Path) -> None:
    """Also where a folder like that of a killed bake lies beside it, which names files elsewhere."""
    bake()
    save(room / "room.blend")
    outside = tmp_path / "mine.txt"
    outside.write_text("mine")
    staging = room / "lightmaps" / ".radiosity-x"
    (staging / "earlier").mkdir(parents=True)
    (staging / ".owner").write_text("made by Radiosity Lightmaps while it bakes; it cleans up by itself\n")
    names = ["../../mine.txt", str(outside), "../room.blend", "notes.txt"]
    (staging / ".publishing.json").write_text(json.dumps({"names": names}))
    (room / "lightmaps" / "notes.txt").write_text("mine")
    before = tree(tmp_path)
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    assert changes(before, tree(tmp_path)) == []
    bpy.context.scene.radiosity.resolution = 12
    bake()
    assert outside.read_text() == "mine"
    assert (room / "lightmaps" / "notes.txt").read_text() == "mine"


def test_relight_writes_nothing_but_lightmaps(room: Path, tmp_path: Path) -> None:
    """Wherever the images of the open file point."""
    bake()
    target = tmp_path / "photo.exr"
    target.write_text("mine")
    image = lightmap_of(bpy.data.objects["Floor"])
    image.filepath_raw = str(target)
    bpy.data.lights["Lamp"].energy = 500
    before = tree(tmp_path)
    try:
        bpy.ops.radiosity.relight("EXEC_DEFAULT", True)
    except RuntimeError as error:
        if len(str(error).strip().splitlines()) > 1:
            raise
    assert target.read_text() == "mine"
    allowed = {f"changed: room/lightmaps/{name}" for name in listed(room / "lightmaps")}
    allowed.add(f"changed: room/lightmaps/{report_in(room / 'lightmaps')[0].name}")
    assert set(changes(before, tree(tmp_path))) <= allowed


def test_restore_deletes_no_file(room: Path) -> None:
    bake()
    before = tree(room)
    restore()
    assert changes(before, tree(room)) == []


# Scenes


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
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality, settings.min_area = 16, "draft", 0.5
    save(tmp_path / "user" / "user.blend")
    try:
        bake()
    except RuntimeError as error:
        message = str(error)  # refused by name: nothing to restore
        named = "Floor" in message or "Cube" in message
        if not named or "Traceback" in message:
            raise
    else:
        restore()
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
    """A ceiling gets no indirect light from a black floor, if there is nothing else."""
    mesh = bpy.data.meshes.new("Ceiling")
    mesh.from_pydata([(2 * x, -2 * y, z) for x, y, z in QUAD], [], [(0, 1, 2, 3)])
    add("Ceiling", mesh, (0, 0, 2))
    # What else is lit would light the ceiling too.
    for name in ("Wall", "Cube", "Twin A", "Twin B", "Panel"):
        bpy.data.objects[name].radiosity_mode = "IGNORE"
    bpy.context.scene.radiosity.light = "indirect"
    bake()
    before = report_in(room / "lightmaps")[1]
    shown = bpy.data.objects["Floor"].material_slots[0].material
    shader_of(shown).inputs["Base Color"].default_value = (0, 0, 0, 1)
    bake()
    if scope == "changed":
        material = bpy.data.objects["Floor"].material_slots[0].material
        shader_of(material).inputs["Base Color"].default_value = (0.9, 0.9, 0.9, 1)
        bpy.context.scene.radiosity.scope = "changed"
        bake()
        assert [e["object"] for e in report_in(room / "lightmaps")[1]["objects"]].count("Floor") == 1
        restore()
        value = shader_of(bpy.data.materials["White"]).inputs["Base Color"].default_value[0]
        assert value == pytest.approx(0.9)
        return
    after = report_in(room / "lightmaps")[1]
    assert light_on(after, "Ceiling") < 0.1 * light_on(before, "Ceiling")


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


# Light


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
    settings.resolution, settings.quality, settings.quantity = 32, "draft", "irradiance"
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


# Kept bakes


def kept(room: Path, run: Run) -> tuple[str, ...]:
    """Bake with a sidecar; returns what relights it."""
    scene = room / "room.blend"
    assert run("bake", scene, "--output", room / "out", *QUICK, "--keep")[0] == 0
    return "bake", str(scene), "--output", str(room / "out"), "--relight"


def test_a_sidecar_of_an_earlier_bake_is_refused(room: Path, run: Run) -> None:
    relight = kept(room, run)
    assert run("bake", room / "room.blend", "--output", room / "out", *QUICK, "--seed", "5")[0] == 0
    before = tree(room / "out")
    code, told = run(*relight)
    assert code == 1
    assert told.count("\n") == 1
    assert changes(before, tree(room / "out")) == []


@pytest.mark.parametrize("change", ["pixels", "UVs"])
def test_a_changed_texture_is_noticed(change: str, room: Path, run: Run) -> None:
    """One with the same mean, or another way round."""
    picture = bpy.data.images.new("Halves", 8, 8)
    halves = np.zeros((8, 8, 4), dtype=np.float32)
    halves[:, :4] = 1
    halves[..., 3] = 1
    picture.pixels.foreach_set(halves.ravel())
    picture.pack()
    nodes = bpy.data.materials["White"].node_tree
    texture = nodes.nodes.new("ShaderNodeTexImage")
    texture.image = picture
    nodes.links.new(texture.outputs[0], shader_of(bpy.data.materials["White"]).inputs["Base Color"])
    layer = bpy.data.meshes["Floor"].uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", (0, 0, 1, 0, 1, 1, 0, 1))
    save(room / "room.blend")
    relight = kept(room, run)
    before = tree(room / "out")
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    if change == "pixels":
        picture = bpy.data.images["Halves"]
        picture.pixels.foreach_set(np.ascontiguousarray(halves[:, ::-1]).ravel())
        picture.pack()
    else:
        layer = bpy.data.meshes["Floor"].uv_layers["UVMap"]
        layer.data.foreach_set("uv", (1, 0, 0, 0, 0, 1, 1, 1))
    save(room / "room.blend")
    code, told = run(*relight)
    assert code == 1
    assert "Floor" in told or "White" in told or "Halves" in told
    assert changes(before, tree(room / "out")) == []


def test_undo_of_restore_offers_no_relight_that_fails(room: Path) -> None:
    bake()
    bpy.ops.ed.undo_push(message="Baked")
    restore()
    bpy.ops.ed.undo()
    assert lightmap_of(bpy.data.objects["Floor"]) is not None
    bpy.data.lights["Lamp"].energy = 500
    if bpy.ops.radiosity.relight.poll():
        assert bpy.ops.radiosity.relight("EXEC_DEFAULT", True) == {"FINISHED"}
