"""The report says what the format promises, in plain JSON."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_addon.bake.result.report import MAX_HISTORY, BakeReport, LightmapFile, solver_part, thinned
from radiosity_addon.bake.result.result import BakeResult, LightGroup
from radiosity_addon.base.bake_warning import BakeWarning
from radiosity_addon.base.errors import BakeError
from radiosity_addon.lightmap.images.page import LightmapPage
from tests.unit.texel_scenes import bake_object

SOLVER = {
    "closure_area_mean": np.float32(0.5),
    "elements": np.int64(8),
    "links": 12,
    "rays": 345,
    "iterations": 3,
    "residual": float("nan"),
    "power_W": {"emitted": np.array([1.0, 2.0, 3.0]), "absorbed": 0.75, "escaped": 0.25},
    "method": "jacobi",
    "settings": {"elements": np.int64(8), "tolerance": 1e-4},
    "matrix": {"condition": np.float64(3.5), "dominance": float("inf")},
    "history": [{"seconds": 0.5, "iteration": i, "residual": 2.0**-i} for i in range(3)],
}


def _report(files: tuple[LightmapFile, ...]) -> BakeReport:
    pages = (
        LightmapPage(np.zeros((4, 8, 3), np.float32), np.ones((4, 8), bool)),
        LightmapPage(np.zeros((2, 2, 3), np.float32), np.ones((2, 2), bool)),
    )
    names = ("Wände", "B")
    baked = tuple(
        SimpleNamespace(object=SimpleNamespace(name=n), page=i, density=64.0, share=0.5)
        for i, n in enumerate(names)
    )
    result = BakeResult(pages, baked, SOLVER, (BakeWarning("B", "something is odd"),))
    return BakeReport.of(result, files, {"export": 0.123456, "solve": 2})


def test_the_file_holds_what_the_format_promises(tmp_path: Path) -> None:
    report = _report((LightmapFile("a.exr"), LightmapFile("b.exr")))
    report.write(tmp_path / "report.json")
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]
    read = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert read == report.as_dict()
    of_each = {"uv_layer": "Lightmap", "texels_per_metre": 64.0, "share_of_page": 0.5}
    assert read == {
        "version": 2,
        "objects": [
            {"object": "Wände", "image": "a.exr", "resolution": [8, 4], "atlas": 0, **of_each},
            {"object": "B", "image": "b.exr", "resolution": [2, 2], "atlas": 1, **of_each},
        ],
        "pages": [{"image": "a.exr"}, {"image": "b.exr"}],
        "solver": {
            "elements": 8,
            "links": 12,
            "rays": 345,
            "iterations": 3,
            "residual": None,
            "power_W": {"emitted": [1.0, 2.0, 3.0], "absorbed": 0.75, "escaped": 0.25},
            "closure_area_mean": 0.5,
            "method": "jacobi",
            "settings": {"elements": 8, "tolerance": 1e-4},
            "matrix": {"condition": 3.5, "dominance": None},
            "history": [
                {"seconds": 0.5, "iteration": 0, "residual": 1.0},
                {"seconds": 0.5, "iteration": 1, "residual": 0.5},
                {"seconds": 0.5, "iteration": 2, "residual": 0.25},
            ],
        },
        "warnings": [{"name": "B", "message": "something is odd"}],
        "seconds": {"export": 0.1235, "solve": 2.0},
    }


def test_a_scale_is_reported_where_the_file_has_one() -> None:
    objects = _report((LightmapFile("a.png", 12.5), LightmapFile("b.png", 1.0))).as_dict()["objects"]
    assert [entry["scale"] for entry in objects] == [12.5, 1.0]


def test_a_report_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    report = _report((LightmapFile("a.exr"), LightmapFile("b.exr")))
    with pytest.raises(BakeError, match=r"gone.report\.json"):
        report.write(tmp_path / "gone" / "report.json")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("count", [0, 1, 199, 200, 201, 399, 100_000])
def test_a_history_keeps_both_ends_and_even_steps(count: int) -> None:
    kept = thinned(range(count))
    assert len(kept) == min(count, MAX_HISTORY)
    assert kept[:1] + kept[-1:] == list(range(count))[:1] + list(range(count))[-1:]
    steps = np.diff(kept)
    if len(steps):
        assert steps.min() >= 1
        assert steps.max() - steps.min() <= 1


def test_the_solver_part_reports_method_settings_and_whose_the_blocks_are() -> None:
    objects = [bake_object("Left", 0, 4), bake_object("Empty", 4, 0), bake_object("Right", 4, 3)]
    found = {
        "method": "dense",
        "elements": 7,
        "independent_sets": [
            {"elements": 4, "area_m2": 2.0, "triangles": [3, 0]},
            {"elements": 3, "area_m2": 1.0, "triangles": [6, 4, 2]},
        ],
    }
    assert solver_part(found, {"elements": 7, "assembly": "galerkin"}, objects) == {
        "method": "dense",
        "settings": {"elements": 7, "assembly": "galerkin"},
        "elements": 7,
        "independent_sets": [
            {"objects": ["Left"], "elements": 4, "area_m2": 2.0},
            {"objects": ["Left", "Right"], "elements": 3, "area_m2": 1.0},
        ],
    }


def test_light_groups_are_reported_with_their_sources_and_files() -> None:
    pages = (LightmapPage(np.zeros((4, 8, 3), np.float32), np.ones((4, 8), bool)),)
    groups = (LightGroup("Day", pages, ("Sun", "World")), LightGroup("Night", pages, ("Lamp",)))
    result = BakeResult(pages, (), SOLVER, (), groups=groups)
    files = [[LightmapFile("lightmap_Day.png", 2.5)], [LightmapFile("lightmap_Night.exr")]]
    told = BakeReport.of(result, [LightmapFile("lightmap.exr")], {}, files).as_dict()
    assert told["light_groups"] == [
        {"group": "Day", "sources": ["Sun", "World"], "pages": [{"image": "lightmap_Day.png", "scale": 2.5}]},
        {"group": "Night", "sources": ["Lamp"], "pages": [{"image": "lightmap_Night.exr"}]},
    ]
