"""The promises about files and kept bakes (docs/promises.md), tested from outside.

Names of files in the panel's folder are read from its report.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.files import digest_of_file
from tests.blender.promised import (
    QUAD,
    QUICK,
    Run,
    bake,
    command_line,
    pixels_of,
    refuse_work,
    refused,
    report_in,
    restore,
    save,
    set_quick,
    show_picture,
)
from tests.reliability.folders import broken_result, changes, images_of, listed, tree
from tests.reliability.light import lightmap_of
from tests.reliability.sandbox import add

# Files are the same in every Blender; test_promises_of_scenes.py runs in all.
pytestmark = [pytest.mark.one_blender, pytest.mark.usefixtures("registered")]


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    return command_line(capfd)


@pytest.mark.parametrize(
    "name", ["lightmap.exr", "preview.png", "report.json", "baked.blend", "lightmap.relight"]
)
def test_the_command_line_replaces_no_foreign_file(
    name: str, room: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = room / "out"
    refuse_work(monkeypatch)
    out.mkdir()
    (out / name).write_text("mine")
    code, told = run("bake", room / "room.blend", "--output", out, *QUICK, "--keep")
    assert code in (1, 2)
    assert name in told
    assert told.count("\n") == 1
    assert [path.name for path in out.iterdir()] == [name]
    assert (out / name).read_text() == "mine"


def test_the_command_line_replaces_a_foreign_file_on_request(room: Path, run: Run) -> None:
    out = room / "out"
    out.mkdir()
    (out / "lightmap.exr").write_text("mine")
    words = ("bake", room / "room.blend", "--output", out, *QUICK)
    assert run(*words)[0] == 1
    assert (out / "lightmap.exr").read_text() == "mine"
    code, _ = run(*words, "--overwrite")
    assert code == 0
    assert broken_result(out) == []


@pytest.mark.parametrize("atlas", ["shared", "per-object"])
def test_the_panel_replaces_no_foreign_file(atlas: str, room: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the names of its files are: they are those of a bake that is gone."""
    bpy.context.scene.radiosity.atlas = atlas
    bake()
    lightmaps = room / "lightmaps"
    names = [path.name for path in lightmaps.iterdir()]
    restore()
    refuse_work(monkeypatch)
    for name in names:
        shutil.rmtree(lightmaps)
        lightmaps.mkdir()
        (lightmaps / name).write_text("mine")
        assert name in refused(bpy.ops.radiosity.bake)
        assert [path.name for path in lightmaps.iterdir()] == [name]
        assert (lightmaps / name).read_text() == "mine"


def test_a_lightmap_that_was_painted_on_is_not_replaced(room: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bake()
    refuse_work(monkeypatch)
    path, told = report_in(room / "lightmaps")
    lightmap = path.parent / images_of(told)[0]
    lightmap.write_bytes(lightmap.read_bytes() + b"painted")
    before = tree(room)
    assert lightmap.name in refused(bpy.ops.radiosity.bake)
    assert changes(before, tree(room)) == []


@pytest.mark.parametrize("place", ["out", "out, --overwrite", "lightmaps"])
def test_textures_of_the_scene_are_never_replaced(place: str, room: Path, run: Run) -> None:
    place, *options = place.split(", ")
    folder = room / place
    bake()
    name = images_of(report_in(room / "lightmaps")[1])[0] if place == "lightmaps" else "lightmap.exr"
    restore()
    shutil.rmtree(room / "lightmaps")
    folder.mkdir()
    picture = bpy.data.images.new("Texture", 4, 4, float_buffer=True)
    picture.filepath_raw, picture.file_format = str(folder / name), "OPEN_EXR"
    picture.save()
    show_picture("White", picture)
    save(room / "room.blend")
    before = tree(folder)
    if place == "out":
        code, told = run("bake", room / "room.blend", "--output", folder, *QUICK, *options)
        assert code in (1, 2)
    else:
        told = refused(bpy.ops.radiosity.bake)
    assert name in told
    assert changes(before, tree(folder)) == []


@pytest.mark.parametrize("option", ["--keep", "--overwrite"])
def test_libraries_of_the_scene_are_never_replaced(option: str, room: Path, run: Run) -> None:
    library = save(room / "out" / "baked.blend")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(library), link=True) as (_found, linked):
        linked.objects = ["Floor", "Lamp"]
    for obj in linked.objects:
        bpy.context.scene.collection.objects.link(obj)
    save(room / "user.blend")
    before = tree(room)
    code, told = run("bake", room / "user.blend", "--output", room / "out", *QUICK, option)
    assert code in (1, 2)
    assert "baked.blend" in told
    assert told.count("\n") == 1
    assert changes(before, tree(room)) == []


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
    set_quick(scene)
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


@pytest.mark.parametrize("overwrite", [(), ("--overwrite",)])
@pytest.mark.parametrize("option", ["--report", "--plot"])
def test_a_second_output_never_replaces_an_input_or_another_output(
    option: str, overwrite: tuple[str, ...], room: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, before = room / "out", tree(room)
    refuse_work(monkeypatch)
    for target in (room / "room.blend", out / "baked.blend", out / "preview.png", Path("/dev/null")):
        words = ("bake", room / "room.blend", "--output", out, *QUICK, option, target, *overwrite)
        code, told = run(*words)
        assert code in (1, 2), f"{option} {target}"
        assert told.count("\n") == 1
        assert changes(before, tree(room)) == []


def test_opening_a_file_touches_nothing(room: Path, tmp_path: Path) -> None:
    """Also where a folder like that of a killed bake lies beside it, which names files elsewhere."""
    bake()
    save(room / "room.blend")
    outside = tmp_path / "mine.txt"
    outside.write_text("mine")
    staging = room / "lightmaps" / ".radiosity-0123456789abcdef-abcd1234"
    (staging / "earlier").mkdir(parents=True)
    (staging / ".owner").write_text("made by Radiosity Lightmaps while it bakes; it cleans up by itself\n")
    notes = room / "lightmaps" / "notes.txt"
    notes.write_text("mine")
    names = {"../../mine.txt": outside, str(outside): outside, "../room.blend": room / "room.blend"}
    files = {
        name: {"new": digest_of_file(path), "old": None}
        for name, path in {**names, notes.name: notes}.items()
    }
    (staging / ".publishing.json").write_text(json.dumps({"version": 2, "files": files}))
    before = tree(tmp_path)
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    assert changes(before, tree(tmp_path)) == []
    bpy.context.scene.radiosity.resolution = 12
    bake()
    assert outside.read_text() == "mine"
    assert notes.read_text() == "mine"


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


@pytest.mark.parametrize("copied", ["the scene", "baked.blend", "baked.blend, next to it"])
def test_a_bake_is_relit_for_no_copy_under_another_name(copied: str, room: Path, run: Run) -> None:
    """Unless it is said that it may be replaced; the file that was baked relights it as before."""
    relight = kept(room, run)
    copy = room / "out" / "copy.blend" if copied.endswith("next to it") else room / "copy.blend"
    shutil.copy(room / "room.blend" if copied == "the scene" else room / "out" / "baked.blend", copy)
    before = tree(room)
    code, told = run(relight[0], str(copy), *relight[2:])
    assert code == 1
    assert told.count("\n") == 1
    assert "room.blend'" in told
    assert f"--relight got scene 'Scene' of '{copy}': give the file that was baked" in told
    assert changes(before, tree(room)) == []
    assert run(*relight)[0] == 0
    assert run(relight[0], str(copy), *relight[2:], "--overwrite")[0] == 0


def test_a_renamed_copy_is_relit_from_the_panel_by_its_own_bake_alone(room: Path) -> None:
    bpy.context.scene.radiosity_relight.sidecar = True
    bake()
    bpy.ops.wm.save_mainfile()
    shutil.copy(room / "room.blend", room / "copy.blend")
    bpy.ops.wm.open_mainfile(filepath=str(room / "copy.blend"))
    before = tree(room)
    next(obj for obj in bpy.data.objects if obj.type == "LIGHT").data.energy *= 2.0
    with pytest.raises(RuntimeError, match=r"no report of this file and scene lists .*: bake again"):
        bpy.ops.radiosity.relight("EXEC_DEFAULT", True)
    assert changes(before, tree(room)) == []
    bake()  # its own files, next to those of the other
    after = tree(room)
    assert {name: after[name] for name in before} == before
    assert len(after) > len(before)


@pytest.mark.parametrize("change", ["a vertex", "a place"])
def test_a_changed_geometry_is_noticed(change: str, room: Path, run: Run) -> None:
    relight = kept(room, run)
    before = tree(room / "out")
    if change == "a vertex":
        bpy.data.meshes["Wall"].vertices[0].co.z += 0.125
    else:
        bpy.data.objects["Wall"].location.y += 0.125
    save(room / "room.blend")
    code, told = run(*relight)
    assert code == 1
    assert told.count("\n") == 1
    assert "Wall" in told
    assert changes(before, tree(room / "out")) == []


@pytest.mark.parametrize("change", ["pixels", "UVs"])
def test_a_changed_texture_is_noticed(change: str, room: Path, run: Run) -> None:
    """A checker is inverted, or its UVs are flipped: the mean of each triangle stays."""
    picture = bpy.data.images.new("Checker", 8, 8)
    rows, columns = np.indices((8, 8)) // 2
    checker = np.ones((8, 8, 4), dtype=np.float32)
    checker[..., :3] = ((rows + columns) % 2)[..., None]
    picture.pixels.foreach_set(checker.ravel())
    picture.pack()
    show_picture("White", picture)
    layer = bpy.data.meshes["Floor"].uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", (0, 0, 1, 0, 1, 1, 0, 1))
    save(room / "room.blend")
    relight = kept(room, run)
    before = tree(room / "out")
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    if change == "pixels":
        picture = bpy.data.images["Checker"]
        picture.pixels.foreach_set(np.ascontiguousarray(checker[:, ::-1]).ravel())
        picture.pack()
    else:
        layer = bpy.data.meshes["Floor"].uv_layers["UVMap"]
        layer.data.foreach_set("uv", (1, 0, 0, 0, 0, 1, 1, 1))
    save(room / "room.blend")
    code, told = run(*relight)
    assert code == 1
    assert "Floor" in told or "White" in told or "Checker" in told
    assert changes(before, tree(room / "out")) == []
