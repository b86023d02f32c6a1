"""Running measurements, each in a process of its own: so its peak of memory is its own too."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]


class MeasurementError(Exception):
    """A measurement that failed or took too long; the message says which."""


def run(task: str, minutes: float, **job: Any) -> dict[str, Any]:
    """Run a task of `measure.TASKS` and return what it found.

    Raises
    ------
    MeasurementError
        If it fails, or takes longer than `minutes`.
    """
    with tempfile.TemporaryDirectory(prefix="bench-") as name:
        folder = Path(name)
        (folder / "job.json").write_text(json.dumps({"task": task, **job}, default=str))
        paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
        with (folder / "log.txt").open("w") as log:
            try:
                done = subprocess.run(
                    [sys.executable, "-m", "bench.worker", name],
                    cwd=ROOT,
                    env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    stdin=subprocess.DEVNULL,
                    timeout=60 * minutes,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                raise MeasurementError(f"given up after {minutes:g} min") from None
        result = folder / "result.json"
        if done.returncode != 0 or not result.is_file():
            lines = (folder / "log.txt").read_text(errors="replace").strip().splitlines() or ["no output"]
            raise MeasurementError(f"exit code {done.returncode}: {lines[-1]}")
        return json.loads(result.read_text())
