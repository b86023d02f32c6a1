"""The benchmarks from end to end, in small; how fast anything is is not asserted."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bench import report
from bench.cases import CASES, SMALL_CASES

ROOT = Path(__file__).resolve().parents[2]


def run_bench(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "bench", *map(str, words)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=500,
    )


@pytest.fixture(scope="module")
def output(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the small Cornell box and the small rooms."""
    folder = tmp_path_factory.mktemp("bench")
    done = run_bench(
        "--small", "--case", "cornell", "--case", "rooms", "--output", folder, "--cache", folder / "c"
    )
    assert done.returncode == 0, done.stderr
    return folder


def test_both_programs_are_measured_and_compared(output: Path) -> None:
    results = json.loads((output / "cornell.json").read_text(encoding="utf-8"))
    assert [entry["label"] for entry in results["ours"]] == ["draft", "medium"]
    assert [entry["samples"] for entry in results["cycles"]] == [2, 8, 32]
    for entry in (*results["ours"], *results["cycles"]):
        assert entry["seconds"] > 0
        assert entry["memory_MB"] > 50
        assert entry["mean_ratio"] == pytest.approx(1, abs=0.15)
    errors = [entry["error"] for entry in results["cycles"]]
    assert errors[0] > errors[1] > errors[2] > max(entry["error"] for entry in results["ours"])
    assert results["order_of_cycles"] == pytest.approx(-0.5, abs=0.15)
    assert [row["error"] for row in results["at_equal_error"]] == [0.03, 0.02, 0.01]
    for row in results["at_our_errors"]:
        assert row["cycles"]["kind"] == "extrapolated"
        for times in (row, row["processor"]):
            assert times["ratio_to_cycles"] == pytest.approx(
                times["cycles"]["seconds"] / times["seconds"], rel=1e-3
            )
    assert results["context"]["machine"]["cores"] == os.cpu_count()


def test_pixels_of_all_bakes_are_kept_next_to_the_references(output: Path) -> None:
    (folder,) = (output / "c").glob("cornell-48-*")
    with np.load(folder / "texels.npz") as file:
        compared = file["compared"]
    reference = np.load(folder / "reference-64-bounces-128-seed-1.npy")
    for name in ("ours-1.npy", "cycles-32.npy"):
        pixels = np.load(folder / "bakes" / name)
        assert pixels.shape == reference.shape == (48, 48, 3)
        assert np.corrcoef(pixels[compared].ravel(), reference[compared].ravel())[0, 1] > 0.9


def test_rooms_grow(output: Path) -> None:
    results = json.loads((output / "rooms.json").read_text(encoding="utf-8"))
    assert [row["triangles"] for row in results["rooms"]] == sorted(
        row["triangles"] for row in results["rooms"]
    )
    for row in (*results["rooms"], results["bake"]):
        assert row["closure_area_mean"] == pytest.approx(1, abs=0.02)
        assert row["links_per_leaf"] == pytest.approx(row["links"] / row["leaves"], rel=1e-3)
    assert results["exponents"].keys() >= {"seconds", "links", "leaves", "memory_MB"}


def test_the_table_goes_between_the_markers(output: Path, tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text(f"before\n{report.BEGIN}\nold\n{report.END}\nafter\n", encoding="utf-8")
    assert report.update_readme(output, readme)
    text = readme.read_text(encoding="utf-8")
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text
    assert "| Cornell box, 34 triangles, 48² | 3% |" in text
    assert "| closed room |" in text
    once = text
    assert report.update_readme(output, readme)
    assert readme.read_text(encoding="utf-8") == once
    readme.write_text("no place\n", encoding="utf-8")
    assert not report.update_readme(output, readme)


def test_the_project_s_readme_has_a_place_for_it() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert text.index(report.BEGIN) < text.index(report.END)


def test_a_scene_that_is_not_here_is_skipped_with_a_message(tmp_path: Path) -> None:
    if CASES["leaks"].missing is None:
        pytest.skip("the shared scenes are here")
    done = run_bench("--case", "leaks", "--output", tmp_path, "--cache", tmp_path)
    assert done.returncode == 0
    assert "leaks: skipped, " in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_nothing_in_the_office_lies_in_its_walls() -> None:
    """What faces outwards from a wall's own plane is lit by the sky or dark, as rounding has it."""
    from bench.interior import office

    shell = ("Floor", "Ceiling", "Back Wall", "Left Wall", "Right Wall", "Window Wall")
    size = (office.WIDTH, office.DEPTH)
    walls = [(axis, place) for axis in (0, 1) for place in (0.0, size[axis])]
    walls.append((2, office.HEIGHT))
    reveals = [(axis, window[i]) for window in office.WINDOWS for axis, i in ((0, 0), (0, 2), (2, 1), (2, 3))]
    found = []
    for name, shape in office.pieces(1.0):
        if name in shell:
            continue
        for number, face in enumerate(shape.faces):
            corners = shape.vertices[list(face)]
            planes = walls + (reveals if corners[:, 1].max() < 1e-4 else [])
            flat = [plane for plane in planes if np.abs(corners[:, plane[0]] - plane[1]).max() < 1e-4]
            found += [(name, number, *plane) for plane in flat]
    assert found == []


def test_an_unknown_case_is_wrong_usage() -> None:
    done = run_bench("--case", "nothing")
    assert done.returncode == 2
    assert "invalid choice: 'nothing'" in done.stderr


def test_a_scene_s_key_changes_with_what_makes_the_scene() -> None:
    keys = {case.key() for case in (*CASES.values(), *SMALL_CASES.values()) if case.missing is None}
    here = [case for case in (*CASES.values(), *SMALL_CASES.values()) if case.missing is None]
    assert len(keys) == len(here)
