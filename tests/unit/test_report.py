"""The report says what the format promises, in plain JSON."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_addon.bake_scene import BakeResult, BakeWarning, LightmapPage
from radiosity_addon.errors import BakeError
from radiosity_addon.report import BakeReport, LightmapFile

SOLVER = {
    "closure_area_mean": np.float32(0.5),
    "elements": np.int64(8),
    "links": 12,
    "rays": 345,
    "iterations": 3,
    "residual": float("nan"),
    "power_W": {"emitted": np.array([1.0, 2.0, 3.0]), "absorbed": 0.75, "escaped": 0.25},
    "something_else": object(),
}


def _report(files: tuple[LightmapFile, ...]) -> BakeReport:
    pages = (
        LightmapPage(np.zeros((4, 8, 3), np.float32), np.ones((4, 8), bool)),
        LightmapPage(np.zeros((2, 2, 3), np.float32), np.ones((2, 2), bool)),
    )
    names = ("Wände", "B")
    baked = tuple(SimpleNamespace(object=SimpleNamespace(name=n), page=i) for i, n in enumerate(names))
    result = BakeResult(pages, baked, SOLVER, (BakeWarning("B", "something is odd"),))
    return BakeReport.of(result, files, {"export": 0.123456, "solve": 2})


def test_the_file_holds_what_the_format_promises(tmp_path: Path) -> None:
    report = _report((LightmapFile("a.exr"), LightmapFile("b.exr")))
    report.write(tmp_path / "report.json")
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]
    read = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert read == report.as_dict()
    assert read == {
        "version": 1,
        "objects": [
            {"object": "Wände", "uv_layer": "Lightmap", "image": "a.exr", "resolution": [8, 4], "atlas": 0},
            {"object": "B", "uv_layer": "Lightmap", "image": "b.exr", "resolution": [2, 2], "atlas": 1},
        ],
        "solver": {
            "elements": 8,
            "links": 12,
            "rays": 345,
            "iterations": 3,
            "residual": None,
            "power_W": {"emitted": [1.0, 2.0, 3.0], "absorbed": 0.75, "escaped": 0.25},
            "closure_area_mean": 0.5,
        },
        "warnings": [{"name": "B", "message": "something is odd"}],
        "seconds": {"export": 0.1235, "solve": 2.0},
    }


def test_a_scale_is_told_where_the_file_has_one() -> None:
    objects = _report((LightmapFile("a.png", 12.5), LightmapFile("b.png", 1.0))).as_dict()["objects"]
    assert [entry["scale"] for entry in objects] == [12.5, 1.0]


def test_a_report_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    report = _report((LightmapFile("a.exr"), LightmapFile("b.exr")))
    with pytest.raises(BakeError, match=r"gone.report\.json"):
        report.write(tmp_path / "gone" / "report.json")
    assert list(tmp_path.iterdir()) == []
