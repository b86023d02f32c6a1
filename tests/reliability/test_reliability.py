"""A few of each kind of trial; `python -m tests.reliability` makes them all, see docs/reliability.md."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from tests.processes import run_python
from tests.reliability import damage, full_disk, kills, scenes
from tests.reliability.command import ROOT
from tests.reliability.tally import Tally

DAMAGED = ("blend", "glb", "image", "sidecar", "report")
LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs Linux")


def check(tally: Tally, count: int) -> None:
    assert len(tally.entries) == count, tally.summary()
    assert [(entry["trial"], entry["problems"]) for entry in tally.failures] == []


@LINUX
def test_scenes() -> None:
    """Random scenes, baked, edited and restored."""
    tally = Tally("scenes", None)
    scenes.run_all(tally, range(4), workers=os.cpu_count() or 1)
    check(tally, 4)
    assert any(entry["outcome"] != "refused" for entry in tally.entries.values())


@LINUX
def test_damage(tmp_path: Path) -> None:
    """A damaged scene, texture, sidecar and report."""
    tally = Tally("damage", None)
    seeds = [next(n for n, (kind, _) in enumerate(damage.KINDS) if kind == wanted) for wanted in DAMAGED]
    damage.run_all(tally, tmp_path, seeds, workers=1)
    check(tally, len(DAMAGED))


@LINUX
def test_kills(tmp_path: Path) -> None:
    tally = Tally("kills", None)
    kills.run_all(tally, tmp_path / "sandbox", 2)
    check(tally, 2)


@LINUX
def test_full_disk(tmp_path: Path) -> None:
    """The folder for temporary files without inodes, and both folders full; mounting them takes root."""
    if not full_disk.can_mount():
        pytest.skip("file systems cannot be mounted here")
    if Path(sys.executable).is_relative_to("/tmp"):
        pytest.skip("this Python is in /tmp, which is mounted over")
    log = ROOT / "out" / "reliability" / "disk-few.jsonl"
    log.unlink(missing_ok=True)
    assert full_disk.enter(["disk", "--count", "2", "--name", log.stem]) == 0, log.read_text()


@LINUX
def test_failing_calls() -> None:
    """Every 24th call of each job, in a process whose audit hooks do not outlive it."""
    code = (
        "import os, sys, tempfile, radiosity_addon\n"
        "from pathlib import Path\n"
        "from tests.reliability import failing_calls\n"
        "from tests.reliability.tally import Tally\n"
        "radiosity_addon.register()\n"
        "tally = Tally('calls', None)\n"
        "with tempfile.TemporaryDirectory() as folder:\n"
        f"    failing_calls.run_all(tally, Path(folder) / 'sandbox', 24, ({errno.ENOSPC},))\n"
        "code = tally.finish()\n"
        "os._exit(code)\n"
    )
    done = run_python(code, timeout=300)
    assert "calls:" in done.stdout, done.stderr[-2000:]
    assert done.returncode == 0, done.stderr[-3000:]


def test_a_wrong_program_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The checks can fail: on a deleted file, and on a result that is half done."""
    from tests.reliability import folders

    (tmp_path / "a.txt").write_text("mine")
    before = folders.tree(tmp_path)
    (tmp_path / "a.txt").unlink()
    assert folders.changes(before, folders.tree(tmp_path)) == ["gone: a.txt"]
    entry = '{"objects": [{"image": "l.exr"}], "solver": {}, "files": {"l.exr": {"sha256": "0"}}}'
    (tmp_path / "report.json").write_text(entry)
    assert folders.broken_result(tmp_path) == ["missing: l.exr", "missing image: l.exr"]
