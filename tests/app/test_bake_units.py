"""What Cycles evaluates at once for an export: joined objects give the colors that each gives alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.blender.command_line.main import main
from radiosity_addon.blender.exporting.bake_units import bake_units
from radiosity_addon.blender.exporting.evaluated_colors import evaluate_channel
from radiosity_addon.blender.exporting.export_scene import ExportScene, export_scene
from tests.browser.textured_room import build

from .conftest import QUICK

SIZES = [(128, 128)]


@pytest.fixture
def made(tmp_path: Path) -> Iterator[ExportScene]:
    """The temporary scene of a room of constants, images, cut-outs and procedural colors."""
    build(tmp_path / "room.blend")
    radiosity_addon.register()
    words = ["bake", str(tmp_path / "room.blend"), "--output", str(tmp_path / "out"), *QUICK, "--quiet"]
    assert main(words) == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / "baked.blend"))
    with closing(export_scene(bpy.context)) as scene:
        yield scene
    radiosity_addon.unregister()


# All channels are baked the same way.
@pytest.mark.parametrize(
    "channel", ["base", *(pytest.param(other, marks=pytest.mark.full) for other in ("emission", "alpha"))]
)
def test_joined_objects_are_evaluated_as_each_alone(made: ExportScene, channel: str) -> None:
    meshes = len(bpy.data.meshes)
    (alone,) = evaluate_channel(bpy.context, made, made.baked_copies, SIZES, channel)
    with bake_units(made) as units:
        assert len(units) < len(made.baked_copies) / 2
        (together,) = evaluate_channel(bpy.context, made, units, SIZES, channel)
    assert np.ptp(alone) > 0.5
    np.testing.assert_array_equal(together, alone)
    assert len(bpy.data.meshes) == meshes
