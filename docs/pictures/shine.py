"""Makes docs/images/shine.png: a room path-traced, baked with its shine, and baked matte.

    python -m docs.pictures.shine

Asserts that the shine brings the baked room nearer to the path-traced one.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy
import numpy as np
from PIL import Image

import radiosity_addon
from radiosity_addon.blender.datablocks.png import render_png
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.test_shine_in_a_room import build

ROOT = Path(__file__).resolve().parents[2]

SIDE, BORDER = 340, 8
SAMPLES = 256


def seen(scene: bpy.types.Scene, folder: Path) -> np.ndarray:
    """Render the scene: its inner (h, w, 3) uint8."""
    path = folder / "seen.png"
    render_png(scene, path, samples=SAMPLES)
    return np.asarray(Image.open(path).convert("RGB"))[BORDER:-BORDER, BORDER:-BORDER]


def main() -> None:
    """Render, bake, and write the pictures side by side."""
    radiosity_addon.register()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = build_cornell_box()
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    build()
    with tempfile.TemporaryDirectory() as name:
        pictures = [seen(scene, Path(name))]
        list(run_bake(bpy.context, BakeSettings(resolution=512), None))
        for look in ("shine", "matte"):
            scene.radiosity.show = look
            pictures.append(seen(scene, Path(name)))
    traced, shine, matte = (picture.astype(float) for picture in pictures)
    assert np.abs(shine - traced).mean() < 0.5 * np.abs(matte - traced).mean()
    gap = np.full((len(pictures[0]), 6, 3), 255, dtype=np.uint8)
    row = [part for picture in pictures for part in (picture, gap)][:-1]
    Image.fromarray(np.concatenate(row, axis=1)).save(ROOT / "docs" / "images" / "shine.png", optimize=True)


if __name__ == "__main__":
    main()
