"""A bake in stages gives the bytes of a bake at once; each stage is refused, repeated and resumed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from radiosity_addon.blender.command_line.main import main
from radiosity_addon.farm import Spool, run_command
from tests.app.staged import (
    SHARED,
    SMALL,
    bake,
    box_file,
    edit,
    finish,
    in_stages,
    lightmaps,
    prepare,
    report,
    run,
    sidecar,
    told,
)
from tests.moments import waits_for_a_worker
from tests.processes import ROOT, run_python

WITHOUT_BLENDER = """
import sys
for name in ("bpy", "bmesh", "mathutils", "bpy_extras", "gpu", "blf"):
    sys.modules[name] = None
from radiosity_addon.farm.__main__ import main
code = main(sys.argv[1:])
assert not any(name.startswith("radiosity_addon.blender") for name in sys.modules)
sys.exit(code)
"""

CASES = {
    "plain": [],
    "pages": ["--atlas", "per-object", "--format", "png16", "--quantity", "irradiance"],
    "density": ["--texel-density", "10", "--max-resolution", "128", "--sky"],
    "dense": ["--method", "dense", "--elements", "200"],
    "residual": ["--quantity", "residual"],
    "groups": ["--light-group", "Lamps=Bulb", "--keep"],
}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return box_file(tmp_path)


@pytest.mark.parametrize(
    "case",
    [
        # Settings that reach the stages as those of the others do.
        pytest.param(case, marks=pytest.mark.full if case in {"dense", "residual", "density"} else [])
        for case in CASES
    ],
)
def test_stages_give_the_bytes_of_a_bake(case: str, scene: Path, tmp_path: Path) -> None:
    options = [*SMALL, *CASES[case]]
    if case == "density":
        options = options[2:]
    assert bake(scene, tmp_path / "once", options) == 0
    in_stages(scene, tmp_path / "spool", tmp_path / "staged", options)
    once = lightmaps(tmp_path / "once")
    assert lightmaps(tmp_path / "staged") == once
    assert len(once) > (2 if case in ("pages", "groups") else 0)
    assert told(tmp_path / "staged") == told(tmp_path / "once")
    # A bake that ends well leaves nothing but that it was there.
    left = sorted(path.name for path in (tmp_path / "spool").iterdir())
    assert left == ["finished", "over", "spool.json"]
    if case == "groups":
        assert sidecar(tmp_path / "staged") == sidecar(tmp_path / "once")


def test_a_kept_bake_is_relit_as_one_that_was_baked_at_once(scene: Path, tmp_path: Path) -> None:
    options = [*SMALL, "--keep"]
    assert bake(scene, tmp_path / "once", options) == 0
    in_stages(scene, tmp_path / "spool", tmp_path / "staged", options)
    assert sidecar(tmp_path / "staged") == sidecar(tmp_path / "once")
    before = lightmaps(tmp_path / "staged")

    def brighter() -> None:
        bpy.data.lights["Bulb"].energy = 60.0

    edit(scene, brighter)
    for name in ("once", "staged"):
        words = ["bake", str(scene), "--relight", "--output", str(tmp_path / name), "--no-preview", "--quiet"]
        assert main(words) == 0
    assert lightmaps(tmp_path / "staged") == lightmaps(tmp_path / "once") != before


def test_an_export_was_asked_for_when_it_was_prepared(scene: Path, tmp_path: Path) -> None:
    options = [*SMALL, "--export", "glb"]
    assert bake(scene, tmp_path / "once", options) == 0
    in_stages(scene, tmp_path / "spool", tmp_path / "staged", options)
    assert lightmaps(tmp_path / "staged") == lightmaps(tmp_path / "once")
    once, staged = (
        sorted(path.name for path in (tmp_path / name / "export").iterdir()) for name in ("once", "staged")
    )
    assert once == staged


def test_running_needs_no_blender(scene: Path, tmp_path: Path) -> None:
    spool = tmp_path / "spool"
    assert prepare(scene, spool, SHARED) == 0
    ran = run_python(WITHOUT_BLENDER, "run", spool)
    assert ran.returncode == 0, ran.stderr
    assert "[  0 %] unwrap" in ran.stdout
    assert "light" in ran.stdout
    assert ran.stdout.splitlines()[-1].startswith(f"the result is in '{spool}': finish it")
    assert ran.stderr == ""
    for words in (["status", spool], ["status", "--tasks", spool], ["run", spool]):
        assert run_python(WITHOUT_BLENDER, *words).returncode == 0
    assert finish(scene, spool, tmp_path / "out") == 0
    assert bake(scene, tmp_path / "once", SHARED) == 0
    assert lightmaps(tmp_path / "out") == lightmaps(tmp_path / "once")


def test_workers_help_the_stage_that_is_run(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spool = tmp_path / "spool"
    assert prepare(scene, spool, SHARED) == 0
    with monkeypatch.context() as patch:
        patch.setattr(Spool, "put_call", Spool.put_call)
        waits_for_a_worker()
        assert run(spool, "--farm", "local:1") == 0
    assert finish(scene, spool, tmp_path / "out") == 0
    shared = report(tmp_path / "out")["performance"]["shared"]
    assert sum(entry["tasks_by_workers"] for entry in shared) > 0
    assert bake(scene, tmp_path / "once", SHARED) == 0
    assert lightmaps(tmp_path / "out") == lightmaps(tmp_path / "once")
    # The rays that workers traced are among the bake's.
    assert told(tmp_path / "out") == told(tmp_path / "once")


def largest_array(spool: Path, digest: str) -> Path:
    """Return the file of the largest array that an object of a spool holds itself."""
    text = (spool / "objects" / f"{digest}.json").read_text()
    found = [spool / "arrays" / f"{name}.npy" for name in re.findall(r'"array": "([0-9a-f]{40})"', text)]
    return max(found, key=lambda path: path.stat().st_size)


def test_a_result_is_kept_if_it_is_whole_and_else_found_again(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spool, options = tmp_path / "spool", [*SHARED, "--keep"]
    assert prepare(scene, spool, options) == 0
    assert run(spool) == 0
    tasks = {path: path.stat().st_mtime_ns for path in spool.glob("calls/*/*.result")}
    assert tasks
    for harm in ("none", "truncated", "flipped", "removed", "pointer"):
        (result,) = spool.glob("results/*")
        written = result.stat().st_mtime_ns
        sidecar_file = largest_array(spool, result.read_text())
        content = bytearray(sidecar_file.read_bytes())
        if harm == "truncated":
            sidecar_file.write_bytes(content[:-1])
        elif harm == "flipped":
            content[-1] ^= 1
            sidecar_file.write_bytes(content)
        elif harm == "removed":
            sidecar_file.unlink()
        elif harm == "pointer":
            result.write_text("0" * 40)
        if harm != "none":
            assert finish(scene, spool, tmp_path / "out") == 1
            assert "is damaged: run the bake again" in capsys.readouterr().err
            assert not (tmp_path / "out" / "report.json").exists()
        assert prepare(scene, spool, options) == 0
        # Workers wait for a bake whose result is damaged.
        assert (spool / "over").exists() == (harm == "none")
        assert run_command(["run", str(spool)]) == 0
        assert ("already: there is nothing to run" in capsys.readouterr().out) == (harm == "none")
        assert (result.stat().st_mtime_ns == written) == (harm == "none")
        assert {path: path.stat().st_mtime_ns for path in tasks} == tasks
    assert finish(scene, spool, tmp_path / "out") == 0
    shared = report(tmp_path / "out")["performance"]["shared"]
    assert sum(entry["tasks_done_earlier"] for entry in shared) >= len(tasks)
    assert bake(scene, tmp_path / "once", options) == 0
    assert lightmaps(tmp_path / "out") == lightmaps(tmp_path / "once")
    assert sidecar(tmp_path / "out") == sidecar(tmp_path / "once")


def test_a_scene_that_has_changed_is_not_finished(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spool = tmp_path / "spool"
    assert prepare(scene, spool, SMALL) == 0
    assert run(spool) == 0
    name = next(obj.name for obj in bpy.data.objects if obj.type == "MESH")

    def move() -> None:
        bpy.data.objects[name].location.x += 0.25

    edit(scene, move)
    capsys.readouterr()
    assert finish(scene, spool, tmp_path / "out") == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"(object '{name}' has moved" in said
    assert said.endswith(": prepare and run it again\n")
    assert list((tmp_path / "out").iterdir() if (tmp_path / "out").exists() else []) == []

    def back() -> None:
        bpy.data.objects[name].location.x -= 0.25

    edit(scene, back)
    assert finish(scene, spool, tmp_path / "out") == 0


def test_preparing_again_keeps_the_result_of_the_same_inputs(scene: Path, tmp_path: Path) -> None:
    spool = tmp_path / "spool"
    assert prepare(scene, spool, SMALL) == 0
    assert run(spool) == 0
    assert prepare(scene, spool, [*SMALL, "--seed", "3"]) == 0
    assert status(spool) == f"prepared: scene 'Cornell Box' of '{scene}'\n"
    assert run(spool) == 0
    assert prepare(scene, spool, SMALL) == 0
    assert status(spool) == f"ready to finish: scene 'Cornell Box' of '{scene}'\n"
    assert finish(scene, spool, tmp_path / "out") == 0
    assert bake(scene, tmp_path / "once", SMALL) == 0
    assert lightmaps(tmp_path / "out") == lightmaps(tmp_path / "once")


def status(spool: Path) -> str:
    words = [sys.executable, "-m", "radiosity_addon.farm", "status", str(spool)]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True).stdout


def test_a_bake_is_finished_once(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spool = tmp_path / "spool"
    in_stages(scene, spool, tmp_path / "out", SMALL)
    written = (tmp_path / "out" / "report.json").stat().st_mtime_ns
    assert status(spool) == f"finished, into '{tmp_path / 'out'}'\n"
    assert finish(scene, spool, tmp_path / "out") == 0
    assert run(spool) == 0
    assert (tmp_path / "out" / "report.json").stat().st_mtime_ns == written
    capsys.readouterr()
    assert finish(scene, spool, tmp_path / "other") == 1
    assert capsys.readouterr().err.count("\n") == 1
    (tmp_path / "out" / "report.json").rename(tmp_path / "report.json")
    assert finish(scene, spool, tmp_path / "out") == 1
    assert "where no report.json is any more" in capsys.readouterr().err
    (tmp_path / "report.json").rename(tmp_path / "out" / "report.json")
    # And can be prepared again, or baked in at once.
    in_stages(scene, spool, tmp_path / "other", SMALL)
    assert lightmaps(tmp_path / "out") == lightmaps(tmp_path / "other")
    assert bake(scene, tmp_path / "third", [*SMALL, "--spool", str(spool)]) == 0
    assert status(spool) == "the bake has ended\n"


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--resolution", "8192", "--memory-limit", "0.5"], "memory"),
        (["--keep", "--quantity", "residual"], "residual"),
        (["--light-group", "A=Nobody"], "Nobody"),
        (["--objects", "Nobody"], "Nobody"),
        (["--export", "glb", "--quantity", "residual"], "residual"),
    ],
)
def test_what_a_bake_would_refuse_is_refused_at_once_and_leaves_no_spool(
    options: list[str], says: str, scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert prepare(scene, tmp_path / "spool", options) in (1, 2)
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert says in said
    assert not (tmp_path / "spool").exists()


def test_a_scene_without_meshes_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = box_file(tmp_path)

    def empty() -> None:
        for obj in [each for each in bpy.data.objects if each.type == "MESH"]:
            bpy.data.objects.remove(obj)

    edit(scene, empty)
    (tmp_path / "spool").mkdir()
    assert prepare(scene, tmp_path / "spool", SMALL) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert list((tmp_path / "spool").iterdir()) == []


def test_folders_of_others_are_left_alone(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "spool").mkdir()
    (tmp_path / "spool" / "thesis.txt").write_text("mine")
    assert prepare(scene, tmp_path / "spool", SMALL) == 1
    assert capsys.readouterr().err.endswith("is not empty and no spool: give an empty folder\n")
    assert [path.name for path in (tmp_path / "spool").iterdir()] == ["thesis.txt"]
    assert run(tmp_path / "spool") == 1
    assert finish(scene, tmp_path / "spool", tmp_path / "out") == 1
    assert capsys.readouterr().err.count("is no spool") == 2


@pytest.mark.parametrize("harm", ["removed", "truncated"])
def test_a_spool_without_its_record_is_named(
    harm: str, scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spool = tmp_path / "spool"
    assert prepare(scene, spool, SMALL) == 0
    record = spool / "spool.json"
    record.unlink() if harm == "removed" else record.write_bytes(record.read_bytes()[:-5])
    capsys.readouterr()
    assert finish(scene, spool, tmp_path / "out") == 1
    assert run(spool) == 1
    what = "gone" if harm == "removed" else "damaged"
    said = f"error: '{record}' is {what}: start or prepare the bake again, in an empty folder\n"
    assert capsys.readouterr().err == 2 * said


def test_what_others_put_into_a_spool_stays(scene: Path, tmp_path: Path) -> None:
    spool = tmp_path / "spool"
    assert prepare(scene, spool, SMALL) == 0
    mine = [
        spool / name for name in ("mine.txt", "results/mine.txt", "results/" + "0" * 39, "arrays/mine.npy")
    ]
    for path in mine:
        path.write_text("mine")
    assert run(spool) == 0
    assert finish(scene, spool, tmp_path / "out") == 0
    assert all(path.read_text() == "mine" for path in mine)


def test_stages_come_in_their_order(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spool = tmp_path / "spool"
    Spool.to_bake(spool).leave()
    assert run(spool) == 1
    assert finish(scene, spool, tmp_path / "out") == 1
    assert capsys.readouterr().err.count("no bake is prepared") == 2
    assert prepare(scene, spool, SMALL) == 0
    capsys.readouterr()
    assert finish(scene, spool, tmp_path / "out") == 1
    said = capsys.readouterr().err
    assert said == f"error: the bake in '{spool}' has no result yet: run it first (`run {spool}`)\n"
    # A bake at once would remove what is prepared.
    assert bake(scene, tmp_path / "out", [*SMALL, "--spool", str(spool)]) == 1
    assert "a bake is prepared in" in capsys.readouterr().err
    assert status(spool).startswith("prepared: ")


def test_a_bake_leaves_what_is_prepared_in_the_spool_that_it_had_made_for_itself(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spool = tmp_path / "out-spool"
    Spool.to_bake(spool, made_for=tmp_path / "out").leave()
    assert prepare(scene, spool, SMALL) == 0
    assert bake(scene, tmp_path / "out", [*SMALL, "--farm", "local:1"]) == 1
    assert "is in the way of the bake's spool" in capsys.readouterr().err
    assert status(spool).startswith("prepared: ")


def test_blender_itself_runs_the_stage(scene: Path, tmp_path: Path) -> None:
    """`blender -b --command radiosity run DIR`, where no other Python has our packages."""
    from radiosity_addon.blender.command_line import host

    assert prepare(scene, tmp_path / "spool", SMALL) == 0
    assert host.run(["run", str(tmp_path / "spool"), "--quiet"]) == 0
    assert finish(scene, tmp_path / "spool", tmp_path / "out") == 0
