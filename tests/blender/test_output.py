"""The output folder: whole results or none, and copies whose paths are right."""

from __future__ import annotations

import json
import os
from pathlib import Path

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.bake.result.report import BakeReport
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.files.output import OutputFolder
from radiosity_addon.blender.files.saved_files import save_copy, save_scene
from radiosity_addon.blender.images.images import set_folder, write_pages
from radiosity_addon.files.baked_files import digest_of_file, read_report
from radiosity_addon.files.file_names import BLEND_NAME, REPORT_NAME
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings

REPORT = BakeReport({"version": 2, "objects": [], "solver": {}})


def _contents(folder: Path) -> dict[str, str]:
    """What the files of a folder hold; reports prove themselves in other tests."""
    return {
        path.name: path.read_text() if path.is_file() else "<folder>"
        for path in folder.iterdir()
        if path.name != REPORT_NAME
    }


def _write(folder: Path, **files: str) -> None:
    for stem, text in files.items():
        (folder / f"{stem}.exr").write_text(text)


def _bake(folder: Path, *, overwrite: bool = False, **files: str) -> list[Path]:
    """Publish files as a bake does."""
    with OutputFolder(folder, overwrite=overwrite) as output:
        _write(output.staging, **files)
        output.write_report(REPORT)
        return output.publish()


def test_publishing_replaces_all_files_and_leaves_others(tmp_path: Path) -> None:
    _bake(tmp_path, one="old")
    _write(tmp_path, mine="keep")
    with OutputFolder(tmp_path) as output:
        _write(output.staging, one="new", two="new")
        output.write_report(REPORT)
        assert (tmp_path / "one.exr").read_text() == "old"
        paths = output.publish()
    assert [path.name for path in paths] == ["one.exr", "two.exr", REPORT_NAME]
    assert _contents(tmp_path) == {"one.exr": "new", "two.exr": "new", "mine.exr": "keep"}
    assert sorted(read_report(tmp_path / REPORT_NAME)["files"]) == ["one.exr", "two.exr"]


def test_an_error_leaves_the_earlier_result(tmp_path: Path) -> None:
    _bake(tmp_path, one="old")
    before = digests(tmp_path)
    with pytest.raises(KeyboardInterrupt), OutputFolder(tmp_path) as output:  # noqa: PT012
        _write(output.staging, one="new", two="new")
        raise KeyboardInterrupt
    assert digests(tmp_path) == before


def test_publishing_that_fails_midway_is_undone(tmp_path: Path) -> None:
    _bake(tmp_path, a="old")
    before = digests(tmp_path)
    with pytest.raises(BakeError, match=r"c\.exr"), OutputFolder(tmp_path) as output:  # noqa: PT012
        _write(output.staging, a="new", b="new", c="new", d="new")
        output.write_report(REPORT)
        (tmp_path / "c.exr").mkdir()
        output.publish()
    (tmp_path / "c.exr").rmdir()
    assert digests(tmp_path) == before


def test_an_interrupt_while_publishing_is_undone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _bake(tmp_path, a="old", b="old")
    before = digests(tmp_path)
    replace = Path.replace

    def interrupted(source: Path, target: Path) -> Path:
        if source.name == "b.exr" and source.read_text() == "new":
            raise KeyboardInterrupt
        return replace(source, target)

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt), OutputFolder(tmp_path) as output:  # noqa: PT012
        _write(output.staging, a="new", b="new")
        output.publish()
    assert digests(tmp_path) == before


def digests(folder: Path) -> dict[str, str]:
    """The files of a folder, hidden ones too, by what they hold."""
    return {path.name: digest_of_file(path) for path in folder.iterdir()}


FOREIGN = ["one.exr", "report.json", "baked.blend", "preview.png", "lightmap.relight"]


@pytest.mark.parametrize("name", FOREIGN)
def test_files_that_no_bake_has_written_are_never_replaced(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("years of work")
    with pytest.raises(BakeError) as caught, OutputFolder(tmp_path) as output:
        output.expect([name])
    assert str(tmp_path / name) in str(caught.value)
    assert "--overwrite" in str(caught.value)
    # Nor if one appears while the bake goes on.
    with pytest.raises(BakeError, match=name), OutputFolder(tmp_path / "new") as output:  # noqa: PT012
        output.expect([name])
        (output.staging / name).write_text("a bake's")
        (tmp_path / "new" / name).write_text("years of work")
        output.publish()
    for folder in (tmp_path, tmp_path / "new"):
        assert (folder / name).read_text() == "years of work"
        assert [path.name for path in folder.iterdir() if path.name != "new"] == [name]
    with OutputFolder(tmp_path, overwrite=True) as output:
        output.expect([name])
        (output.staging / name).write_text("a bake's")
        output.publish()
    assert (tmp_path / name).read_text() == "a bake's"


def test_a_lightmap_that_somebody_changed_is_not_replaced(tmp_path: Path) -> None:
    _bake(tmp_path, one="light")
    (tmp_path / "one.exr").write_text("paint")
    with pytest.raises(BakeError, match=r"one\.exr'.*changed"), OutputFolder(tmp_path) as output:
        output.expect(["one.exr"])
    with pytest.raises(BakeError, match=r"one\.exr"):
        _bake(tmp_path, one="new")
    assert (tmp_path / "one.exr").read_text() == "paint"
    (tmp_path / "one.exr").rename(tmp_path / "mine.exr")
    _bake(tmp_path, one="new")
    assert _contents(tmp_path) == {"one.exr": "new", "mine.exr": "paint"}


def test_another_scene_or_file_does_not_get_the_folder(tmp_path: Path) -> None:
    out = tmp_path / "out"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "one.blend"))
    _bake(out, one="old")
    before = digests(out)
    bpy.context.scene.name = "Other"
    with pytest.raises(BakeError, match=r"report\.json'.*'Scene'.*one\.blend'"):
        _bake(out, one="new")
    bpy.context.scene.name = "Scene"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "two.blend"))
    with pytest.raises(BakeError, match=r"one\.blend"):
        _bake(out, one="new")
    assert digests(out) == before
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "one.blend"))
    _bake(out, one="new")
    assert _contents(out) == {"one.exr": "new"}


def test_a_report_of_an_earlier_version_is_refused_by_name(tmp_path: Path) -> None:
    old = {"version": 1, "objects": [], "solver": {}, "files": {}}
    (tmp_path / REPORT_NAME).write_text(json.dumps(old))
    with pytest.raises(BakeError, match=r"report\.json'.*earlier"):
        _bake(tmp_path, one="new")


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
@pytest.mark.parametrize("overwrite", [False, True])
def test_links_and_folders_are_never_replaced(tmp_path: Path, overwrite: bool) -> None:
    (tmp_path / "victim").write_text("years of work")
    out = tmp_path / "out"
    out.mkdir()
    (out / "one.exr").symlink_to(tmp_path / "victim")
    (out / "two.exr").symlink_to(tmp_path / "nowhere")
    (out / "three.exr").mkdir()
    os.mkfifo(out / "four.exr")
    for name in ("one", "two", "three", "four"):
        with pytest.raises(BakeError, match=name), OutputFolder(out, overwrite=overwrite) as output:
            output.expect([f"{name}.exr"])
        with pytest.raises(BakeError, match=name):
            _bake(out, overwrite=overwrite, **{name: "new"})
    assert (tmp_path / "victim").read_text() == "years of work"
    assert (out / "one.exr").is_symlink()
    assert not (tmp_path / "nowhere").exists()
    assert not (out / REPORT_NAME).exists()


def test_what_the_scene_reads_is_not_even_overwritten(tmp_path: Path) -> None:
    _scene_with_picture(tmp_path)
    bpy.data.images["Picture"].filepath_raw = str(tmp_path / "one.exr")
    _write(tmp_path, one="a texture", frame_001="of a sequence", frame_002="of a sequence")
    sequence = bpy.data.images.new("Frames", 2, 2)
    sequence.source, sequence.filepath_raw = "SEQUENCE", str(tmp_path / "frame_001.exr")
    for name in ("one.exr", "frame_001.exr", "frame_002.exr"):
        with (
            pytest.raises(BakeError, match=f"{name}.*reads"),
            OutputFolder(tmp_path, overwrite=True) as output,
        ):
            output.expect([name])


def test_an_unsaved_file_is_not_the_next_unsaved_file(tmp_path: Path) -> None:
    radiosity_addon.register()
    try:
        _bake(tmp_path, one="old")
        _bake(tmp_path, one="new")
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        with pytest.raises(BakeError, match=r"report\.json"):
            _bake(tmp_path, one="other")
        assert _contents(tmp_path) == {"one.exr": "new"}
    finally:
        radiosity_addon.unregister()


def test_no_message_names_the_staging_folder(tmp_path: Path) -> None:
    def failing(error: type[Exception], *given: object) -> str:
        with pytest.raises(BakeError) as caught, OutputFolder(tmp_path) as output:
            raise error(*(str(each).format(staging=output.staging, aside=output.aside) for each in given))
        return str(caught.value)

    assert failing(BakeError, "cannot write '{staging}/one.exr'") == f"cannot write '{tmp_path}/one.exr'"
    assert failing(BakeError, "cannot write '{aside}'") == f"cannot write '{tmp_path}/baked.blend'"
    with pytest.raises(BakeError) as caught, OutputFolder(tmp_path) as output:
        raise OSError(28, "No space left on device", str(output.staging / "one.exr"))
    assert str(caught.value) == f"cannot write '{tmp_path}/one.exr': No space left on device"
    # As `write` fails, which knows no name.
    with pytest.raises(BakeError, match=str(tmp_path)), OutputFolder(tmp_path):
        raise OSError(28, "No space left on device")
    with pytest.raises(FileNotFoundError), OutputFolder(tmp_path):
        raise FileNotFoundError(2, "No such file", "elsewhere")


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
        save_copy(output)
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
    save_scene(tmp_path / "copy.blend")
    assert (tmp_path / "copy.blend").read_bytes()[:4] == bytes.fromhex("28b52ffd")  # Zstandard
    assert [path.name for path in tmp_path.iterdir()] == ["copy.blend"]


def test_the_scene_itself_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / BLEND_NAME
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    before = path.read_bytes()
    with OutputFolder(tmp_path) as output, pytest.raises(BakeError, match="scene itself"):
        save_copy(output)
    assert path.read_bytes() == before


def test_a_copy_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(BakeError, match=r"gone/copy\.blend"):
        save_scene(tmp_path / "gone" / "copy.blend")
