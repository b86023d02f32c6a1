"""A bake of many pages on a farm: `python3 -m bench.city FOLDER`.

A city of 2.2 million triangles is baked on 16 pages of 2048² at draft, by a process of two threads and
one worker. What is kept: their time, the most memory of their own that each takes, the spool's size, and
what each kernel read and found. It takes more than an hour, and 40 GB of temporary files besides the folder.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from .compare import say
from .report import context, write

RESULTS = Path(__file__).parent / "results"

LOOK = 5.0
"""Seconds between looks at memory and spool."""


class Watch:
    """The most that a process, those it starts, and a folder take.

    memory_MB: Of each process, by its number: without what are pages of files.
    folder_MB: Of the folder.
    """

    def __init__(self, process: int, folder: Path) -> None:
        self._process, self._folder = process, folder
        self.memory_MB: dict[int, float] = {}
        self.folder_MB = 0.0

    def look(self) -> None:
        for process in Path("/proc").glob("[0-9]*"):
            try:
                status = (process / "status").read_text()
            except OSError:
                continue  # it has ended
            says = dict(line.split(":", 1) for line in status.splitlines())
            number = int(process.name)
            if self._process in (number, int(says["PPid"])) and "RssAnon" in says:
                now = int(says["RssAnon"].split()[0]) * 1024 / 1e6
                self.memory_MB[number] = max(self.memory_MB.get(number, 0.0), now)
        self.folder_MB = max(self.folder_MB, _size(self._folder) / 1e6)


def _size(folder: Path) -> int:
    total = 0
    for where, _, names in os.walk(folder):
        for name in names:
            try:
                total += (Path(where) / name).stat().st_size
            except OSError:
                continue  # it was renamed or removed meanwhile
    return total


def build(path: Path, houses: int) -> None:
    """Write the scene."""
    import bpy

    from radiosity_addon.blender.files.files import empty_scene

    from .city_scene import build_city

    empty_scene()
    build_city(houses)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def measure(folder: Path, settings: dict[str, Any]) -> dict[str, Any]:
    """Bake the scene in a folder, and return what it took."""
    command = [sys.executable, "-m", "radiosity_addon", "bake", str(folder / "city.blend")]
    for name, value in settings.items():
        command += [f"--{name.replace('_', '-')}", str(value)]
    command += ["--output", str(folder / "out"), "--spool", str(folder / "spool"), "--farm", "local:1"]
    started, before = time.monotonic(), os.times()
    with (folder / "log").open("w") as log:
        bake = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, start_new_session=True)
        watch = Watch(bake.pid, folder / "spool")
        while bake.poll() is None:
            time.sleep(LOOK)
            watch.look()
    after = os.times()
    if bake.returncode:
        raise SystemExit((folder / "log").read_text())
    report = json.loads((folder / "out" / "report.json").read_text())
    return {
        "seconds": time.monotonic() - started,
        "cpu_seconds": sum(after[2:4]) - sum(before[2:4]),
        "memory_MB": sorted((most for most in watch.memory_MB.values() if most > 100), reverse=True),
        "spool_MB": watch.folder_MB,
        "stages": report["seconds"],
        "performance": report["performance"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="empty, with room for 35 GB")
    parser.add_argument("--houses", type=int, default=18, help="along a side")
    parser.add_argument("--pages", type=int, default=16)
    parser.add_argument("--resolution", type=int, default=2048)
    chosen = parser.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    if any(chosen.folder.iterdir()):
        parser.error(f"'{chosen.folder}' is not empty: give another folder")
    build(chosen.folder / "city.blend", chosen.houses)
    settings = {"pages": chosen.pages, "resolution": chosen.resolution, "quality": "draft", "threads": 2,
                "memory_limit": 6}  # fmt: skip
    found = measure(chosen.folder, settings)
    found = {"case": "city", "houses": chosen.houses, "settings": settings, **found, "context": context(2)}
    say(str(write(found, RESULTS)))


if __name__ == "__main__":
    main()
