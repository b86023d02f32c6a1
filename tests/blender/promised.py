"""Shared by the tests of docs/promises.md: a room, the operators, the command line, and what objects show."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.command_line.main import main
from tests.reliability.folders import reports
from tests.reliability.sandbox import build_room

QUICK = ("--resolution", "16", "--quality", "sketch", "--min-area", "0.5")
QUAD = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))

Run = Callable[..., tuple[int, str]]


def command_line(capfd: pytest.CaptureFixture[str]) -> Run:
    """Return the command line in this process: it returns its code and its error messages."""

    def call(*words: object) -> tuple[int, str]:
        capfd.readouterr()
        code = main([str(word) for word in words])
        told = capfd.readouterr().err
        assert "Traceback" not in told
        return code, told

    return call


def saved_room(folder: Path) -> Path:
    """Save a room that is set to bake quickly, and leave it open; returns the folder it is in."""
    build_room()
    set_quick(bpy.context.scene)
    return save(folder / "room" / "room.blend").parent


def set_quick(scene: bpy.types.Scene) -> None:
    """Have a scene baked in a moment."""
    settings = scene.radiosity
    settings.resolution, settings.quality, settings.min_area = 16, "sketch", 0.5


def show_picture(material: str, picture: bpy.types.Image) -> None:
    """Feed a material's base color with a picture."""
    tree = bpy.data.materials[material].node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = picture
    tree.links.new(texture.outputs[0], shader_of(bpy.data.materials[material]).inputs["Base Color"])


def save(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def refuse_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have no bake begin its work from now on."""

    def worked(*_arguments: object) -> None:
        raise AssertionError("the bake was not stopped before the work")

    monkeypatch.setattr("radiosity_addon.blender.jobs.job.run_pipeline", worked)


def bake() -> None:
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}


def refused(operator: Callable[..., set[str]]) -> str:
    """Run an operator that is to refuse; returns the line in which it does."""
    with pytest.raises(RuntimeError) as caught:
        operator("EXEC_DEFAULT", True)
    message = str(caught.value).strip().removeprefix("Error: ")
    assert len(message.splitlines()) == 1, message
    return message


def restore() -> None:
    assert bpy.ops.radiosity.restore("EXEC_DEFAULT", True) == {"FINISHED"}


def report_in(folder: Path) -> tuple[Path, dict[str, Any]]:
    """The one report in a folder."""
    ((path, told),) = reports(folder).items()
    return path, told


def light_on(report: dict[str, Any], name: str) -> float:
    """The mean irradiance that a report tells of an object."""
    return next(entry["irradiance_W_m2"]["mean"] for entry in report["objects"] if entry["object"] == name)


def pixels_of(image: bpy.types.Image) -> np.ndarray:
    pixels = np.empty(image.size[0] * image.size[1] * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels


def uv_of(obj: bpy.types.Object) -> np.ndarray:
    layer = obj.data.uv_layers["Lightmap"]
    uv = np.empty(2 * len(obj.data.loops), dtype=np.float32)
    layer.data.foreach_get("uv", uv)
    return uv


def shader_of(material: bpy.types.Material) -> bpy.types.Node:
    return next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
