"""The list of what bakes have written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from radiosity_addon.manifest import entries, forget, is_as_written, listed


def test_new_files_join_those_of_earlier_bakes_that_are_still_there(tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    for name in ("old.exr", "gone.exr", "new.exr"):
        (tmp_path / name).write_text(name)
    earlier = entries([tmp_path / "old.exr", tmp_path / "gone.exr"], report, "")
    report.write_text(json.dumps({"version": 1, "files": earlier}))
    (tmp_path / "gone.exr").unlink()
    told = entries([tmp_path / "new.exr"], report, "/scenes/room.blend")
    assert sorted(told) == ["new.exr", "old.exr"]
    assert told["new.exr"]["scene"] == "/scenes/room.blend"
    assert told["new.exr"]["bytes"] == len("new.exr")


def test_a_changed_file_is_not_as_written(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    path.write_text("light")
    told = entries([path], tmp_path / "report.json", "")["a.exr"]
    assert is_as_written(path, told)
    path.write_text("dark!")
    assert not is_as_written(path, told)
    path.unlink()
    assert not is_as_written(path, told)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"files": 3}',
        '{"files": {"a": {}}}',
        '{"files": {"../a": {"bytes": 1, "sha256": "", "scene": ""}}}',
    ],
)
def test_what_is_no_list_of_ours_lists_nothing(tmp_path: Path, text: str) -> None:
    (tmp_path / "report.json").write_text(text)
    assert listed(tmp_path / "report.json") == {}
    assert listed(tmp_path / "missing.json") == {}


def test_forgetting_keeps_the_rest_of_the_report(tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    (tmp_path / "a.exr").write_text("a")
    report.write_text(json.dumps({"version": 1, "files": entries([tmp_path / "a.exr"], report, "")}))
    forget(report, ["a.exr"])
    assert json.loads(report.read_text()) == {"version": 1, "files": {}}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr", "report.json"]
