"""Which files are ours, and whose."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from radiosity_addon.files.baked_files import (
    NoReportError,
    Owner,
    entries,
    is_as_written,
    read_report,
    reports_in,
    sealed,
    text_of,
    without,
)


def written(folder: Path, owner: Owner, name: str = "report.json", *files: str) -> Path:
    """A report with its seal."""
    listed = entries(files, folder, folder, None)
    report = {"version": 2, "baked": owner.recorded(folder), "files": listed, "seconds": {"solve": 0.1}}
    (folder / name).write_text(text_of(sealed(report)), encoding="utf-8")
    return folder / name


def test_new_files_join_those_of_earlier_bakes_that_are_still_there(tmp_path: Path) -> None:
    for name in ("old.exr", "gone.exr", "new.exr"):
        (tmp_path / name).write_text(name)
    earlier = {"files": entries(["old.exr", "gone.exr"], tmp_path, tmp_path, None)}
    (tmp_path / "gone.exr").unlink()
    told = entries(["new.exr"], tmp_path, tmp_path, earlier)
    assert sorted(told) == ["new.exr", "old.exr"]
    assert told["new.exr"]["bytes"] == len("new.exr")


def test_a_changed_file_is_not_as_written(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    path.write_text("light")
    told = entries(["a.exr"], tmp_path, tmp_path, None)["a.exr"]
    assert is_as_written(path, told)
    (tmp_path / "link.exr").symlink_to(path)
    assert not is_as_written(tmp_path / "link.exr", told)
    path.write_text("dark!")
    assert not is_as_written(path, told)
    path.unlink()
    assert not is_as_written(path, told)


def test_a_report_proves_itself_and_any_change_is_noticed(tmp_path: Path) -> None:
    owner = Owner(str(tmp_path / "Küche.blend"), "Scène")
    (tmp_path / "a.exr").write_text("a")
    path = written(tmp_path, owner, "report.json", "a.exr")
    report = read_report(path)
    assert report["baked"] == {"file": "Küche.blend", "scene": "Scène"}
    assert list(report["files"]) == ["a.exr"]
    # As another program may have laid it out.
    path.write_text(json.dumps(json.loads(path.read_text()), sort_keys=True))
    assert read_report(path) == report
    for change in ({"seconds": {"solve": 0.2}}, {"files": {}}, {"more": 1}):
        path.write_text(json.dumps({**report, **change}))
        with pytest.raises(NoReportError):
            read_report(path)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        "\0",
        "[" * 100_000,
        '{"files": 3}',
        '{"files": {"a": {}}, "seal": "x"}',
        '{"seal": null, "baked": 3}',
    ],
)
def test_what_is_no_report_of_ours_is_none(tmp_path: Path, text: str) -> None:
    (tmp_path / "report.json").write_text(text)
    with pytest.raises(NoReportError):
        read_report(tmp_path / "report.json")
    with pytest.raises(FileNotFoundError):
        read_report(tmp_path / "missing.json")
    (tmp_path / "link.json").symlink_to(tmp_path / "report.json")
    for other in (tmp_path / "link.json", tmp_path):
        with pytest.raises(NoReportError):
            read_report(other)


def test_a_report_of_the_first_version_is_named_so(tmp_path: Path) -> None:
    told = {"version": 1, "objects": [], "solver": {}, "files": {}}
    (tmp_path / "report.json").write_text(json.dumps(told))
    with pytest.raises(NoReportError, match="earlier version"):
        read_report(tmp_path / "report.json")


def test_names_that_no_bake_gives_are_left_out(tmp_path: Path) -> None:
    of = {"bytes": 1, "sha256": "0"}
    names = (
        "../a.exr",
        "sub/a.exr",
        "thesis.odt",
        ".a.exr",
        "",
        "a.exr",
        "baked.blend",
        "my.blend",
        "x.relight",
    )
    report = {"baked": {"file": "<x>", "scene": "S"}, "files": dict.fromkeys(names, of)}
    (tmp_path / "report.json").write_text(text_of(sealed(report)))
    assert sorted(read_report(tmp_path / "report.json")["files"]) == ["a.exr", "baked.blend", "x.relight"]


def test_files_belong_to_one_file_and_one_scene(tmp_path: Path) -> None:
    blend = tmp_path / "kitchen.blend"
    owner = Owner(str(blend), "Scene")
    folder = tmp_path / "maps"
    folder.mkdir()
    written(folder, owner)
    assert list(reports_in(folder, owner.owns)) == ["report.json"]
    for other in (
        Owner(str(blend), "Scene.001"),
        Owner(str(tmp_path / "bath.blend"), "Scene"),
        Owner("<x>", "Scene"),
    ):
        assert reports_in(folder, other.owns) == {}
    assert list(reports_in(folder, Owner(str(blend), "Scene.001").is_source_of)) == ["report.json"]


def test_a_project_that_is_moved_as_a_whole_keeps_its_files(tmp_path: Path) -> None:
    (tmp_path / "one" / "maps").mkdir(parents=True)
    written(tmp_path / "one" / "maps", Owner(str(tmp_path / "one" / "room.blend"), "Scene"))
    shutil.copytree(tmp_path / "one", tmp_path / "two")
    shutil.copytree(tmp_path / "one" / "maps", tmp_path / "three" / "deep" / "maps")
    owner = Owner(str(tmp_path / "two" / "room.blend"), "Scene")
    assert reports_in(tmp_path / "two" / "maps", owner.owns)
    assert not reports_in(tmp_path / "three" / "deep" / "maps", owner.owns)
    # What stays behind is still the first one's alone.
    assert not reports_in(tmp_path / "one" / "maps", owner.owns)


def test_the_copy_next_to_a_report_counts_as_the_scene_it_copies(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "baked.blend").write_text("copy")
    written(tmp_path / "out", Owner(str(tmp_path / "room.blend"), "Scene"), "report.json", "baked.blend")
    copy = Owner(str(tmp_path / "out" / "baked.blend"), "Scene")
    assert reports_in(tmp_path / "out", copy.owns)
    assert not reports_in(tmp_path / "out", Owner(str(tmp_path / "baked.blend"), "Scene").owns)


def test_forgetting_keeps_the_rest_of_the_report(tmp_path: Path) -> None:
    for name in ("a.exr", "b.exr"):
        (tmp_path / name).write_text(name)
    path = written(tmp_path, Owner("<x>", "S"), "report.json", "a.exr", "b.exr")
    report = read_report(path)
    path.write_text(text_of(without(report, ["a.exr"])))
    left = read_report(path)
    assert list(left["files"]) == ["b.exr"]
    assert {key: left[key] for key in ("version", "baked", "seconds")} == {
        key: report[key] for key in ("version", "baked", "seconds")
    }
