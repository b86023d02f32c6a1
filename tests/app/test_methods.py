"""Every method of solving through the command line: what it bakes, reports and draws."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from .conftest import add_lamp, build_room, digest, read_pixels, read_report, save

Run = Callable[..., object]

TINY = ("--resolution", "32", "--quality", "sketch")

EXACT = ("--resolution", "48", "--quality", "high")
"""Which elements are bright enough to be aimed at is the method's to say, so that rays differ, and their
noise: it has to be below what is asserted. Where an object's foot cuts texels, parts of elements answer the
rays instead, as large as the method made them: texels have to be small beside the cube."""

METHODS = {
    "dense": ("--elements 80", {"elements": 80}),
    "jacobi": ("--elements 80 --tolerance 1e-5", {"elements": 80, "tolerance": 1e-5}),
    "gauss-seidel": ("--elements 80 --assembly collocation", {"elements": 80, "assembly": "collocation"}),
    "conjugate-gradient": ("--elements 80 --memory-limit 0.5", {"elements": 80, "memory_limit": 0.5}),
    "shooting": (
        "--elements 80 --ambient --max-iterations 5000",
        {"elements": 80, "ambient": True, "max_iterations": 5000},
    ),
    "two-level": (
        "--elements 80 --patches 40 --contrast 0.5",
        {"elements": 80, "patches": 40, "contrast": 0.5},
    ),
    "multi-level": (
        "--form-factor-error 0.1 --min-area 1e-3",
        {"form_factor_error": 0.1, "min_area": 1e-3},
    ),
    "hierarchical": ("--link-error 1e-3 --max-links 20000", {"error": 1e-3, "max_links": 20000}),
}
"""Options of each method, and what the report has to say of them."""


@pytest.fixture
def small_room(tmp_path: Path) -> Path:
    """The room, its preview small."""
    build_room()
    return save_small(tmp_path / "scene" / "room.blend")


def save_small(path: Path) -> Path:
    """Save the open file with a small preview."""
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 16
    return save(path)


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """The same room, baked by the default method."""
    from radiosity_addon.blender.command_line.main import main

    folder = tmp_path_factory.mktemp("reference")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    build_room()
    scene = save_small(folder / "room.blend")
    assert main(["bake", str(scene), "--output", str(folder), *EXACT, "--quiet"]) == 0
    return read_pixels(folder / "lightmap.exr")


@pytest.mark.parametrize("method", METHODS)
def test_each_method_bakes_the_same_light(
    method: str, run: Run, small_room: Path, tmp_path: Path, reference: np.ndarray
) -> None:
    out = tmp_path / "out"
    words, expected = METHODS[method]
    done = run("bake", small_room, "--output", out, *EXACT, "--method", method, *words.split())
    assert (done.code, done.err) == (0, "")
    assert f"\n{method}: " in done.out

    solver = read_report(out)["solver"]
    assert solver["method"] == method
    assert {name: solver["settings"][name] for name in expected} == expected
    assert set(solver["history"][0]) == {"seconds", "iteration", "residual", "elements", "links"}
    last = solver["history"][-1]
    assert (last["iteration"], last["elements"]) == (solver["iterations"], solver["elements"])
    if "tolerance" in solver["settings"]:
        assert last["residual"] == solver["residual"] <= solver["settings"]["tolerance"]

    # The elements rays meet are others, but their light is soon replaced by the texels' own.
    pixels = read_pixels(out / "lightmap.exr")
    np.testing.assert_allclose(pixels.mean(), reference.mean(), rtol=1e-3)
    np.testing.assert_allclose(pixels, reference, rtol=0, atol=0.005 * reference.max())


def test_the_plot_is_drawn_where_requested_and_named(run: Run, small_room: Path, tmp_path: Path) -> None:
    plot = tmp_path / "plots" / "history.svg"
    words = ("--method", "jacobi", "--elements", "40", "--plot", plot)
    done = run("bake", small_room, "--output", tmp_path / "out", *TINY, *words)
    assert (done.code, done.err) == (0, "")
    assert str(plot) in done.out
    assert plot.read_text().startswith("<svg")
    assert [path.name for path in plot.parent.iterdir()] == ["history.svg"]
    assert set(digest(tmp_path / "out")) == {"baked.blend", "lightmap.exr", "preview.png", "report.json"}


def test_separate_rooms_are_blocks_named_by_their_objects(run: Run, tmp_path: Path) -> None:
    """Two closed boxes with a lamp in each: the inside of each, and the outsides, which see each other."""
    for name, x in (("Left Room", 0.0), ("Right Room", 4.0)):
        bpy.ops.mesh.primitive_cube_add(size=2, location=(x, 0, 0))
        bpy.context.object.name = name
    add_lamp()  # above both, out of doors
    for x in (0.0, 4.0):
        add_lamp()
        bpy.context.scene.objects[-1].location = (x, 0, 0)
    scene = save_small(tmp_path / "rooms.blend")
    words = ("--method", "gauss-seidel", "--elements", "100")
    assert run("bake", scene, "--output", tmp_path / "out", *TINY, *words).code == 0
    solver = read_report(tmp_path / "out")["solver"]
    blocks = sorted(tuple(sorted(block["objects"])) for block in solver["independent_sets"])
    assert blocks == [("Left Room",), ("Left Room", "Right Room"), ("Right Room",)]
    assert solver["matrix"]["blocks"] == 3
    assert sum(block["elements"] for block in solver["independent_sets"]) <= solver["matrix"]["size"]
    # Six squares of 2 m × 2 m inside each.
    areas = sorted(block["area_m2"] for block in solver["independent_sets"] if len(block["objects"]) == 1)
    np.testing.assert_allclose(areas, 24.0, rtol=1e-6)


def test_a_system_too_large_for_the_memory_is_refused(run: Run, small_room: Path, tmp_path: Path) -> None:
    words = ("--method", "dense", "--elements", "5000", "--memory-limit", "0.25")
    done = run("bake", small_room, "--output", tmp_path / "out", *TINY, *words)
    assert done.code == 2
    assert "GiB" in done.err
    assert "hierarchical" in done.err
    assert not (tmp_path / "out" / "report.json").exists()


def test_a_plot_with_no_place_is_refused_before_the_work(run: Run, small_room: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder.svg").mkdir()
    for plot in (tmp_path / "file" / "plot.svg", tmp_path / "folder.svg"):
        done = run("bake", small_room, "--output", tmp_path / "out", *TINY, "--plot", plot)
        assert done.code == 1
        assert plot.name in done.err
        assert "solve" not in done.out
    assert not (tmp_path / "out").exists()
