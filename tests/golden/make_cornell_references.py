"""Bake the bundled Cornell box in Cycles, twice, for the golden test to compare with.

    python -m tests.golden.make_cornell_references [--samples 2048] [--output FILE]

Takes some four minutes a bake on two quiet cores. The layout is the one our own bake makes
at 256 px, and is stored with the pixels: the test keeps it, so texels match one by one.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

import bpy

from bench import cycles
from bench.layout import lay_out, write_layout
from radiosity_addon.blender.files.cornell import build_cornell_box
from tests.golden.cornell_reference import FILE, Reference

RESOLUTION = 256
SEEDS = (1, 2)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=2048)
    parser.add_argument("--output", type=Path, default=FILE)
    options = parser.parse_args()

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = build_cornell_box()
    uv = lay_out(RESOLUTION)
    write_layout(uv)
    cycles.set_up(scene)

    bakes = []
    for seed in SEEDS:
        started = time.perf_counter()
        bakes.append(cycles.bake_light(scene, RESOLUTION, options.samples, seed))
        say(f"seed {seed}: {time.perf_counter() - started:.0f} s")
    coverage = cycles.covered(scene, RESOLUTION)
    about = (
        f"Cycles of Blender {bpy.app.version_string}, Diffuse, Direct and Indirect, Color off, "
        f"{options.samples} samples, {cycles.BOUNCES} bounces, seeds {SEEDS}"
    )
    Reference(uv, bakes[0], bakes[1], coverage).save(options.output, about)
    say(f"{options.output}: {options.output.stat().st_size / 1024:.0f} KiB, {coverage.sum()} texels")
    return 0


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    os._exit(main())  # some versions of Blender's module hang or crash at the interpreter's own exit
