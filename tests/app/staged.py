"""A small scene in a file, baked at once and in stages."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy

from radiosity_addon.bake.sidecar.sidecar import FORMAT, MAGIC
from radiosity_addon.blender.command_line.main import main
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.files.files import empty_scene
from radiosity_addon.farm import run_command
from radiosity_addon.numerics import read_arrays

SMALL = ["--resolution", "64", "--quality", "sketch", "--no-preview", "--threads", "1"]
SHARED = ["--resolution", "256", "--quality", "sketch", "--no-preview", "--threads", "1"]
"""Of these, some kernels are shared."""

Words = list[str]


def box_file(folder: Path) -> Path:
    """Save the Cornell box with a lamp of its own next to its window of light."""
    empty_scene()
    build_cornell_box()
    lamp = bpy.data.objects.new("Bulb", bpy.data.lights.new("Bulb", "POINT"))
    lamp.location, lamp.data.energy = (1.0, 1.2, 1.0), 20.0
    bpy.context.scene.collection.objects.link(lamp)
    return save(folder / "box.blend")


def save(path: Path) -> Path:
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def edit(path: Path, change: Callable[[], None]) -> None:
    """Open a file, change something, and save it."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    change()
    save(path)


def bake(scene: Path, output: Path, options: Words) -> int:
    return main(["bake", str(scene), "--output", str(output), "--quiet", *options])


def prepare(scene: Path, spool: Path, options: Words) -> int:
    return main(["prepare", str(scene), "--spool", str(spool), "--quiet", *options])


def run(spool: Path, *options: str) -> int:
    return run_command(["run", str(spool), "--quiet", *options])


def finish(scene: Path, spool: Path, output: Path, *options: str) -> int:
    return main(["finish", str(scene), "--spool", str(spool), "--output", str(output), "--quiet", *options])


def in_stages(scene: Path, spool: Path, output: Path, options: Words) -> None:
    assert prepare(scene, spool, options) == 0
    assert run(spool) == 0
    assert finish(scene, spool, output) == 0


def lightmaps(folder: Path) -> dict[str, bytes]:
    """Return the images that a bake has written, by name."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in (".exr", ".png")}


def sidecar(folder: Path) -> tuple[str, list[bytes]]:
    """Return what a sidecar holds, except for the bake's own name, which is another each time."""
    description, arrays = read_arrays(folder / "lightmap.relight", MAGIC, FORMAT)
    mark = report(folder)["kept"]["bake"]
    text = json.dumps(description)
    assert text.count(mark) == 1
    kinds = [f"{array.dtype.str} {array.shape} ".encode() for array in arrays]
    return text.replace(mark, ""), [kind + array.tobytes() for kind, array in zip(kinds, arrays, strict=True)]


def report(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "report.json").read_text())


def told(folder: Path) -> dict[str, Any]:
    """Return what a report says of the bake, without times, and what depends on the folder."""
    found = report(folder)
    found["solver"].pop("history")
    kept = ("objects", "pages", "light_groups", "solver", "warnings", "notes", "version")
    return {name: found[name] for name in kept if name in found}
