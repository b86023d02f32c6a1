"""The pictures of docs/engines/browser.md: one bake as Cycles and as the viewer in Chromium show it.

    python -m docs.pictures.exports [FOLDER]

Needs bpy, Chromium and npm. FOLDER keeps the bake, which takes minutes.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import bpy

from radiosity_addon.blender.command_line.main import main
from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps
from tests.browser.browser import viewer
from tests.browser.textured_room import build

IMAGES = Path(__file__).parents[1] / "images"
WIDTH, HEIGHT = 640, 480


def pictures(folder: Path) -> None:
    """Bake if need be, and draw both."""
    out = folder / "out"
    if not (out / "export" / "viewer.html").is_file():
        build(folder / "room.blend")
        bpy.context.scene.view_settings.exposure = 1.0
        bpy.ops.wm.save_mainfile()
        bake = ["bake", str(folder / "room.blend"), "--output", str(out), "--resolution", "512"]
        if main([*bake, "--no-preview", "--export", "web"]):
            raise SystemExit("the bake failed")
    with viewer(out / "export" / "viewer.html", WIDTH, HEIGHT) as shown:
        (IMAGES / "export-viewer.png").write_bytes(shown.picture())
    bpy.ops.wm.open_mainfile(filepath=str(out / "baked.blend"))
    show_lightmaps("matte")
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 16
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
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
