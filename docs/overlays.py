"""The user guide's picture of the overlays, from photographs of a window.

    RADIOSITY_FINE_PICTURES=1 python -m pytest tests/app/real_blender/test_overlays.py
    python -m docs.overlays

The first takes them in a real Blender and leaves them in `out/ci`.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
PHOTOGRAPHS, PICTURE = ROOT / "out" / "ci", ROOT / "docs" / "images" / "overlays.jpg"

ROWS = (("live", "false_color"), ("density", "checker"), ("elements", "links"), ("texels", "error"))

LEFT, TOP, WIDTH, HEIGHT = 8, 105, 800, 575
"""What of the window is shown: the box and the legend [pixels]."""

GAP = 8


def main() -> None:
    """Lay the photographs out, two in a row."""
    across = len(ROWS[0]) * (WIDTH + GAP) - GAP
    sheet = np.ones((len(ROWS) * (HEIGHT + GAP) - GAP, across, 4), dtype=np.float32)
    for row, names in enumerate(ROWS):
        for column, name in enumerate(names):
            part = photograph(name)[TOP : TOP + HEIGHT, LEFT : LEFT + WIDTH]
            assert part.shape[:2] == (HEIGHT, WIDTH), f"{name}: the window was smaller"
            assert part[..., :3].std() > 0.02, f"{name}: nothing is seen"
            y, x = row * (HEIGHT + GAP), column * (WIDTH + GAP)
            sheet[y : y + HEIGHT, x : x + WIDTH] = part
    save(sheet)


def photograph(name: str) -> np.ndarray:
    """Return (height, width, 4) pixels, the upper row first."""
    image = bpy.data.images.load(str(PHOTOGRAPHS / f"overlay-{name}.png"))
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[::-1]


def save(pixels: np.ndarray) -> None:
    """Write the user guide's picture."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("overlays", width, height)
    image.pixels.foreach_set(np.ascontiguousarray(pixels[::-1]).ravel())
    image.filepath_raw, image.file_format = str(PICTURE), "JPEG"
    image.save(quality=88)


if __name__ == "__main__":
    main()
