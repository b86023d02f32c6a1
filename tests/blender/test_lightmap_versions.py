"""Undo, redo, saving and opening in any order: pictures, files and UVs are always of one bake."""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.datablocks.image_marks import REPORT, VERSION
from radiosity_addon.blender.relight.relight_scene import kept_bakes, lightmap_versions
from radiosity_addon.blender.session.state import session
from radiosity_addon.files.baked_files import LISTED, read_report
from tests.blender.scenes import add_lamp, add_mesh

Array = np.ndarray[Any, Any]


@pytest.fixture
def room(registered: None, tmp_path: Path) -> Path:
    """A saved file with two objects and a lamp."""
    add_mesh("Floor")
    add_mesh("Wall", rotation_euler=(1.57, 0, 0), location=(0, 1, 0.5), scale=(1, 0.5, 1))
    add_lamp("POINT", "Bulb", {"location": (-0.5, 0.3, 1.2)}, energy=40.0, shadow_soft_size=0.1)
    scene = bpy.context.scene
    scene.radiosity.resolution, scene.radiosity.quality = 16, "sketch"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    bpy.ops.ed.undo_push(message="saved")
    return tmp_path


def bake(**settings: Any) -> None:
    for name, value in settings.items():
        setattr(bpy.context.scene.radiosity, name, value)
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}


def relight(energy: float) -> None:
    bpy.data.objects["Bulb"].data.energy = energy
    assert bpy.ops.radiosity.relight("EXEC_DEFAULT", True) == {"FINISHED"}


def restore() -> None:
    assert bpy.ops.radiosity.restore("EXEC_DEFAULT", True) == {"FINISHED"}


@dataclass(frozen=True)
class Seen:
    """What the file shows: pixels of its lightmaps, and UVs of its objects."""

    pixels: dict[str, bytes]
    uvs: dict[str, bytes]
    mark: str


def values_of(image: bpy.types.Image) -> Array:
    """The pixels of an image; of a PNG in the steps that it has, which loading may round otherwise."""
    values = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(values)
    return np.rint(values * 65535.0).astype(np.int32) if image.file_format == "PNG" else values


def seen() -> Seen:
    pixels, uvs = {}, {}
    for image in lightmap_versions.lightmaps():
        pixels[image.name] = values_of(image).tobytes()
    for obj in bpy.data.objects:
        layer = obj.data.uv_layers.get("Lightmap") if obj.type == "MESH" else None
        if layer is not None:
            corners = np.empty(2 * len(layer.data), dtype=np.float32)
            layer.data.foreach_get("uv", corners)
            uvs[obj.name] = corners.tobytes()
    return Seen(pixels, uvs, kept_bakes.mark_of(bpy.context.scene))


def lightmap_file(room: Path) -> Path:
    """The only lightmap of a room that was baked from the panel."""
    (path,) = (room / "lightmaps").glob("*.exr")
    return path


def assert_files_agree() -> None:
    """What is on the disk is what the images say, and the report lists it."""
    assert not lightmap_versions.state.message
    for image in lightmap_versions.lightmaps():
        if image.packed_file is not None:
            continue
        path = Path(bpy.path.abspath(image.filepath_raw))
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        assert digest == image[VERSION]
        report = read_report(path.with_name(image[REPORT]))
        assert report[LISTED][path.name]["sha256"] == digest
        on_disk = bpy.data.images.load(str(path))
        on_disk.colorspace_settings.name = "Non-Color"
        assert np.array_equal(values_of(on_disk), values_of(image))
        bpy.data.images.remove(on_disk)


def test_undo_of_a_second_bake_brings_the_first_picture_back(room: Path) -> None:
    """Also after saving and opening: the defect showed the old UVs with the new picture."""
    bake()
    first = seen()
    report = json.loads(next((room / "lightmaps").glob("*report.json")).read_text())
    bpy.data.objects["Bulb"].data.energy = 200.0
    bake(resolution=24)
    second = seen()
    assert first.uvs != second.uvs
    bpy.ops.ed.undo()
    assert seen() == first
    assert_files_agree()
    restored = json.loads(next((room / "lightmaps").glob("*report.json")).read_text())
    assert restored["objects"] == report["objects"]
    bpy.ops.ed.redo()
    assert seen() == second
    assert_files_agree()
    bpy.ops.ed.undo()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    assert seen() == first
    assert_files_agree()


def test_undo_of_restore_offers_a_relight_that_works(room: Path) -> None:
    bake()
    first = seen()
    restore()
    assert not bpy.ops.radiosity.relight.poll()
    bpy.ops.ed.undo()
    assert seen() == first
    assert bpy.ops.radiosity.relight.poll()
    relight(90.0)
    relit = seen()
    assert relit.pixels != first.pixels
    bpy.ops.ed.undo()
    assert seen() == first
    bpy.ops.ed.redo()
    assert seen() == relit
    assert_files_agree()


def test_a_relight_that_would_fail_is_not_offered(room: Path) -> None:
    bake()
    restore()
    bpy.ops.ed.undo()
    session.kept_bakes.clear()
    assert not bpy.ops.radiosity.relight.poll()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["file", "packed", "objects", "png16"])
def test_any_order_of_bake_relight_restore_undo_redo_and_opening(room: Path, seed: int, kind: str) -> None:
    """A model remembers what was seen after each step; the file must show it again, to the last bit."""
    chance = np.random.default_rng([seed, len(kind)])
    scene = bpy.context.scene
    if kind == "objects":
        scene.radiosity.atlas = "per-object"
    elif kind == "png16":
        scene.radiosity.format = "png16"
    elif kind == "packed":
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        add_mesh("Floor")
        add_lamp("POINT", "Bulb", {"location": (-0.5, 0.3, 1.2)}, energy=40.0, shadow_soft_size=0.1)
        bpy.context.scene.radiosity.quality = "draft"
    bpy.ops.ed.undo_push(message="begin")
    history, at = [seen()], 0
    for _ in range(14):
        step = chance.choice(["bake", "relight", "restore", "undo", "undo", "undo", "redo", "redo", "open"])
        if step == "bake":
            bpy.data.objects["Bulb"].data.energy = float(chance.uniform(10.0, 99.0))
            bake(resolution=int(chance.choice([8, 12, 16])))
        elif step == "relight" and bpy.ops.radiosity.relight.poll():
            relight(float(chance.uniform(10.0, 99.0)))
        elif step == "restore" and lightmap_versions.lightmaps():
            restore()
        elif step == "undo" and at > 0:
            bpy.ops.ed.undo()
            at -= 1
        elif step == "redo" and at < len(history) - 1:
            bpy.ops.ed.redo()
            at += 1
        elif step == "open" and kind != "packed":
            bpy.ops.wm.save_mainfile()
            bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
            bpy.ops.ed.undo_push(message="opened")
            assert seen() == history[at]
            history, at = [seen()], 0
        else:
            continue
        if step in ("bake", "relight", "restore"):
            at += 1
            history = [*history[:at], seen()]
        assert seen() == history[at], step
        assert_files_agree()


def test_what_is_no_longer_held_is_said_and_not_shown_silently(room: Path) -> None:
    bake()
    bake(resolution=24)
    assert lightmap_versions.state.held is not None
    lightmap_versions.state.held.close()
    bpy.ops.ed.undo()
    assert "another bake" in lightmap_versions.state.message
    bpy.ops.ed.redo()
    assert not lightmap_versions.state.message
    assert_files_agree()


def test_a_version_that_was_changed_meanwhile_is_not_brought_back(room: Path) -> None:
    bake()
    bake(resolution=24)
    newest = lightmap_file(room).read_bytes()
    (version,) = Path(bpy.app.tempdir).glob("radiosity-versions-*/*")
    version.write_bytes(b"changed")
    bpy.ops.ed.undo()
    assert "another bake" in lightmap_versions.state.message
    assert lightmap_file(room).read_bytes() == newest


def test_opening_an_older_file_says_so_and_touches_nothing(room: Path) -> None:
    bake()
    bpy.ops.wm.save_mainfile()
    bake(resolution=24)
    folder = room / "lightmaps"
    before = {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.iterdir()}
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    assert "another bake" in lightmap_versions.state.message
    assert {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.iterdir()} == before
    bake()
    assert_files_agree()


def test_nothing_is_left_behind(room: Path) -> None:
    bake()
    bake(resolution=24)
    assert list(Path(bpy.app.tempdir).glob("radiosity-versions-*"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert not list(Path(bpy.app.tempdir).glob("radiosity-versions-*"))


def test_a_failure_while_relighting_leaves_the_version(room: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from radiosity_addon.base.errors import BakeError
    from radiosity_addon.blender.files.output import OutputFolder

    def full(*_: object) -> None:
        raise BakeError("the disk is full")

    bake()
    before = seen()
    monkeypatch.setattr(OutputFolder, "publish", full)
    with pytest.raises(RuntimeError, match="disk is full"):
        relight(80.0)
    monkeypatch.undo()
    assert seen() == before
    assert_files_agree()
    relight(80.0)
    bpy.ops.ed.undo()
    assert seen() == before


@pytest.mark.one_blender
def test_our_share_of_an_undo_step_is_small(room: Path) -> None:
    """Comparing takes far less than 100 ms, whatever the size of pages; a window does no more at once."""
    bake(resolution=256)
    bake(resolution=250)
    lightmap_versions.differing()
    started = time.thread_time()
    for _ in range(10):
        lightmap_versions.differing()
    assert time.thread_time() - started < 10 * 0.01 / 16  # a sixteenth of 1024²
