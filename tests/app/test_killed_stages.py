"""Stages that are killed, interrupted, or find a disk full: the same command goes on, and nothing is lost."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from radiosity_addon.blender.command_line.main import main
from radiosity_addon.farm import Spool, run_command
from tests.app.staged import SHARED, SMALL, bake, box_file, finish, lightmaps, prepare, run
from tests.moments import until
from tests.processes import ROOT, run_python

DYING = """
import os, signal, sys
from pathlib import Path
from radiosity_addon.blender.command_line.main import main
from radiosity_addon.farm import run_command
moment, *words = sys.argv[1:]
calls = 0

def dies_at(owner, name):
    # Before the call with this number, counted from 0.
    work = getattr(owner, name)
    def counted(*given, **named):
        global calls
        if calls == at:
            os.kill(os.getpid(), signal.SIGKILL)
        calls += 1
        return work(*given, **named)
    setattr(owner, name, counted)

owner, name, at = moment.split(":")
at = int(at)
dies_at({"Path": Path, "os": os}[owner], name)
code = (run_command if words[0] == "run" else main)(words)
sys.stdout.flush()
os._exit(code)
"""

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal here")


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return box_file(tmp_path)


def die(moment: str, *words: object) -> None:
    """Run a command in a process that is killed at a moment."""
    done = run_python(DYING, moment, *words)
    assert done.returncode == -signal.SIGKILL, (moment, done.stdout, done.stderr)


def test_each_stage_goes_on_after_a_kill_at_any_moment(scene: Path, tmp_path: Path) -> None:
    """Killed as it is about to rename a file, or to remove one."""
    spool, out, options = tmp_path / "spool", tmp_path / "out", [*SMALL, "--keep"]
    to_prepare = ["prepare", scene, "--spool", spool, "--quiet", *options]
    for moment in ("Path:mkdir:1", "Path:replace:0", "Path:replace:1", "Path:replace:4", "Path:replace:3"):
        die(moment, *to_prepare)
        assert not (spool / "prepared").exists()
    assert prepare(scene, spool, options) == 0
    die("Path:replace:0", *to_prepare)
    assert prepare(scene, spool, options) == 0
    for moment in ("Path:replace:0", "Path:replace:3", "Path:unlink:0", "Path:unlink:1"):
        die(moment, "run", spool, "--quiet")
        assert not (spool / "results").is_dir() or not list((spool / "results").iterdir())
    assert run(spool) == 0
    to_finish = ["finish", scene, "--spool", spool, "--output", out, "--quiet"]
    # The sign, then publishing.
    for moment in ("Path:replace:0", "Path:replace:1", "Path:unlink:0"):
        die(moment, *to_finish)
        assert list((spool / "results").iterdir())
    assert finish(scene, spool, out) == 0
    assert bake(scene, tmp_path / "once", options) == 0
    assert lightmaps(out) == lightmaps(tmp_path / "once")
    assert sorted(path.name for path in spool.iterdir()) == ["finished", "over", "spool.json"]


@pytest.mark.parametrize("removed", [0, 1, 7])
def test_a_kill_while_the_spool_is_emptied(removed: int, scene: Path, tmp_path: Path) -> None:
    spool, out = tmp_path / "spool", tmp_path / "out"
    assert prepare(scene, spool, SMALL) == 0
    assert run(spool) == 0
    with pytest.MonkeyPatch.context() as patch:
        count, unlink = 0, Path.unlink

        def stop(self: Path, missing_ok: bool = False) -> None:
            nonlocal count
            if self.is_relative_to(spool) and (spool / "finished").exists():
                count += 1
                if count > removed:
                    raise KeyboardInterrupt
            unlink(self, missing_ok)

        patch.setattr(Path, "unlink", stop)
        assert finish(scene, spool, out) == 130
    written = (out / "report.json").stat().st_mtime_ns
    assert finish(scene, spool, out) == 0
    assert (out / "report.json").stat().st_mtime_ns == written
    assert sorted(path.name for path in spool.iterdir()) == ["finished", "over", "spool.json"]


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(signal.SIGINT, id="Ctrl-C"),
        # Handled as Ctrl-C is.
        pytest.param(signal.SIGTERM, id="SIGTERM", marks=pytest.mark.full),
    ],
)
def test_an_interrupted_run_goes_on(number: signal.Signals, scene: Path, tmp_path: Path) -> None:
    spool = tmp_path / "spool"
    assert prepare(scene, spool, SHARED) == 0
    words = [sys.executable, "-m", "radiosity_addon.farm", "run", str(spool), "--quiet"]
    with subprocess.Popen(words, cwd=ROOT, stderr=subprocess.PIPE, text=True) as running:
        until(lambda: list(spool.glob("calls/*/*.result")))
        running.send_signal(number)
        said = running.communicate(timeout=60)[1]
    assert running.returncode == 130
    assert said == (
        "error: interrupted; what was computed is kept in the spool: the same command goes on with it\n"
    )
    before = {path: path.stat().st_mtime_ns for path in spool.glob("calls/*/*.result")}
    assert before
    assert not list((spool / "results").iterdir())
    assert run(spool) == 0
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert finish(scene, spool, tmp_path / "out") == 0
    assert bake(scene, tmp_path / "once", SHARED) == 0
    assert lightmaps(tmp_path / "out") == lightmaps(tmp_path / "once")


@pytest.mark.parametrize("code", [28, 30], ids=["full", "read-only"])
def test_a_disk_that_takes_nothing_more_is_one_line(
    code: int,
    scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    spool, out = tmp_path / "spool", tmp_path / "out"
    options = [*SMALL, "--keep"]
    replace = Path.replace

    def refused(stage: list[str], after: int) -> None:
        count = 0

        def fails(self: Path, target: Path) -> Path:
            nonlocal count
            if Path(target).is_relative_to(spool):
                count += 1
                if count > after:
                    raise OSError(code, {28: "No space left on device", 30: "Read-only file system"}[code])
            return replace(self, target)

        with monkeypatch.context() as patch:
            patch.setattr(Path, "replace", fails)
            assert (run_command if stage[0] == "run" else main)(stage) == 1
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert said.startswith(f"error: cannot write to spool '{spool}': ")
        assert "Traceback" not in said

    to_prepare = ["prepare", str(scene), "--spool", str(spool), "--quiet", *options]
    for after in (0, 1, 8):
        refused(to_prepare, after)
        assert not spool.exists()
    assert prepare(scene, spool, options) == 0
    refused(to_prepare, 0)
    for after in (0, 2):
        refused(["run", str(spool), "--quiet"], after)
    assert run(spool) == 0
    refused(["finish", str(scene), "--spool", str(spool), "--output", str(out), "--quiet"], 0)
    assert finish(scene, spool, out) == 0


def test_a_stage_waits_for_no_other_and_disturbs_none(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spool = tmp_path / "spool"
    assert prepare(scene, spool, SMALL) == 0
    assert run(spool) == 0
    sign = Spool(spool).sign
    sign.write_text("elsewhere 1")
    before = sorted(spool.rglob("*"))
    capsys.readouterr()
    assert prepare(scene, spool, [*SMALL, "--seed", "1"]) == 1
    assert finish(scene, spool, tmp_path / "out") == 1
    assert bake(scene, tmp_path / "out", [*SMALL, "--spool", str(spool)]) == 1
    assert capsys.readouterr().err.count("is used by process 1 on elsewhere") == 2
    assert sorted(spool.rglob("*")) == before
    sign.unlink()
    assert finish(scene, spool, tmp_path / "out") == 0
