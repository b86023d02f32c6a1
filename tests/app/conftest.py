"""Scene files for the command line to work on, and a way to call it."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

ROOT = Path(__file__).resolve().parents[2]
QUICK = ("--resolution", "32", "--quality", "sketch", "--no-preview")
"""A small bake. Previews are rendered where a test looks at one."""


@pytest.fixture(autouse=True)
def empty_blender() -> Iterator[None]:
    """Start from an empty file."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return


@dataclass(frozen=True)
class Outcome:
    """How a call of the command line ended."""

    code: int
    out: str
    err: str


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """The command line, called in this process: quick, and just what `python -m` calls."""
    from radiosity_addon.blender.command_line.main import main

    def call(*words: object) -> Outcome:
        capfd.readouterr()
        code = main([str(word) for word in words])
        captured = capfd.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call


def start(*words: object, cwd: Path) -> subprocess.Popen[str]:
    """Start `python -m radiosity_addon` in a process and a process group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "radiosity_addon", *map(str, words)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@dataclass(frozen=True)
class Baked:
    """A bake that tests of a module share: they copy what they change."""

    scene: Path
    """The room's .blend, saved and closed."""
    folder: Path
    """What `bake SCENE --output FOLDER` has written."""
    scene_before: tuple[str, int]
    """Digest and time of change of the scene's file before the bake."""
    copy_of_report: Path

    @property
    def scene_now(self) -> tuple[str, int]:
        """Digest and time of change of the scene's file as it is."""
        return stamp(self.scene)


def stamp(path: Path) -> tuple[str, int]:
    """Digest and time of change of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest(), path.stat().st_mtime_ns


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Baked:
    """The room, baked once with the default options."""
    from radiosity_addon.blender.command_line.main import main

    folder = tmp_path_factory.mktemp("baked")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    build_room()
    scene = save(folder / "scene" / "room.blend")
    made = Baked(scene, folder / "out", stamp(scene), folder / "copies" / "r.json")
    words = ["bake", scene, "--output", made.folder, *QUICK, "--report", made.copy_of_report]
    assert main([str(word) for word in words]) == 0
    return made


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A .blend with a floor, a red wall, a cube with a modifier, and a lamp."""
    build_room()
    return save(tmp_path / "scene" / "room.blend")


def build_room() -> None:
    """Fill the open file."""
    add_quad("Floor", ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)))
    wall = add_quad("Wall", ((-2, 2, 0), (2, 2, 0), (2, 2, 3), (-2, 2, 3)))
    wall.data.materials.append(painted("Red", (0.8, 0.1, 0.1, 1)))
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 0.5))
    cube = bpy.context.object
    cube.name = "Cube"
    cube.modifiers.new("Bevel", "BEVEL").width = 0.1
    add_lamp()


def add_quad(name: str, corners: tuple) -> bpy.types.Object:
    """Add one quadrilateral."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [tuple(range(len(corners)))])
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def add_lamp() -> None:
    """Add a point lamp of 100 W."""
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy = 100.0
    obj = bpy.data.objects.new("Lamp", lamp)
    obj.location = (0.5, -1, 2.5)
    bpy.context.scene.collection.objects.link(obj)


def painted(name: str, color: tuple) -> bpy.types.Material:
    """Make a Principled material of a base color."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = color
    return material


def save(path: Path) -> Path:
    """Save the open file and leave it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return path


def read_report(folder: Path) -> dict:
    """The report of a bake."""
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


def read_pixels(path: Path) -> np.ndarray:
    """The values of an image file as they are, (height, width, 3)."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[..., :3]


def digest(folder: Path) -> dict[str, str]:
    """What the files of a folder hold."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())}
