"""The gallery, `docs/gallery.md`: a picture and the measured error of every row.

    python -m tests.golden.gallery [NAME…] [--stale] [--check]

Without names all rows are baked, some five minutes of processor time. With --stale only those whose
builder changed since, with --check none: it is asserted that page, pictures and rows belong together.
Whether bakes still come out as the page says is for the golden tests, which bake them anyway.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from tests.golden import references
from tests.golden.comparison import Comparison, compare
from tests.golden.gallery_page import IMAGES, PAGE, RECORD, page, picture
from tests.golden.pictures import write_png
from tests.golden.rows import ROWS, Row
from tests.golden.view import render_view

GAP = 4
"""Pixels between panels."""

STEPS = 31
"""Shades of the panel that shows the difference: its noise would be most of the file."""


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="build.py figures gallery",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"beginnings of: {', '.join(ROWS)}")
    parser.add_argument("--stale", action="store_true", help="only rows whose builder changed")
    parser.add_argument("--check", action="store_true", help="bake nothing; say what does not fit")
    options = parser.parse_args()
    if unknown := [name for name in options.names if not any(row.startswith(name) for row in ROWS)]:
        parser.error(f"no row begins with {unknown[0]!r}")
    if not options.check:
        make(tuple(options.names), options.stale)
    wrong = complaints()
    for line in wrong:
        say(f"gallery: {line}")
    if not wrong:
        say(f"{'gallery':<24} {len(ROWS)} rows fit their pictures and their page")
    return min(len(wrong), 1)


def make(names: tuple[str, ...], stale: bool) -> None:
    """Bake rows, draw their pictures and write the page."""
    for row in ROWS.values():
        fits = not _complaints_of(row, read_record().get(row.name))
        if (names and not row.name.startswith(names)) or (stale and fits) or bpy.app.version < row.needs:
            continue
        comparison = compare(row)
        write_png(picture(row.name), strip(comparison))
        entry = entry_of(row, comparison)
        _write_record({**read_record(), row.name: entry})
        kibibytes = picture(row.name).stat().st_size / 1024
        say(f"{row.name:<24} {100 * entry['error']:5.2f} %  {kibibytes:4.0f} KiB")
    for path in IMAGES.glob("*.png"):
        if path.stem not in ROWS:
            path.unlink()
    PAGE.write_text(page(read_record()), encoding="utf-8")


def strip(comparison: Comparison) -> np.ndarray:
    """Return the row's picture: the view, ours, Cycles', ten times the difference."""
    with tempfile.TemporaryDirectory() as folder:
        view = render_view(comparison.ours, comparison.exposure, Path(folder) / "view.png")
    ours, theirs, error = comparison.panels()
    gap = np.ones((len(view), GAP, 3))
    parts = [view, gap, ours, gap, theirs, gap, np.round(error * STEPS) / STEPS]
    return np.concatenate(parts, axis=1)


def entry_of(row: Row, comparison: Comparison) -> dict[str, Any]:
    """Return what is kept of a row's bake beside its picture."""
    return {
        "signature": row.signature,
        "blender": list(bpy.app.version[:2]),
        "error": round(comparison.relative_rmse, 5),
        "mean_ratio": round(comparison.mean_ratio, 5),
        "picture": _hash(picture(row.name)),
    }


def complaints() -> list[str]:
    """Return what of record, pictures and page does not fit the rows."""
    record = read_record()
    wrong = [line for row in ROWS.values() for line in _complaints_of(row, record.get(row.name))]
    wrong += [f"no row {name!r} any more" for name in record if name not in ROWS]
    wrong += [f"{path.name} belongs to no row" for path in IMAGES.glob("*.png") if path.stem not in ROWS]
    if not wrong and PAGE.read_text(encoding="utf-8") != page(record):
        wrong.append(f"{PAGE.name} is not what the rows say")
    return [f"{line}; run python3 build.py figures gallery --stale" for line in wrong]


def read_record() -> dict[str, dict[str, Any]]:
    return json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}


def _complaints_of(row: Row, entry: dict[str, Any] | None) -> list[str]:
    if entry is None or not picture(row.name).exists():
        return [f"{row.name} has no picture"]
    if entry["signature"] != row.signature:
        return [f"{row.name} changed since its picture was made"]
    if references.read_index(row.family).get(row.name, {}).get("signature") != row.signature:
        return [f"{row.name} changed since its references were made"]
    if entry["picture"] != _hash(picture(row.name)):
        return [f"{picture(row.name).name} is not the picture that was made"]
    if not entry["error"] < row.limit:
        return [f"{row.name} is above its limit"]
    return []


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _write_record(record: dict[str, dict[str, Any]]) -> None:
    lines = [f"{json.dumps(name)}: {json.dumps(record[name])}" for name in sorted(record) if name in ROWS]
    RECORD.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    os._exit(code)  # some versions of Blender's module hang or crash at the interpreter's own exit
