"""Bake the rows in Cycles, twice each, for the golden tests to compare with.

    python -m tests.golden.make_references [NAME…] [--stale]

With names, only rows that begin with one of them; with --stale, only those without references that
fit their builder. A row takes some ten to thirty seconds on two cores. Made with Blender 5.0.
"""

from __future__ import annotations

import argparse
import os
import sys
import time

import bpy
import numpy as np

from bench import cycles
from tests.golden import references
from tests.golden.rows import ROWS, Row
from tests.golden.usual_trick import let_light_through

SEEDS = (1, 2)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"beginnings of: {', '.join(ROWS)}")
    parser.add_argument("--stale", action="store_true", help="only those whose references do not fit")
    parser.add_argument("--threads", type=int, default=0)
    options = parser.parse_args()
    for row in ROWS.values():
        fits = references.read_index(row.family).get(row.name, {}).get("signature") == row.signature
        wanted = not options.names or row.name.startswith(tuple(options.names))
        if not wanted or (options.stale and fits):
            continue
        if bpy.app.version < row.needs:
            say(f"{row.name}: this Blender does not have it")
            continue
        seconds, size = make(row, options.threads)
        kept = {name: entry for name, entry in references.read_index(row.family).items() if name in ROWS}
        references.write_index(row.family, {**kept, row.name: entry_of(row, seconds)})
        say(f"{row.name:<28} {seconds:5.1f} s  {size / 1024:4.0f} KiB")
    return 0


def make(row: Row, threads: int) -> tuple[float, int]:
    """Bake a row and keep it; returns the seconds and the bytes."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    row.build()
    scene = bpy.context.scene
    let_light_through(scene)
    cycles.set_up(scene, threads)
    started = time.perf_counter()
    bakes = [cycles.bake_light(scene, row.resolution, row.samples, seed) for seed in SEEDS]
    seconds = time.perf_counter() - started
    # Cycles has a NaN now and then (a point lamp on a spot's edge): such a texel is not compared.
    coverage = cycles.covered(scene, row.resolution) & np.isfinite(bakes).all(axis=(0, 3))
    return seconds, references.save(row, (bakes[0], bakes[1]), coverage)


def entry_of(row: Row, seconds: float) -> dict[str, object]:
    return {
        "signature": row.signature,
        "blender": bpy.app.version_string,
        "samples": row.samples,
        "seeds": SEEDS,
        "seconds": round(seconds, 1),
    }


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    os._exit(code)  # some versions of Blender's module hang or crash at the interpreter's own exit
