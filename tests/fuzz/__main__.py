"""`build.py fuzz`: try more random scenes than the tests do, and print what goes wrong."""

from __future__ import annotations

import argparse
import os
import sys
import time
import traceback

import radiosity_addon
from tests.reliability.quiet import quiet

from .checks import check
from .scenes import SCENES


def main() -> int:
    parser = argparse.ArgumentParser(prog="build.py fuzz", description="Bake random scenes and check them.")
    parser.add_argument(
        "--seeds", default=f"0:{SCENES}", metavar="A:B", help=f"from A to B − 1 (default 0:{SCENES})"
    )
    first, _, last = parser.parse_args().seeds.partition(":")
    if not (first.isdigit() and last.isdigit() and int(first) < int(last)):
        parser.error("--seeds takes two numbers, such as 500:1000")
    radiosity_addon.register()
    baked, wrong, started = 0, [], time.perf_counter()
    seeds = range(int(first), int(last))
    for seed in seeds:
        try:
            with quiet():
                baked += check(seed)
        except Exception:  # noqa: BLE001 (whatever it is, it is what we look for)
            wrong.append(seed)
            sys.stderr.write(f"seed {seed}:\n")
            traceback.print_exc()
    taken = time.perf_counter() - started
    refused = len(seeds) - baked - len(wrong)
    told = f"{len(seeds)} scenes in {taken:.0f} s: {baked} baked, {refused} refused, {len(wrong)} wrong"
    sys.stdout.write(f"{told} {wrong or ''}\n")
    sys.stdout.flush()
    return 1 if wrong else 0


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    # Blender's own end may crash or hang while our classes are registered.
    os._exit(code)
