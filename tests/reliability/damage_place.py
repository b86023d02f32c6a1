"""Good files of every kind, and a folder in which they are damaged and baked."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from .command import QUICK, Outcome, run, run_python
from .sandbox import add_foreign

MAKE = """
import os, sys
import bpy
from pathlib import Path
from tests.reliability.sandbox import build_room
folder = Path(sys.argv[1])
build_room()
image = bpy.data.images.new("Picture", 16, 16)
image.pixels.foreach_set([0.1 + 0.8 * (i % 7) / 7 for i in range(4 * 256)])
for suffix, kind in (("png", "PNG"), ("jpg", "JPEG"), ("exr", "OPEN_EXR"), ("hdr", "HDR")):
    image.filepath_raw, image.file_format = str(folder / f"picture.{suffix}"), kind
    image.save()
image.source, image.filepath_raw = "FILE", "//picture.png"
tree = bpy.data.materials["White"].node_tree
texture = tree.nodes.new("ShaderNodeTexImage")
texture.image = image
shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 32
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "plain.blend"))
for suffix in ("jpg", "exr", "hdr"):
    image.filepath_raw = f"//picture.{suffix}"
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"with_{suffix}.blend"))
image.filepath_raw = "//picture.png"
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "with_png.blend"), compress=True)
bpy.ops.wm.obj_export(filepath=str(folder / "plain.obj"))
bpy.ops.export_scene.gltf(filepath=str(folder / "plain.glb"), export_format="GLB", export_lights=True)
apart = str(folder / "apart.gltf")
bpy.ops.export_scene.gltf(filepath=apart, export_format="GLTF_SEPARATE", export_lights=True)
os._exit(0)
"""


@dataclass(frozen=True)
class Place:
    """A folder for a process: pristine files, and a folder that is made anew for each trial."""

    root: Path

    @property
    def pristine(self) -> Path:
        return self.root / "pristine"

    @property
    def work(self) -> Path:
        return self.root / "work"

    @property
    def out(self) -> Path:
        return self.work / "out"

    def make(self) -> None:
        """Make the pristine files."""
        self.pristine.mkdir(parents=True)
        done = run_python(MAKE, self.pristine, cwd=self.root)
        assert done.code == 0, done.err[-2000:]

    def refresh(self, name: str | None) -> None:
        """Begin again: all files, the earlier result of a scene, and foreign files."""
        if name is not None and not (self.root / "results" / name).exists():
            self.refresh(None)
            done = self.bake(name, "--keep")
            assert done.code == 0, done.err
            shutil.copytree(self.out, self.root / "results" / name)
        shutil.rmtree(self.work, ignore_errors=True)
        shutil.copytree(self.pristine, self.work)
        if name is not None:
            shutil.copytree(self.root / "results" / name, self.out)
        for folder in (self.work, self.out, self.work / "tmp"):
            add_foreign(folder)

    def bake(self, name: str, *words: str) -> Outcome:
        # A preview takes most of the time, and many files have no camera: it is small where it can be.
        given = ("bake", self.work / name, "--output", self.out, *QUICK, "--quiet", *words)
        return run(*given, cwd=self.work, temporary=self.work / "tmp")

    def relight(self, name: str) -> Outcome:
        given = ("bake", self.work / name, "--output", self.out, "--quiet", "--relight")
        return run(*given, cwd=self.work, temporary=self.work / "tmp")
