"""The output folder: whole results or none, and copies whose paths are right."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.bake_scene import BakeResult, LightmapPage
from radiosity_addon.blender.images import set_folder, write_pages
from radiosity_addon.blender.output import BLEND_NAME, REPORT_NAME, OutputFolder, save_copy
from radiosity_addon.errors import BakeError
from radiosity_addon.settings import BakeSettings


def _contents(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() if path.is_file() else "<folder>" for path in folder.iterdir()}


def _write(folder: Path, **files: str) -> None:
    for stem, text in files.items():
        (folder / f"{stem}.txt").write_text(text)


def test_publishing_replaces_all_files_and_leaves_others(tmp_path: Path) -> None:
    _write(tmp_path, one="old", mine="keep")
    with OutputFolder(tmp_path) as output:
        _write(output.staging, one="new", two="new")
        (output.staging / REPORT_NAME).write_text("{}")
        assert (tmp_path / "one.txt").read_text() == "old"
        paths = output.publish()
    assert [path.name for path in paths] == ["one.txt", "two.txt", REPORT_NAME]
    assert _contents(tmp_path) == {"one.txt": "new", "two.txt": "new", "mine.txt": "keep", REPORT_NAME: "{}"}


def test_an_error_leaves_the_earlier_result(tmp_path: Path) -> None:
    _write(tmp_path, one="old")
    with pytest.raises(KeyboardInterrupt), OutputFolder(tmp_path) as output:  # noqa: PT012
        _write(output.staging, one="new", two="new")
        raise KeyboardInterrupt
    assert _contents(tmp_path) == {"one.txt": "old"}


def test_publishing_that_fails_midway_is_undone(tmp_path: Path) -> None:
    _write(tmp_path, a="old")
    (tmp_path / "c.txt").mkdir()
    with pytest.raises(BakeError, match=r"c\.txt"), OutputFolder(tmp_path) as output:  # noqa: PT012
        _write(output.staging, a="new", b="new", c="new", d="new")
        output.publish()
    assert _contents(tmp_path) == {"a.txt": "old", "c.txt": "<folder>"}


def test_an_interrupt_while_publishing_is_undone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _write(tmp_path, a="old", b="old")
    replace = Path.replace

    def interrupted(source: Path, target: Path) -> Path:
        if source.read_text() == "new" and source.name == "b.txt":
            raise KeyboardInterrupt
        return replace(source, target)

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt), OutputFolder(tmp_path) as output:  # noqa: PT012
        _write(output.staging, a="new", b="new")
        output.publish()
    assert _contents(tmp_path) == {"a.txt": "old", "b.txt": "old"}


def test_folders_made_for_nothing_are_removed(tmp_path: Path) -> None:
    with OutputFolder(tmp_path / "x" / "y") as output:
        assert output.staging.parent == (tmp_path / "x" / "y").resolve()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    in_the_way = tmp_path / "file"
    with pytest.raises(BakeError, match=r"output folder '.*out'"), OutputFolder(in_the_way / "out"):
        pass
    with pytest.raises(BakeError, match=r"output folder '.*file'"), OutputFolder(tmp_path / "file"):
        pass


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs a folder that nobody can write")
def test_a_folder_nobody_can_write_is_named() -> None:
    with pytest.raises(BakeError, match="/proc/radiosity"), OutputFolder("/proc/radiosity"):
        pass


def _scene_with_picture(folder: Path) -> bpy.types.Image:
    """A picture on disk, used by a material, and a lightmap staged for an output folder."""
    picture = bpy.data.images.new("Picture", 2, 2)
    picture.filepath_raw, picture.file_format = str(folder / "picture.png"), "PNG"
    picture.save()
    picture.use_fake_user = True
    return picture


def _stage_lightmap(output: OutputFolder) -> bpy.types.Image:
    page = LightmapPage(np.full((2, 2, 3), 7.5, np.float32), np.ones((2, 2), bool))
    (image,) = write_pages(BakeResult((page,), (), {}, ()), BakeSettings(), output.staging)
    set_folder([image], output.path)
    image.use_fake_user = True
    return image


@pytest.mark.parametrize("saved", [True, False], ids=["saved", "unsaved"])
def test_the_copy_finds_its_lightmaps_and_the_scene_s_pictures(tmp_path: Path, saved: bool) -> None:
    (tmp_path / "scene").mkdir()
    picture = _scene_with_picture(tmp_path / "scene")
    if saved:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene" / "scene.blend"))
        picture.filepath_raw = "//picture.png"
    path_before, picture_before = bpy.data.filepath, picture.filepath_raw
    out = tmp_path / "elsewhere" / "out"
    with OutputFolder(out) as output:
        image = _stage_lightmap(output)
        lightmap_before = image.filepath_raw
        save_copy(output.staging / BLEND_NAME, output.path)
        assert (bpy.data.filepath, picture.filepath_raw) == (path_before, picture_before)
        assert image.filepath_raw == lightmap_before
        output.publish()
    assert sorted(path.name for path in out.iterdir()) == [BLEND_NAME, "lightmap.exr"]

    bpy.ops.wm.open_mainfile(filepath=str(out / BLEND_NAME))
    assert bpy.data.images["lightmap.exr"].filepath_raw == "//lightmap.exr"
    assert bpy.data.images["lightmap.exr"].pixels[0] == 7.5
    found = Path(bpy.path.abspath(bpy.data.images["Picture"].filepath_raw))
    assert found.resolve() == (tmp_path / "scene" / "picture.png").resolve()


def test_the_copy_is_compressed_and_replaces_an_older_one(tmp_path: Path) -> None:
    (tmp_path / "copy.blend").write_text("old")
    save_copy(tmp_path / "copy.blend")
    assert (tmp_path / "copy.blend").read_bytes()[:4] == bytes.fromhex("28b52ffd")  # Zstandard
    assert [path.name for path in tmp_path.iterdir()] == ["copy.blend"]


def test_the_scene_itself_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / BLEND_NAME
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    before = path.read_bytes()
    with OutputFolder(tmp_path) as output, pytest.raises(BakeError, match="is the scene itself"):
        save_copy(output.staging / BLEND_NAME, output.path)
    assert path.read_bytes() == before


def test_a_copy_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(BakeError, match=r"gone/copy\.blend"):
        save_copy(tmp_path / "gone" / "copy.blend")
