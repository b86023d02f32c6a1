"""Relight uses the settings of the bake, and names those that have changed since and need a new one."""

from __future__ import annotations

import bpy
import pytest

from radiosity_addon.blender.datablocks.bake_record import is_made
from tests.blender.scenes import add_lamp, add_mesh

pytestmark = pytest.mark.usefixtures("registered")


def test_options_that_need_a_new_bake_are_named(capfd: pytest.CaptureFixture[str]) -> None:
    """Memory and threads change no lightmap."""
    add_mesh("Floor")
    add_lamp("POINT", energy=100.0, transform={"location": (0, 0, 2)})
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality = 32, "sketch"

    def done(operator: str) -> str:
        capfd.readouterr()
        assert getattr(bpy.ops.radiosity, operator)("EXEC_DEFAULT") == {"FINISHED"}
        return capfd.readouterr().out

    done("bake")
    settings.memory_limit = 3.0
    assert "changed since" not in done("relight")
    settings.light_through_glass, settings.resolution = False, 64
    assert "'Resolution', 'Glass Lets Light Through' changed since: bake again" in done("relight")
    assert [tuple(image.size) for image in bpy.data.images if is_made(image)] == [(32, 32)]
    done("bake")
    assert "changed since" not in done("relight")
