"""The user guide's pictures of the panel, taken in a real window: `python3 -m bench.screenshots`."""

from __future__ import annotations

import shutil

from .compare import say
from .window import ROOT, cornell_window

IMAGES = ROOT / "docs" / "images"

PICTURES = {
    **{f"working-{name}": name for name in ("panel", "presets", "check", "progress")},
    "faces-buttons": "flip-faces",
}
"""What windows are photographed as, and what the pictures are called in the guide."""


def main() -> None:
    with cornell_window() as (installed, scene):
        for session in ("working", "faces"):
            installed.drive(f"drive_{session}.py", scene, session)
        for taken, name in PICTURES.items():
            shutil.copy(scene.with_name(f"{taken}.png"), IMAGES / f"{name}.png")
            say(f"docs/images/{name}.png")


if __name__ == "__main__":
    main()
