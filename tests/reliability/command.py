"""The command line in a process of its own, with limits, and what is wrong with how it ended."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
QUICK = ("--resolution", "16", "--quality", "sketch", "--min-area", "0.2", "--threads", "1")

MEMORY = 12 << 30
"""Bytes of address space: a net below the program's own refusals."""

MOST_MEMORY = 3 << 30
"""Bytes that no small input may take."""

MOST_LINES = 4
"""On the error stream."""

SECONDS = 120.0


@dataclass(frozen=True)
class Outcome:
    """How a process ended; `code` is negative for a signal, `timed_out` if it had to be ended."""

    code: int
    out: str
    err: str
    seconds: float
    peak: int
    timed_out: bool = False

    @property
    def crashed(self) -> bool:
        """Whether Blender itself went down."""
        return self.code < 0 and not self.timed_out


def run(
    *words: object, cwd: Path, hook: str = "", temporary: Path | None = None, seconds: float = SECONDS,
    environment: Mapping[str, str] | None = None,
) -> Outcome:  # fmt: skip
    """Run `python -m radiosity_addon WORDS`; `hook` is Python that runs before it."""
    start = "import runpy; runpy.run_module('radiosity_addon', run_name='__main__', alter_sys=True)"
    return run_python(
        f"{hook}\n{start}", *words, cwd=cwd, temporary=temporary, seconds=seconds, environment=environment
    )


def run_python(
    code: str, *words: object, cwd: Path, temporary: Path | None = None, seconds: float = SECONDS,
    environment: Mapping[str, str] | None = None,
) -> Outcome:  # fmt: skip
    """Run Python code in a process group of its own, and end all of it in the end."""
    given = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1", **(environment or {})}
    if temporary is not None:
        given["TMPDIR"] = str(temporary)
    began, timed_out = time.monotonic(), False
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = subprocess.Popen(
            [sys.executable, "-c", code, *map(str, words)],
            cwd=cwd, env=given, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
            start_new_session=True, preexec_fn=_limit,
        )  # fmt: skip
        while True:
            pid, status, used = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            if time.monotonic() - began > seconds and not timed_out:
                timed_out = True
                _end(process.pid)
            time.sleep(0.02)
        process.returncode = os.waitstatus_to_exitcode(status)
        _end(process.pid)
        told = []
        for stream in (out, err):
            stream.seek(0)
            told.append(stream.read().decode("utf-8", "replace"))
    peak = used.ru_maxrss * 1024
    return Outcome(process.returncode, told[0], told[1], time.monotonic() - began, peak, timed_out)


def _limit() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _end(group: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)


def bad_manners(done: Outcome, refused_names: str = "") -> list[str]:
    """Tell what is wrong with how the command line ended, whatever it did."""
    if done.timed_out:
        return [f"took more than {done.seconds:.0f} s"]
    lines = []
    if done.code not in (0, 1, 2):
        lines.append(f"exit code {done.code}")
    if "Traceback (most recent call last)" in done.out + done.err or "internal error" in done.err:
        lines.append("traceback")
    told = [line for line in done.err.splitlines() if line.strip()]
    if len(told) > MOST_LINES:
        lines.append(f"{len(told)} lines of errors")
    if done.code in (1, 2):
        errors = [line for line in told if line.startswith("error: ")]
        if len(errors) != 1:
            lines.append(f"{len(errors)} lines say what is wrong")
        elif refused_names and refused_names not in errors[0]:
            lines.append(f"the error does not name {refused_names}")
    if done.peak > MOST_MEMORY:
        lines.append(f"{done.peak / 2**30:.1f} GB of memory")
    return lines
