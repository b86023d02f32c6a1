"""How long a window stands still while it bakes, and how soon Esc works: `python3 -m bench.window`.

A real Blender with the extension's own zip and a virtual screen, drawn by software; the Cornell box.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from build_tools import extension, real_blender
from build_tools.environments import Environment
from tests.app.real_blender.installed import Installed

from .compare import say
from .report import context

ROOT = Path(__file__).resolve().parents[1]
INSIDE = ROOT / "tests" / "app" / "real_blender" / "inside"
RESULT = ROOT / "bench" / "results" / "window.json"

WINDOW = ("640", "400")
"""Its size: a processor draws it."""


def measure(quality: str, resolution: int, bakes: int, priority: int) -> dict:
    """Bake in a window and return what was seen."""
    with cornell_window() as (installed, scene):
        if priority:
            os.nice(-priority)
        return installed.drive(
            "drive_frames.py", scene, "window", quality, str(resolution), str(bakes), size=WINDOW
        )


@contextmanager
def cornell_window() -> Iterator[tuple[Installed, Path]]:
    """A real Blender with the extension as it is here, and the Cornell box as a .blend."""
    blender = real_blender.find()
    if blender is None:
        sys.exit("bench.window: no real Blender here; see `python3 build.py real-blender`")
    with blender.shared_folder() as folder:
        zips = extension.build(ROOT, Environment(ROOT, Path(sys.prefix)), folder / "zips")
        for script in [*INSIDE.glob("*.py"), ROOT / "tests" / "blender" / "file_dump.py"]:
            shutil.copy(script, folder)
        installed = Installed(blender, folder, folder / "user")
        installed.resources.mkdir()
        zip_file = next(path for path in zips if "linux_x64" in path.name)
        _must(installed.run("--command", "extension", "install-file", "-r", "user_default", "-e", zip_file))
        scene = folder / "cornell.blend"
        _must(installed.script("save_cornell_box.py", scene))
        yield installed, scene


def _must(done: subprocess.CompletedProcess[str]) -> None:
    if done.returncode != 0:
        sys.exit(done.stdout)


def print_figures(seen: dict) -> None:
    """Print the main figures."""
    idle = seen["idle"]["idle"]
    say(f"frames without a bake: median {idle['median_ms']} ms, longest {idle['longest_ms']} ms")
    for bake in seen["bakes"]:
        worst = {stage: found["longest_ms"] for stage, found in bake["stages"].items()}
        work = {stage: found["longest_work_ms"] for stage, found in bake["stages"].items()}
        say(f"bake of {bake['seconds']} s at load {bake['load_before']}: longest frames [ms] {worst}")
        say(f"  longest work of the main thread in a frame [ms] {work}")
    for pressed in seen["escapes"]:
        left = "as before" if not pressed["changed"] else f"CHANGED {pressed['changed']}"
        say(f"Esc in {pressed['moment']} ({pressed['stage']}): {pressed['seconds']} s, {left}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quality", default="medium")
    parser.add_argument("--resolution", type=int, default=256)
    parser.add_argument("--bakes", type=int, default=3)
    parser.add_argument(
        "--priority",
        type=int,
        default=0,
        help="go before other processes by so much (root), on a busy machine",
    )
    parser.add_argument("--try", action="store_true", dest="trial", help="write no result")
    options = parser.parse_args()
    seen = measure(options.quality, options.resolution, options.bakes, options.priority)
    print_figures(seen)
    if not options.trial:
        chosen = {name: getattr(options, name) for name in ("quality", "resolution", "priority")}
        RESULT.write_text(json.dumps({**chosen, **seen, "context": context(0)}, indent=1) + "\n")


if __name__ == "__main__":
    main()
