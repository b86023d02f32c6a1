"""A folder to do harm in: a scene, an earlier result, and files that are nobody's business."""

from __future__ import annotations

import shutil
import zlib
from dataclasses import dataclass
from pathlib import Path

from . import folders
from .command import QUICK, Outcome, run, run_python

BUILD = """
import os, sys
import bpy
from tests.reliability.sandbox import build_room
build_room()
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1], compress=True)
sys.stdout.flush()
os._exit(0)
"""

FOREIGN = ("notes.txt", "photo.png", "Floor.exr", "deep/er/thesis.doc", ".hidden", "blender_mine/keep.txt")
"""Files of somebody else's, in the output folder and in the folder for temporary files."""


@dataclass(frozen=True)
class Sandbox:
    """A scene, an output folder, a folder for temporary files, and foreign files in all of them."""

    root: Path

    @property
    def scene(self) -> Path:
        return self.root / "scene" / "room.blend"

    @property
    def out(self) -> Path:
        return self.root / "out"

    @property
    def temporary(self) -> Path:
        return self.root / "tmp"

    def make(self) -> None:
        """Make it, with a scene but no result yet."""
        shutil.rmtree(self.root, ignore_errors=True)
        for folder in (self.scene.parent, self.out, self.temporary, self.root / "elsewhere"):
            add_foreign(folder)
        done = run_python(BUILD, self.scene, cwd=self.root)
        assert done.code == 0, done.err[-2000:]

    def bake(self, *words: object, **given: object) -> Outcome:
        """Bake the scene with the command line into the output folder."""
        words = ("bake", self.scene, "--output", self.out, *QUICK, "--quiet", *words)
        return run(*words, cwd=self.root, temporary=self.temporary, **given)  # type: ignore[arg-type]

    def result(self) -> dict[str, str]:
        """Return what the output folder holds, without what foreign files it has and what is hidden."""
        found = folders.tree(self.out)
        return {name: of for name, of in found.items() if not name.startswith((".", "deep", "blender_mine"))}

    def foreign(self) -> dict[str, str]:
        """Return all that no bake into the output folder may touch."""
        outside = folders.tree(self.root, self.out, self.temporary)
        for folder in (self.out, self.temporary):
            for name in FOREIGN:
                path = folder / name
                outside[str(path)] = path.read_text() if path.is_file() else "gone"
        return outside


def add_foreign(folder: Path) -> None:
    """Put files that bakes have nothing to do with into a folder."""
    for name in FOREIGN:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(f"mine: {zlib.crc32(name.encode())}")


def build_room() -> None:
    """Fill the open file: a floor, a wall, a cube with a modifier, twins, a lamp, a glowing panel."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 32
    quad = ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0))
    things = {
        "Floor": (quad, (0, 0, 0), paint("White", (0.7, 0.7, 0.7))),
        "Wall": (((-2, 2, 0), (2, 2, 0), (2, 2, 2), (-2, 2, 2)), (0, 0, 0), paint("Red", (0.8, 0.2, 0.1))),
        "Panel": (
            tuple((0.2 * x, -0.2 * y, z) for x, y, z in quad),
            (1, -1, 1.8),
            paint("Glow", (1, 1, 1), 5.0),
        ),
    }
    for name, (corners, place, material) in things.items():
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
        mesh.materials.append(material)
        add(name, mesh, place)
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=(0, 0, 0.3))
    bpy.context.object.name = bpy.context.object.data.name = "Cube"
    bpy.context.object.modifiers.new("Mirror", "MIRROR").use_axis = (True, False, False)
    twin = bpy.data.meshes.new("Twin")
    twin.from_pydata(quad, [], [(0, 1, 2, 3)])
    for name, x in (("Twin A", -1.0), ("Twin B", 1.0)):
        add(name, twin, (x, 1, 0.5)).scale = (0.2, 0.2, 0.2)
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy = 100.0
    add("Lamp", lamp, (-0.5, -0.5, 1.6))


def add(name: str, data: object, place: tuple[float, float, float]) -> object:
    """Put an object into the open scene."""
    import bpy

    obj = bpy.data.objects.new(name, data)
    obj.location = place
    bpy.context.scene.collection.objects.link(obj)
    return obj


def paint(name: str, color: tuple[float, float, float], emission: float = 0.0) -> object:
    """Make a Principled material."""
    import bpy

    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        made.use_nodes = True
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*color, 1)
    if emission:
        shader.inputs["Emission Color"].default_value = (*color, 1)
        shader.inputs["Emission Strength"].default_value = emission
    return made
