"""The user guide's pictures of the panel, taken in a real window: `python3 -m bench.screenshots`."""

from __future__ import annotations

import shutil

from .compare import say
from .window import ROOT, cornell_window

IMAGES = ROOT / "docs" / "images"

PICTURES = ("panel", "presets", "check", "progress")


def main() -> None:
    with cornell_window() as (installed, scene):
        installed.drive("drive_working.py", scene, "working")
        for name in PICTURES:
            shutil.copy(scene.with_name(f"working-{name}.png"), IMAGES / f"{name}.png")
            say(f"docs/images/{name}.png")


if __name__ == "__main__":
    main()
