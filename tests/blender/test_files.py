"""Scene files of every kind open; what cannot be opened says so in one line."""

from __future__ import annotations

import json
import os
from pathlib import Path

import addon_utils
import bpy
import pytest

from radiosity_addon.base.errors import SceneError
from radiosity_addon.blender.files.files import empty_scene, open_scene
from tests.blender.scenes import add_lamp, add_mesh


def _default_startup() -> None:
    """What a user sees first: a cube, a lamp and a camera, which no import may keep."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    assert "Cube" in bpy.data.objects


def _scene_with_a_lamp() -> None:
    empty_scene()
    add_mesh("Table", location=(1, 2, 3))
    add_lamp("POINT", "Bulb", energy=10.0)


def test_a_blend_opens_and_becomes_the_current_file(tmp_path: Path) -> None:
    path = tmp_path / "scene.blend"
    _scene_with_a_lamp()
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    _default_startup()
    open_scene(path)
    assert {obj.name for obj in bpy.data.objects} == {"Table", "Bulb"}
    assert Path(bpy.data.filepath) == path


@pytest.mark.parametrize("kind", ["glb", "gltf"])
@pytest.mark.parametrize("enabled", [True, False])
def test_gltf_comes_into_an_empty_scene_with_its_lamps(tmp_path: Path, kind: str, enabled: bool) -> None:
    path = tmp_path / f"scene.{kind}"
    _scene_with_a_lamp()
    file_format = {"glb": "GLB", "gltf": "GLTF_SEPARATE"}[kind]
    bpy.ops.export_scene.gltf(filepath=str(path), export_format=file_format, export_lights=True)
    if not enabled:
        addon_utils.disable("io_scene_gltf2")
    _default_startup()
    open_scene(str(path))
    names = {obj.name for obj in bpy.data.objects if obj.type in ("MESH", "LIGHT")}
    assert names == {"Table", "Bulb"}
    lamp = next(obj for obj in bpy.data.objects if obj.type == "LIGHT")
    assert lamp.data.energy == pytest.approx(10.0, rel=1e-3)
    assert tuple(bpy.data.objects["Table"].matrix_world.translation) == pytest.approx((1, 2, 3), abs=1e-5)


def test_obj_comes_into_an_empty_scene_standing_upright(tmp_path: Path) -> None:
    path = tmp_path / "scene.OBJ"
    path.write_text("o Wall\nv 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n")
    _default_startup()
    open_scene(path)
    (obj,) = bpy.data.objects
    heights = [(obj.matrix_world @ vertex.co).z for vertex in obj.data.vertices]
    assert max(heights) == pytest.approx(2)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("broken.blend", b"BLENDER" + b"?" * 400, "cannot be read"),
        ("text.blend", b"hello\n" * 100, "cannot be read"),
        ("broken.glb", b"glTF" + b"?" * 400, "cannot be read"),
        ("broken.gltf", b'{"asset":', "cannot be read"),
        ("empty.gltf", json.dumps({"asset": {"version": "2.0"}}).encode(), "cannot be read"),
        ("broken.obj", b"\xff\xfe\x00 hello\n", "no object"),
        ("empty.obj", b"", "is empty"),
        ("scene.fbx", b"Kaydara", "supported"),
        ("scene", b"?", "supported"),
    ],
)
def test_what_cannot_be_opened_is_an_error_of_one_line(
    tmp_path: Path, name: str, content: bytes, words: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(SceneError) as caught:
        open_scene(path)
    message = str(caught.value)
    assert str(path) in message
    assert words in message
    assert "\n" not in message


def _triangle(damage: dict) -> bytes:
    """A glTF file of a triangle whose buffer holds one number."""
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAA"}],
    }
    return json.dumps(tree | damage).encode()


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ({}, "buffer is smaller than requested"),
        ({"buffers": [{"byteLength": 36, "uri": "gone.bin"}]}, "gone.bin"),
        ({"nodes": [{"mesh": 7}]}, "node 0"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "parent"),
        ({"nodes": [{"name": "Empty", "extensions": []}]}, "parse glTF"),
    ],
)
def test_the_cause_is_reported_and_nothing_is_printed(
    damage: dict, words: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "damaged.gltf"
    path.write_bytes(_triangle(damage))
    with pytest.raises(SceneError) as caught:
        open_scene(path)
    message = str(caught.value)
    assert words in message
    assert "Location:" not in message
    assert "\n" not in message
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(os.name == "nt", reason="devices of POSIX")
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("scene.gltf", '{"asset": {"version": "2.0"}, "buffers": [{"uri": "/dev/null", "byteLength": 4}]}'),
        ("scene.obj", "mtllib /dev/null\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    ],
)
def test_a_scene_that_refers_to_a_device_is_refused(name: str, text: str, tmp_path: Path) -> None:
    """One like /dev/zero would be read until the memory is full."""
    (tmp_path / name).write_text(text)
    with pytest.raises(SceneError, match="/dev/null"):
        open_scene(tmp_path / name)


def test_a_missing_file_and_a_folder_are_errors(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"missing\.blend.*exist"):
        open_scene(tmp_path / "missing.blend")
    (tmp_path / "folder.blend").mkdir()
    with pytest.raises(SceneError, match=r"folder\.blend.*file"):
        open_scene(tmp_path / "folder.blend")


def test_an_empty_scene_has_no_objects() -> None:
    _default_startup()
    empty_scene()
    assert len(bpy.data.objects) == 0
