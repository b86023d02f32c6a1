"""The pictures of docs/engines/browser.md: one bake as Cycles and as the viewer in Chromium show it.

    python -m docs.pictures.exports [FOLDER]

Needs bpy, Chromium and npm. FOLDER keeps the bake, which takes minutes.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

from radiosity_addon.blender.command_line.main import main
from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps
from radiosity_addon.exports import read_ktx2
from tests.browser.browser import viewer
from tests.browser.textured_room import build

IMAGES = Path(__file__).parents[1] / "images"
WIDTH, HEIGHT = 640, 480
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def pictures(folder: Path) -> None:
    """Bake if need be, and draw both."""
    out = folder / "out"
    if not (out / "export" / "viewer.html").is_file():
        build(folder / "room.blend")
        bake = ["bake", str(folder / "room.blend"), "--output", str(out), "--resolution", "512"]
        if main([*bake, "--no-preview", "--export", "web"]):
            raise SystemExit("the bake failed")
    with viewer(out / "export" / "viewer.html", WIDTH, HEIGHT) as shown:
        (IMAGES / "export-viewer.png").write_bytes(shown.picture())
    light = read_ktx2((out / "export" / "lightmap.ktx2").read_bytes()) @ LUMINANCE
    step = light.shape[0] // 64
    sampled = light[step // 2 :: step, step // 2 :: step]
    exposure = 0.3 / np.exp(np.log(sampled[sampled > 0]).mean())  # as viewer.js has it
    bpy.ops.wm.open_mainfile(filepath=str(out / "baked.blend"))
    show_lightmaps("matte")
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 16
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.view_settings.view_transform = "Khronos PBR Neutral"
    scene.view_settings.exposure = float(np.log2(exposure))
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(IMAGES / "export-cycles.png")
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
        pictures(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            pictures(Path(temporary))
