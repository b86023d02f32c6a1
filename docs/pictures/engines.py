"""The pictures of docs/engines: exports for engines that cannot be run here, as the web viewer draws them.

    python -m docs.pictures.engines [FOLDER]

Needs bpy, Chromium and npm. FOLDER keeps the bakes.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import bpy

from radiosity_addon.blender.command_line.main import main
from tests.app.conftest import painted
from tests.browser.browser import viewer
from tests.browser.textured_room import build
from tests.trees import build_trees

IMAGES = Path(__file__).parents[1] / "images"
SIZE = 640, 400


def trees(path: Path) -> None:
    """Save a ground with a hundred trees that are one mesh."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    build_trees(100)
    _aim((0.0, -26.0, 15.0), (0.0, -2.0, 0.0), 40)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def levels(path: Path) -> None:
    """Save a head in three levels of detail, side by side in an open box with a lamp."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    for place, turn, color, name in (
        ((0, 0, 0), (0, 0, 0), (0.7, 0.7, 0.7), "Floor"),
        ((0, 3, 3), (math.pi / 2, 0, 0), (0.7, 0.6, 0.4), "Wall"),
    ):
        bpy.ops.mesh.primitive_plane_add(size=12, location=place, rotation=turn)
        bpy.context.object.name = name
        bpy.context.object.data.materials.append(painted(name, (*color, 1.0)))
    clay = painted("Clay", (0.8, 0.45, 0.3, 1.0))
    bpy.ops.mesh.primitive_monkey_add(size=2, location=(-2.6, 0, 1.0), rotation=(-0.6, 0, 0))
    finest = bpy.context.object
    for number, ratio in enumerate((1.0, 0.35, 0.12)):
        obj = finest if number == 0 else finest.copy()
        if number:
            obj.data = finest.data.copy()
            bpy.context.scene.collection.objects.link(obj)
            obj.location.x += 2.6 * number
            obj.modifiers.new("Decimate", "DECIMATE").ratio = ratio
        obj.name = f"Head_LOD{number}"
        if not obj.data.materials:
            obj.data.materials.append(clay)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.data.energy, lamp.data.size = 300.0, 1.5
    lamp.location, lamp.rotation_euler = (-4.0, -3.0, 5.0), (0.6, -0.5, 0.0)
    bpy.context.scene.collection.objects.link(lamp)
    _aim((0.0, -9.0, 2.6), (0.0, 0.0, 0.9), 40)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def _aim(place: tuple[float, ...], target: tuple[float, ...], lens: float) -> None:
    """Have the scene's camera look from a place at a target."""
    scene = bpy.context.scene
    camera = scene.camera
    if camera is None:
        camera = scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(camera)
    camera.location, camera.data.lens = place, lens
    along = [each - other for each, other in zip(target, place, strict=True)]
    camera.rotation_euler = (
        math.atan2(math.hypot(*along[:2]), -along[2]),
        0.0,
        math.atan2(-along[0], along[1]),
    )
    scene.render.resolution_x, scene.render.resolution_y = SIZE


PICTURES: dict[str, tuple[Callable[[Path], None], str, tuple[str, ...], str]] = {
    "export-godot": (build, "godot", (), "document.getElementById('only').click()"),
    "export-unity": (levels, "unity", (), ""),
    "export-bevy": (trees, "bevy", ("--pack", "rectangles"), ""),
}
"""By name: what builds the scene, the engine, options of the bake, and what is done in the viewer."""


def picture(name: str, folder: Path) -> None:
    """Bake if need be, and draw."""
    scene, engine, options, done = PICTURES[name]
    out, file = folder / name, folder / f"{name}.blend"
    if not (out / "export" / "viewer.html").is_file():
        scene(file)
        words = ["bake", str(file), "--output", str(out), "--resolution", "1024", *options]
        if main([*words, "--no-preview", "--export", f"web,{engine}"]):
            raise SystemExit("the bake failed")
    with viewer(out / "export" / "viewer.html", *SIZE) as shown:
        if done:
            shown.evaluated(done)
        (IMAGES / f"{name}.png").write_bytes(shown.picture())


def pictures(folder: Path) -> None:
    """Make all of them."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in PICTURES:
        picture(name, folder)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        pictures(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            pictures(Path(temporary))
