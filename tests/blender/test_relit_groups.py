"""A kept bake with light groups, lit anew: all groups' images follow, and still sum to the lightmap."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.images.images import image_scale
from radiosity_addon.blender.relight.relight_scene import kept_bakes
from radiosity_addon.blender.session.state import session
from tests.blender.test_relight_scene import lightmap, relight, room


@pytest.fixture(params=["exr", "png16"])
def names(registered: None, request: pytest.FixtureRequest, tmp_path: Path) -> dict[str, str]:
    """The room baked by groups, kept, with a sidecar: its images' names by group."""
    room()
    bpy.data.objects["Bulb"].radiosity_light_group = "Lamps"
    bpy.data.objects["Panel"].radiosity_light_group = "Glow"
    settings = bpy.context.scene.radiosity
    settings.use_light_groups, settings.resolution, settings.format = True, 16, request.param
    bpy.context.scene.radiosity_relight.sidecar = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT") == {"FINISHED"}
    mark = kept_bakes.mark_of(bpy.context.scene)
    groups = kept_bakes.group_images_of(mark)
    return {"": kept_bakes.images_of(mark)[0].name, **{name: of[0].name for name, of in groups.items()}}


def light(names: dict[str, str]) -> dict[str, np.ndarray]:
    """What each image holds, as a quantity."""
    return {group: lightmap(name) * image_scale(bpy.data.images[name]) for group, name in names.items()}


@pytest.mark.parametrize("kept", ["in memory", "in the sidecar"])
def test_groups_are_relit_too(names: dict[str, str], kept: str) -> None:
    assert list(names) == ["", "Glow", "Lamps", "others"]
    if kept != "in memory":
        session.kept_bakes.clear()
    before = light(names)
    bpy.data.objects["Bulb"].data.energy *= 3.0
    bpy.data.materials["Glow"].node_tree.nodes["Emission"].inputs["Strength"].default_value = 0.0
    assert relight() == {"FINISHED"}
    after = light(names)
    step = max(image_scale(bpy.data.images[name]) for name in names.values()) / 65535
    total = after["Lamps"] + after["Glow"] + after["others"]
    np.testing.assert_allclose(total, after[""], rtol=1e-4, atol=3 * step + 1e-5)
    np.testing.assert_allclose(after["Lamps"], 3.0 * before["Lamps"], rtol=5e-3, atol=3 * step + 1e-3)
    np.testing.assert_allclose(after["others"], before["others"], rtol=5e-3, atol=3 * step + 1e-3)
    assert not after["Glow"].any()
    assert not any(bpy.data.images[name].is_dirty for name in names.values())


def test_live_leaves_groups_to_their_own_sliders(names: dict[str, str]) -> None:
    bpy.context.window_manager.radiosity_live = True
    session.live.settle()
    assert not bpy.context.window_manager.radiosity_live
    assert "light groups" in session.live_message
