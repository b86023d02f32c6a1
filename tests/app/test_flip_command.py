"""The command line's `flip`: another file is written, whose faces show their fronts and bake lit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from .conftest import QUICK, add_lamp, add_quad, digest, read_pixels, read_report, save

Run = Callable[..., object]


@pytest.fixture
def turned(tmp_path: Path) -> Path:
    """A floor, and a wall behind the lamp whose normal points away from it."""
    add_quad("Floor", ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)))
    add_quad("Wall", ((-2, 2, 0), (-2, 2, 3), (2, 2, 3), (2, 2, 0))[::-1])
    bpy.data.objects["Wall"].data.flip_normals()
    add_lamp()
    return save(tmp_path / "scenes" / "turned.blend")


def normal_of(path: Path, name: str) -> float:
    """Along y, of the first face of an object in a file."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return float(bpy.data.objects[name].data.polygons[0].normal.y)


def turned_objects(report: dict) -> list[str]:
    return [each["name"] for each in report["warnings"] if "lit from behind" in each["message"]]


def test_the_flipped_file_bakes_lit(run: Run, turned: Path, tmp_path: Path) -> None:
    before = digest(turned.parent)
    assert normal_of(turned, "Wall") == pytest.approx(1.0)
    dark = run("bake", turned, "--output", tmp_path / "dark", *QUICK)
    assert (dark.code, turned_objects(read_report(tmp_path / "dark"))) == (0, ["Wall"])
    assert "`flip` on the command line" in dark.out
    done = run("flip", turned, "--output", tmp_path / "new" / "right.blend")
    assert (done.code, done.err) == (0, "")
    assert f"1 face of 1 object flipped, written to {tmp_path / 'new' / 'right.blend'}\n  Wall\n" in done.out
    assert digest(turned.parent) == before
    assert set(digest(tmp_path / "new")) == {"right.blend"}
    assert normal_of(tmp_path / "new" / "right.blend", "Wall") == pytest.approx(-1.0)
    lit = run("bake", tmp_path / "new" / "right.blend", "--output", tmp_path / "lit", *QUICK)
    assert (lit.code, turned_objects(read_report(tmp_path / "lit"))) == (0, [])
    # The floor's half of the page is lit in both, the wall's in one.
    shares = [np.mean(read_pixels(tmp_path / name / "lightmap.exr") > 0.01) for name in ("dark", "lit")]
    assert shares[1] > 1.5 * shares[0]


def test_what_cannot_be_flipped_is_named_and_nothing_else_changes(run: Run, tmp_path: Path) -> None:
    add_quad("Floor", ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)))
    wall = add_quad("Wall", ((-2, 2, 0), (2, 2, 0), (2, 2, 3), (-2, 2, 3)))
    wall.data.flip_normals()
    other = bpy.data.objects.new("Front", wall.data)
    other.location, other.rotation_euler = (0, 0, 0), (0, 0, np.pi)
    other.location.y = 4.5
    bpy.context.scene.collection.objects.link(other)
    add_lamp()
    scene = save(tmp_path / "shared.blend")
    done = run("flip", scene, "--output", tmp_path / "out.blend")
    assert (done.code, done.err) == (0, "")
    assert "0 faces of 0 objects flipped" in done.out
    assert "warning: object 'Wall': 'Front' shares its mesh and was not found turned" in done.out
    assert normal_of(tmp_path / "out.blend", "Wall") == pytest.approx(1.0)


def test_no_file_is_replaced_and_the_scene_never(run: Run, turned: Path, tmp_path: Path) -> None:
    theirs = tmp_path / "theirs.blend"
    theirs.write_text("mine")
    before = {**digest(turned.parent), **digest(tmp_path / "scenes")}
    done = run("flip", turned, "--output", theirs)
    assert (done.code, done.err.count("\n")) == (1, 1)
    assert "theirs.blend" in done.err
    assert "--overwrite" in done.err
    assert theirs.read_text() == "mine"
    done = run("flip", turned, "--output", turned, "--overwrite")
    assert done.code == 2
    assert "turned.blend" in done.err
    assert {**digest(turned.parent), **digest(tmp_path / "scenes")} == before
    assert run("flip", "--output", tmp_path / "a.blend").code == 2
    assert not (tmp_path / "a.blend").exists()


def test_a_folder_that_is_a_file_is_named_once(run: Run, turned: Path, tmp_path: Path) -> None:
    output = turned / "out.blend"
    done = run("flip", str(turned), "--output", str(output))
    assert done.code == 1
    assert done.err.strip() == f"error: cannot write '{output}': Not a directory"


def test_without_light_it_says_so(run: Run, tmp_path: Path) -> None:
    add_quad("Floor", ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)))
    scene = save(tmp_path / "dark.blend")
    out = tmp_path / "out.blend"
    done = run("flip", scene, "--output", out)
    assert (done.code, done.err) == (0, "")
    assert f"no faces that show their backs were found; {out} is the scene as it was\n" in done.out
    assert "warning: scene 'Scene' has no light at all" in done.out
