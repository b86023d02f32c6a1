"""What the reports next to lightmaps say of them, read again only when they have changed."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy

from ...files import BAKE, KEPT, LISTED, REPORT_NAME, NoReportError, read_report
from ..datablocks.image_marks import REPORT

Listed = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True, eq=False, repr=False)
class _Read:
    """The needed part of a report: the files that it lists, and the mark of the bake in its sidecar."""

    listed: Listed = field(default_factory=dict)
    kept: str = ""


_known: dict[Path, tuple[tuple[int, int, int], _Read]] = {}
"""What was read, and number, time and size of the file then."""


def report_of(image: bpy.types.Image) -> Path:
    """Return the report next to an image's file."""
    path = Path(bpy.path.abspath(image.filepath_raw))
    return path.with_name(Path(str(image.get(REPORT, ""))).name or REPORT_NAME)


def listed_in(report: Path) -> Listed:
    """Return what a report lists of the files next to it."""
    return _read(report).listed


def bake_kept_by(report: Path) -> str:
    """Return the mark of the bake in the sidecar that a report names; "" if it names none."""
    return _read(report).kept


def _read(report: Path) -> _Read:
    """Read a report, again only if it has changed."""
    try:
        found = report.stat()
    except OSError:
        return _Read()
    stamp = found.st_ino, found.st_mtime_ns, found.st_size
    known = _known.get(report)
    if known is None or known[0] != stamp:
        read = _Read()
        with suppress(OSError, NoReportError):
            contents = read_report(report)
            read = _Read(contents[LISTED], _kept_by(contents))
        known = _known[report] = stamp, read
    return known[1]


def _kept_by(contents: Mapping[str, Any]) -> str:
    kept = contents.get(KEPT)
    return str(kept.get(BAKE, "")) if isinstance(kept, dict) else ""


def forget_reports() -> None:
    """Read all of them again when they are needed."""
    _known.clear()
