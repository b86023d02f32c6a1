"""Full disks, read-only disks, disks without inodes: for the output folder or for temporary files.

Small file systems in memory are mounted in a separate mount namespace, which takes root. There `/tmp` is one
too: a program that deletes too much finds nothing there.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from . import folders
from .command import ROOT, bad_manners
from .sandbox import Sandbox, add_foreign
from .tally import Tally

COUNT = 20
SIZE = "24m"

INSIDE = "RADIOSITY_TEST_MOUNTS"
"""Set in the environment once the process is in a namespace of its own."""

MESSAGE_AWAY = (".radiosity-", ".baked-", ".part")
"""What no message may name: files that are gone when the message is read."""


@dataclass(frozen=True)
class Trial:
    """What is wrong with which file systems.

    Parameters
    ----------
    place : str
        "out", "tmp", or "both".
    kind : str
        "full", "read-only" or "inodes".
    free : int
        Bytes, or inodes, that are left.
    """

    place: str
    kind: str
    free: int = 0

    def __str__(self) -> str:
        return f"{self.place} {self.kind} {self.free}"


def trials(needed: int, count: int = COUNT) -> list[Trial]:
    """Return the trials, for a result that takes so many bytes."""
    special = [
        Trial("tmp", "inodes"), Trial("both", "full"), Trial("tmp", "read-only"), Trial("tmp", "full"),
        Trial("out", "inodes"), Trial("out", "read-only"), Trial("out", "inodes", 3),
        Trial("tmp", "inodes", 1),
    ]  # fmt: skip
    if count <= len(special):
        return special[:count]
    steps = count - len(special)
    return special + [Trial("out", "full", int(1.3 * needed * step / steps)) for step in range(steps)]


def can_mount() -> bool:
    """Whether file systems can be mounted in a namespace of ours."""
    command = ["unshare", "-m", "--propagation", "private", "mount", "-t", "tmpfs", "tmpfs", "/mnt"]
    try:
        return subprocess.run(command, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def enter(words: list[str]) -> int:
    """Run `python -m tests.reliability` in a namespace where /tmp is a file system in memory."""
    script = """
set -e
mount -t tmpfs tmpfs /mnt
mkdir /mnt/code /mnt/work /mnt/out
mount --bind "$1" /mnt/code
mount --bind "$2" /mnt/out
mount -t tmpfs tmpfs /tmp
cd /mnt/code
shift 2
exec "$@"
"""
    kept = ROOT / "out" / "reliability"
    kept.mkdir(parents=True, exist_ok=True)
    python = Path(sys.prefix).resolve() / "bin" / "python"
    command = ["unshare", "-m", "--propagation", "private", "sh", "-c", script, "sh", str(ROOT), str(kept)]
    command += [str(python), "-m", "tests.reliability", *words]
    environment = {**os.environ, INSIDE: "1", "PYTHONPATH": "/mnt/code", "TMPDIR": "/tmp"}
    return subprocess.run(command, env=environment, check=False).returncode


def run_all(tally: Tally, count: int = COUNT) -> None:
    """Make the trials; only inside a namespace of our own."""
    assert os.environ.get(INSIDE), "outside its namespace this could do harm"
    sandbox = Sandbox(Path("/mnt/work/sandbox"))
    sandbox.make()
    done = sandbox.bake("--keep")
    assert done.code == 0, done.err
    entries = folders.listed(sandbox.out).values()
    for trial in trials(sum(entry["bytes"] for entry in entries), count):
        if not tally.done(trial):
            tally.add(trial, *_try(sandbox, trial))


def _try(sandbox: Sandbox, trial: Trial) -> tuple[str, list[str]]:
    sandbox.make()
    places = [sandbox.out, sandbox.temporary] if trial.place == "both" else []
    places = places or [sandbox.out if trial.place == "out" else sandbox.temporary]
    for place in places:
        shutil.rmtree(place)
        place.mkdir()
        _run("mount", "-t", "tmpfs", "-o", f"size={SIZE},nr_inodes=200", "tmpfs", place)
        add_foreign(place)
    try:
        first = sandbox.bake("--keep")
        assert first.code == 0, first.err
        for place in places:
            _spoil(place, trial)
        old, foreign = sandbox.result(), sandbox.foreign()
        done = sandbox.bake("--keep", "--seed", 1)
        problems = bad_manners(done)
        if done.code == 1:
            problems += [f"names {word}: {done.err.strip()}" for word in MESSAGE_AWAY if word in done.err]
            if not any(str(place) in done.err for place in (sandbox.out, sandbox.temporary)):
                problems.append(f"names no path: {done.err.strip()}")
            problems += folders.changes(old, sandbox.result())
        else:
            problems += folders.broken_result(sandbox.out)
        problems += folders.changes(foreign, sandbox.foreign())
        for place in places:
            _clear(place)
        again = sandbox.bake("--keep", "--seed", 2)
        if again.code != 0:
            problems.append(f"with room again: {again.err.strip()[-200:]}")
        problems += folders.changes(foreign, sandbox.foreign())
        left = folders.leftovers(sandbox.out, sandbox.temporary)
        problems += [f"left: {path}" for path in left if "blender_mine" not in path]
        return f"exit code {done.code}", problems
    finally:
        for place in places:
            _run("umount", "-l", place)


def _spoil(place: Path, trial: Trial) -> None:
    """Leave no more than the trial wants."""
    if trial.kind == "read-only":
        _run("mount", "-o", "remount,ro", place)
        return
    state = os.statvfs(place)
    if trial.kind == "inodes":
        (place / "filler").mkdir()
        for number in range(max(0, state.f_ffree - 1 - trial.free)):
            (place / "filler" / str(number)).touch()
        return
    size = state.f_bavail * state.f_frsize - trial.free
    with (place / "filler.bin").open("wb") as file:
        file.write(bytes(max(0, size)))


def _clear(place: Path) -> None:
    """Make it a good place again."""
    _run("mount", "-o", "remount,rw", place)
    (place / "filler.bin").unlink(missing_ok=True)
    shutil.rmtree(place / "filler", ignore_errors=True)


def _run(*words: object) -> None:
    subprocess.run([str(word) for word in words], check=True, capture_output=True)
