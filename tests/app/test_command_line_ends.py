"""How the command line ends: bad scenes, bad files, scenes open or baked already, and Ctrl-C."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import bpy
import pytest

from tests.wording import says

from .conftest import QUICK, ROOT, Baked, add_lamp, add_quad, digest, read_report, save, start

Run = Callable[..., object]


def bad_nothing() -> None:
    add_lamp()


def bad_ninth_layer() -> None:
    quad = add_quad("Eight", ((-1, -1, 0), (1, -1, 0), (1, 1, 0)))
    for index in range(8):
        quad.data.uv_layers.new(name=f"UV{index}")


def bad_nan() -> None:
    add_quad("Broken", ((-1, -1, 0), (1, -1, float("nan")), (1, 1, 0)))


def bad_inf() -> None:
    add_quad("Endless", ((-1, -1, 0), (1, -1, float("inf")), (1, 1, 0)))


@pytest.mark.parametrize(
    ("build", "names", "mend"),
    [
        (bad_nothing, "nothing to bake", "mesh"),
        (bad_ninth_layer, "Eight", "remove"),
        (bad_nan, "Broken", ""),
        (bad_inf, "Endless", ""),
    ],
)
def test_scenes_that_cannot_be_baked(
    build: Callable[[], None], names: str, mend: str, run: Run, tmp_path: Path
) -> None:
    build()
    scene = save(tmp_path / "bad.blend")
    done = run("bake", scene, "--output", tmp_path / "out", *QUICK)
    assert done.code == 1
    assert done.err.startswith("error: ")
    assert done.err.count("\n") == 1
    assert names in done.err
    assert mend in done.err
    assert not (tmp_path / "out").exists()


def test_only_linked_objects_is_an_error(run: Run, room: Path, tmp_path: Path) -> None:
    with bpy.data.libraries.load(str(room), link=True) as (_found, linked):
        linked.objects = ["Floor", "Wall"]
    for obj in linked.objects:
        bpy.context.scene.collection.objects.link(obj)
    scene = save(tmp_path / "linking.blend")
    done = run("bake", scene, "--output", tmp_path / "out", *QUICK)
    assert done.code == 1
    assert done.err.count("\n") == 1
    assert "link" in done.err


@pytest.mark.parametrize("name", ["missing.blend", "empty.blend", "text.blend", "broken.glb", "scene.fbx"])
def test_files_that_cannot_be_read(name: str, run: Run, tmp_path: Path) -> None:
    path = tmp_path / name
    if not name.startswith("missing"):
        path.write_bytes(b"" if name.startswith("empty") else b"this is no scene")
    done = run("bake", path, "--output", tmp_path / "out", *QUICK)
    assert done.code == 1
    assert done.err.startswith("error: ")
    assert done.err.count("\n") == 1
    assert name in done.err
    assert not (tmp_path / "out").exists()


def test_an_output_that_is_a_file(run: Run, room: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    done = run("bake", room, "--output", tmp_path / "file", *QUICK)
    assert done.code == 1
    assert str(tmp_path / "file") in done.err
    assert (tmp_path / "file").read_text() == "mine"


def test_an_unknown_object_is_a_usage_error(run: Run, room: Path, tmp_path: Path) -> None:
    done = run("bake", room, "--output", tmp_path / "out", *QUICK, "--objects", "Floor", "Nope")
    assert done.code == 2
    assert "Nope" in done.err
    assert done.err.count("\n") == 1


def test_the_scene_is_never_overwritten(run: Run, baked: Baked) -> None:
    before = digest(baked.folder)
    done = run("bake", baked.folder / "baked.blend", "--output", baked.folder, *QUICK)
    assert done.code == 2
    assert "baked.blend" in done.err
    assert digest(baked.folder) == before


def test_restoring_what_shows_no_bake(run: Run, room: Path, tmp_path: Path) -> None:
    done = run("restore", room, "--output", tmp_path / "back.blend")
    assert done.code == 1
    assert "room.blend" in done.err
    assert not (tmp_path / "back.blend").exists()


def test_a_baked_file_bakes_again_as_the_original_does(run: Run, baked: Baked, tmp_path: Path) -> None:
    assert run("bake", baked.folder / "baked.blend", "--output", tmp_path, *QUICK).code == 0
    first, second = ((folder / "lightmap.exr").read_bytes() for folder in (baked.folder, tmp_path))
    assert first == second


def test_inside_a_blender_that_has_the_file_open(room: Path, tmp_path: Path) -> None:
    """What `blender -b room.blend --command radiosity …` calls."""
    from radiosity_addon.blender.command_line import host

    bpy.ops.wm.open_mainfile(filepath=str(room))
    assert host.run(["bake", "--output", str(tmp_path / "out"), *QUICK, "--quiet"]) == 0
    assert {entry["object"] for entry in read_report(tmp_path / "out")["objects"]} == {
        "Floor",
        "Wall",
        "Cube",
    }
    assert host.run(["bake", "--resolution", "0"]) == 2
    assert host.run(["bake"]) == 2  # an open file needs --output
    assert host.run(["--help"]) == 0


# --- in a process of its own ---


def test_the_process_ends_with_the_code(room: Path, tmp_path: Path) -> None:
    done = start("bake", room, "--output", "out", *QUICK, cwd=tmp_path)
    out, err = done.communicate(timeout=300)
    assert (done.returncode, err) == (0, "")
    assert "3 objects baked into out" in out
    assert "Fra:" not in out
    failed = start("bake", "nowhere.blend", "--output", "out", cwd=tmp_path)
    out, err = failed.communicate(timeout=300)
    assert failed.returncode == 1
    assert err.count("\n") == 1


KILLED_WHILE_PUBLISHING = """
import os, sys
from pathlib import Path

replace, count = Path.replace, 0

def replacing(source, goal):
    global count
    if goal.parent == Path(sys.argv[1]) and not goal.name.startswith("."):
        count += 1
        if count == 3:
            os.kill(os.getpid(), 9)
    return replace(source, goal)

Path.replace = replacing
from radiosity_addon.blender.command_line.main import main
main(sys.argv[2:])
"""


def copied(baked: Baked, to: Path) -> tuple[Path, Path]:
    """A copy of the whole project: the scene, and the folder of its bake."""
    shutil.copytree(baked.scene.parents[1], to / "project")
    return to / "project" / "scene" / baked.scene.name, to / "project" / baked.folder.name


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
@pytest.mark.parametrize(
    ("stage", "number"),
    [*((name, signal.SIGINT) for name in ("export", "solve", "light", "preview")), ("light", signal.SIGTERM)],
)
def test_ctrl_c_leaves_the_previous_result_whole(
    stage: str, number: signal.Signals, baked: Baked, tmp_path: Path
) -> None:
    room, out = copied(baked, tmp_path)
    before = digest(out)
    words = ("--resolution", "64", "--quality", "sketch")
    job = start("bake", room, "--output", out, *words, cwd=tmp_path)
    for line in job.stdout:
        if f"] {stage}" in line:
            os.killpg(job.pid, number)
            break
    _, err = job.communicate(timeout=300)
    assert job.returncode == 130
    assert says(err.splitlines()[-1], "error: ", "interrupted")
    assert "Traceback" not in err
    assert digest(out) == before


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="tells by /proc how far a process is")
def test_ctrl_c_waits_while_blender_is_imported(baked: Baked, tmp_path: Path) -> None:
    room, out = copied(baked, tmp_path)
    before = digest(out)
    job = start("bake", room, "--output", out, "--quiet", cwd=tmp_path)
    maps = Path(f"/proc/{job.pid}/maps")
    while job.poll() is None and "/bpy/" not in maps.read_text():
        time.sleep(0.001)
    os.killpg(job.pid, signal.SIGINT)
    _, err = job.communicate(timeout=300)
    assert job.returncode == 130
    assert err.count("\n") == 1
    assert says(err, "error: ", "interrupted")
    assert digest(out) == before


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
@pytest.mark.parametrize("moment", ["light", "preview", "publish"])
def test_a_killed_bake_leaves_the_previous_result_whole(
    moment: str, baked: Baked, run: Run, tmp_path: Path
) -> None:
    room, out = copied(baked, tmp_path)
    before = digest(out)
    words = ("bake", room, "--output", out, "--resolution", "64", "--quality", "sketch", "--seed", "5")
    if moment == "publish":
        script = [sys.executable, "-c", KILLED_WHILE_PUBLISHING, str(out), *map(str, words)]
        job = subprocess.run(script, cwd=ROOT, capture_output=True, timeout=300, check=False)
    else:
        job = start(*words, cwd=tmp_path)
        for line in job.stdout:
            if f"] {moment}" in line:
                os.killpg(job.pid, signal.SIGKILL)
                break
        job.communicate(timeout=300)
    assert job.returncode == -signal.SIGKILL
    assert [path.name[:11] for path in out.iterdir() if path.is_dir()] == [".radiosity-"]
    if moment != "publish":
        files = {name: found for name, found in digest_files(out).items() if not name.startswith(".")}
        assert files == before
    # A bake that comes to nothing cleans up all the same.
    assert run("bake", tmp_path / "nowhere.blend", "--output", out).code == 1
    assert run("bake", room, "--output", out, "--objects", "Nobody").code == 2
    assert digest(out) == before


def digest_files(folder: Path) -> dict[str, str]:
    """What the files of a folder hold; folders are left out."""
    return {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.iterdir()
        if path.is_file()
    }
