"""Computes the figures of the theory pages: `python3 build.py figures [--check] [NAME…]`.

Every other module here with a function `figure(small)` is one figure. It computes with the add-on's own
solver, asserts the numbers its page quotes, and returns the drawing. With --check it does so at reduced
size and no image is written.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
import traceback
from pathlib import Path

import drawing

HERE = Path(__file__).resolve().parent
IMAGES = HERE.parent / "theory" / "images"
HELPERS = {"__main__", "drawing", "measures", "painting", "scenes"}


def main() -> int:
    """Make the figures named, or all; return the number of those whose numbers did not hold."""
    names = sorted(path.stem for path in HERE.glob("*.py") if path.stem not in HELPERS)
    parser = argparse.ArgumentParser(
        prog="build.py figures", description="Compute the figures of docs/theory."
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"all, or some of: {', '.join(names)}")
    parser.add_argument(
        "--check", action="store_true", help="assert the numbers at reduced size, write nothing"
    )
    options = parser.parse_args()
    if unknown := [name for name in options.names if name not in names]:
        parser.error(f"no figure {unknown[0]!r}; there are {', '.join(names)}")
    failed = []
    for name in options.names or names:
        start = time.perf_counter()
        try:
            drawn = importlib.import_module(name).figure(options.check)
            written = drawing.finish(drawn, None if options.check else IMAGES / f"{name}.png")
        except Exception:  # noqa: BLE001 - the other figures are still wanted
            traceback.print_exc()
            failed.append(name)
            continue
        print(f"{name:<24} {time.perf_counter() - start:5.1f} s  {written}", flush=True)
    if failed:
        print(f"figures: {', '.join(failed)} failed", file=sys.stderr)
    return min(len(failed), 1)


if __name__ == "__main__":
    sys.exit(main())
