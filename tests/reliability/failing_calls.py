"""Each file system call of publishing fails once: afterwards the old result is whole, or the new one is.

The jobs run in this process, and fail by Python's audit events: see `hooks.py`.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy

from . import folders
from .command import QUICK
from .hooks import Watch
from .sandbox import Sandbox, add_foreign, build_room
from .tally import Tally

CODES = (errno.ENOSPC, errno.EACCES, errno.EIO)
MOST_CALLS = 400

Job = Callable[[Sandbox, int], str]
"""Does the work, different for each number; returns the error message, "" if it has succeeded."""


@dataclass
class _Failing:
    """Which call fails, how, and what it was."""

    number: int = 0
    code: int = 0
    failed: str = ""

    def react(self, count: int, event: str, paths: list[str]) -> None:
        if count == self.number:
            self.failed = f"{event} {[Path(path).name for path in paths]}"
            raise OSError(self.code, os.strerror(self.code), *paths[:1])


def run_all(tally: Tally, root: Path, every: int = 1, codes: tuple[int, ...] = CODES) -> None:
    """Make every call fail, or every so many-th of them."""
    sandbox = Sandbox(root)
    failing = _Failing()
    watch = Watch(failing.react, sandbox.out)
    for name, job in JOBS.items():
        with _prepared(sandbox, name):
            for code in codes:
                _fail_each(tally, sandbox, watch, failing, (name, job, code), every)


def _fail_each(
    tally: Tally, sandbox: Sandbox, watch: Watch, failing: _Failing, what: tuple[str, Job, int], every: int
) -> None:
    name, job, code = what
    kept = sandbox.root / "kept"
    for number in range(1, MOST_CALLS, every):
        trial = f"{name} {errno.errorcode[code]} {number}"
        shutil.rmtree(sandbox.out)
        shutil.copytree(kept, sandbox.out)
        if name == "command line relight":
            _turn_lamp(sandbox, number)
        before, foreign = sandbox.result(), sandbox.foreign()
        failing.number, failing.code, failing.failed, watch.count = number, code, "", 0
        watch.active = True
        try:
            told = job(sandbox, number)
        finally:
            watch.active = False
        if not failing.failed:
            return
        if tally.done(trial):
            continue
        problems = _problems(sandbox, before, told)
        problems += folders.changes(foreign, sandbox.foreign())
        outcome = "failed" if told else "succeeded"
        tally.add(trial, outcome, [f"{failing.failed}: {line}" for line in problems])


def _problems(sandbox: Sandbox, before: dict[str, str], told: str) -> list[str]:
    problems = []
    lines = [line for line in told.splitlines() if line.strip()]
    if "Traceback" in told or "internal error" in told:
        problems.append(f"traceback: {lines[-1][:200]}")
    elif len(lines) > 1:
        problems.append(f"{len(lines)} lines: {told[:300]}")
    if ".radiosity-" in told or ".baked-" in told:
        problems.append(f"names a staging path: {told[:200]}")
    after = sandbox.result()
    if folders.changes(before, after):
        problems += [f"neither old nor new: {line}" for line in folders.broken_result(sandbox.out)]
    return problems


@contextlib.contextmanager
def _prepared(sandbox: Sandbox, name: str) -> Iterator[None]:
    """Make the scene and an earlier result, and keep a copy of the folder."""
    shutil.rmtree(sandbox.root, ignore_errors=True)
    for folder in (sandbox.scene.parent, sandbox.out, sandbox.temporary):
        add_foreign(folder)
    build_room()
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality, settings.min_area = 16, "sketch", 0.5
    settings.output_folder = str(sandbox.out)
    bpy.context.scene.radiosity_relight.sidecar = True
    bpy.ops.wm.save_as_mainfile(filepath=str(sandbox.scene))
    told = JOBS["panel bake" if name.startswith("panel") else "command line bake"](sandbox, 999)
    assert not told, told
    if name.startswith("panel"):
        bpy.ops.wm.save_as_mainfile(filepath=str(sandbox.scene))
    shutil.copytree(sandbox.out, sandbox.root / "kept")
    yield


def _command_line(sandbox: Sandbox, *words: object) -> str:
    from radiosity_addon.blender.command_line.main import main

    told = io.StringIO()
    given = ("bake", sandbox.scene, "--output", sandbox.out, "--quiet", *words)
    with contextlib.redirect_stderr(told):
        code = main([str(word) for word in given])
    return told.getvalue() or ("failed without a word" if code else "")


def _operator(sandbox: Sandbox, operator: Callable[..., set[str]]) -> str:
    errors = io.StringIO()
    try:
        with contextlib.redirect_stderr(errors):
            status = operator("EXEC_DEFAULT")
    except RuntimeError as error:
        return str(error).strip().removeprefix("Error: ")
    return "" if status == {"FINISHED"} else f"{status} {errors.getvalue()}"


def _bake(sandbox: Sandbox, number: int) -> str:
    return _command_line(sandbox, *QUICK, "--keep", "--seed", number)


def _relight(sandbox: Sandbox, _number: int) -> str:
    return _command_line(sandbox, "--relight")


def _turn_lamp(sandbox: Sandbox, number: int) -> None:
    """Save the scene with another strength of its lamp."""
    bpy.ops.wm.open_mainfile(filepath=str(sandbox.scene))
    bpy.data.lights["Lamp"].energy = 100 + number
    bpy.ops.wm.save_as_mainfile(filepath=str(sandbox.scene))


def _panel_bake(sandbox: Sandbox, number: int) -> str:
    bpy.ops.wm.open_mainfile(filepath=str(sandbox.scene))
    bpy.context.scene.radiosity.seed = number
    return _operator(sandbox, bpy.ops.radiosity.bake)


def _panel_relight(sandbox: Sandbox, number: int) -> str:
    bpy.ops.wm.open_mainfile(filepath=str(sandbox.scene))
    bpy.data.lights["Lamp"].energy = 100 + number
    return _operator(sandbox, bpy.ops.radiosity.relight)


JOBS: dict[str, Job] = {
    "command line bake": _bake,
    "command line relight": _relight,
    "panel bake": _panel_bake,
    "panel relight": _panel_relight,
}
