"""Output of the command line: progress, paths, warnings."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any, TextIO

from ..base import Expected, RemainingTime, duration, one_of_each
from .path_checks import escaped

STAGE_NAMES = {"rasterise": "rasterize"}
"""Names of stages that are shown differently from the report's keys, which scripts read."""

PERCENT_STEP = 10
"""Without a terminal a stage prints a line again after this many percent."""


class Console:
    """Our own lines on standard output, without Blender's output.

    While entered, file descriptor 1 leads to the null device: Blender's C code writes
    a line there for every sample it renders. Our lines go to a copy of the original.

    quiet: Print nothing at all.
    """

    def __init__(self, quiet: bool = False) -> None:
        self.quiet = quiet
        self._stream: TextIO = sys.stdout
        self._theirs: TextIO = sys.stdout
        self._saved: int | None = None
        self._stage = ""
        self._percent = -PERCENT_STEP
        self._open_line = False
        self._remaining = RemainingTime()

    def __enter__(self) -> Console:
        self._stream = sys.stdout
        _flush_everything()
        try:
            self._saved = os.dup(1)
        except OSError:  # a process without standard output
            return self
        if _descriptor(sys.stdout) == 1:
            encoding = sys.stdout.encoding or "utf-8"
            self._stream = os.fdopen(os.dup(1), "w", encoding=encoding, errors="replace")
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        # Blender's operators report through Python's own stream.
        self._theirs, sys.stdout = sys.stdout, os.fdopen(null, "w", encoding="utf-8")
        return self

    def __exit__(self, *_: object) -> None:
        self._end_line()
        if self._saved is not None:
            _flush_everything()
            os.dup2(self._saved, 1)
            os.close(self._saved)
            self._saved = None
            sys.stdout.close()
            sys.stdout = self._theirs
        if self._stream is not sys.stdout:
            with suppress(OSError):
                self._stream.close()
            self._stream = sys.stdout

    def progress(self, stage: str, fraction: float, expected: Expected | None = None) -> None:
        """Show the stage, the overall progress (0 to 1), and the estimated time left."""
        if self.quiet:
            return
        stage = STAGE_NAMES.get(stage, stage)
        seconds = self._remaining.update(fraction, expected)
        left = "" if seconds is None or fraction >= 1.0 else f", about {duration(seconds)} left"
        percent = int(100 * min(max(fraction, 0.0), 1.0))
        if self._stream.isatty():
            if (stage, percent) != (self._stage, self._percent):
                self._write(f"\r\x1b[K[{percent:3d} %] {stage}{left}")
                self._open_line = True
                self._stage, self._percent = stage, percent
        elif stage != self._stage or percent >= self._percent + PERCENT_STEP:
            self._write(f"[{percent:3d} %] {stage}{left}\n")
            self._stage, self._percent = stage, percent

    def lines(self, lines: Iterable[str]) -> None:
        """Print finished lines."""
        if self.quiet:
            return
        self._end_line()
        for line in lines:
            self._write(escaped(line) + "\n")

    def _write(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError):
            self.quiet = True  # the reader has closed the pipe, as `| head` does; the bake continues

    def _end_line(self) -> None:
        if self._open_line:
            self._write("\r\x1b[K")
            self._open_line = False


def _descriptor(stream: TextIO) -> int | None:
    """The file descriptor behind a stream; None if there is none."""
    try:
        return stream.fileno()
    except (AttributeError, OSError, ValueError):
        return None


def _flush_everything() -> None:
    """Empty Python's buffer of standard output, and C's, which would come out later."""
    sys.stdout.flush()
    try:
        ctypes.CDLL(None).fflush(None)
    except (OSError, TypeError, AttributeError):
        return  # Windows: C's buffer is not to be had this way


def summary(where: str, files: Iterable[tuple[str, str]], report: dict[str, Any]) -> list[str]:
    """Return the closing lines of a bake: paths, time, and warnings.

    where: The output folder as the user named it.
    files pairs of (name, what it is).
    report: The report as it is written to report.json.
    """
    solver = report["solver"]
    count = len(report["objects"])
    lines = [f"{count} object{'' if count == 1 else 's'} baked into {where}"]
    lines += [f"  {name:<24} {what}" for name, what in files]
    lines.append(
        f"{solver['method']}: {solver['elements']:,} elements, {solver['links']:,} links, "
        f"{solver['rays']:,} rays"
    )
    if solver.get("estimated_error") is not None:
        lines.append(f"estimated error: {solver['estimated_error']:.2%} of the mean light (RMS)")
    power = solver.get("power_W", {})
    if power.get("emitted") and "escaped" in power:
        lines.append(f"light that leaves the scene: {power['escaped'] / power['emitted']:.1%}")
    if solver.get("glass"):
        lines.append(_of_glass(solver["glass"], solver.get("power_W")))
    seconds = report["seconds"]
    lines += [f"  {STAGE_NAMES.get(stage, stage):<24} {taken:7.2f} s" for stage, taken in seconds.items()]
    lines.append(f"  {'total':<24} {sum(seconds.values()):7.2f} s")
    warnings = report["warnings"]
    if warnings:
        shown = one_of_each(warnings)
        alike = f", {len(shown)} of them shown" if len(shown) < len(warnings) else ""
        lines.append(f"{len(warnings)} warning{'s' if len(warnings) > 1 else ''}{alike}:")
        lines += [f"  {warning['name']}: {warning['message']}" for warning in shown]
    notes = [f"note: {note['message']}" for note in one_of_each(report.get("notes", ()))]
    return [*lines, *notes]


def _of_glass(objects: Sequence[str], power: dict[str, float] | None) -> str:
    """Say which objects are glass, and what they take of the light, if that is known."""
    named = ", ".join(f"'{name}'" for name in objects[:3]) + (", …" if len(objects) > 3 else "")
    count = f"{len(objects)} object{'' if len(objects) == 1 else 's'}"
    passes = f"glass: light goes straight through {count} ({named})"
    if power is None:
        return passes
    taken = power.get("absorbed_by_glass", 0.0) / max(power["emitted"], 1e-300)
    if taken < 5e-4:
        return passes
    return f"{passes}, which {'takes' if len(objects) == 1 else 'take'} {taken:.1%} of all light"
