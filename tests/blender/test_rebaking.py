"""Objects that move between two bakes in Blender: only what they touch is baked anew."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.blender.relight.relight_scene import kept_bakes
from tests.blender.scenes import add_lamp, add_mesh


@pytest.fixture(scope="module")
def lightmaps() -> Iterator[dict[str, np.ndarray]]:
    """Of a scene, of the same after its board moved, and of that baked as a whole."""
    radiosity_addon.register()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    add_mesh("Floor")
    add_mesh("Board", location=(-0.4, 0, 0.4), scale=(0.3, 0.3, 1))
    add_lamp("POINT", "Bulb", {"location": (0.0, 0.0, 1.2)}, energy=40.0, shadow_soft_size=0.1)
    scene = bpy.context.scene
    scene.radiosity.resolution, scene.radiosity.quality = 32, "sketch"
    yield dict(bakes(scene))
    radiosity_addon.unregister()


def bakes(scene: bpy.types.Scene) -> Iterator[tuple[str, np.ndarray]]:
    scene.radiosity_relight.only_moved = True
    yield "before", bake(scene)
    bpy.data.objects["Board"].location.x = 0.4
    yield "moved", bake(scene)
    scene.radiosity_relight.only_moved = False
    bpy.data.objects["Board"].location.x = 0.4
    yield "whole", bake(scene)


def bake(scene: bpy.types.Scene) -> np.ndarray:
    """Bake; return the (h, w, 3) pixels, and in a last row whether objects are said to have moved."""
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT") == {"FINISHED"}
    held = kept_bakes.find(scene)
    assert held is not None
    assert held.bake.moves is not None
    image = kept_bakes.images_of(kept_bakes.mark_of(scene))[0]
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    shown = pixels.reshape(*image.size, 4)[..., :3].astype(np.float64)
    told = np.full((1, *shown.shape[1:]), float("moved" in held.bake.moves.solved.report))
    return np.concatenate([shown, told])


def test_a_bake_after_a_move_is_of_what_moved(lightmaps: dict[str, np.ndarray]) -> None:
    told = {name: bool(pixels[-1, 0, 0]) for name, pixels in lightmaps.items()}
    assert told == {"before": False, "moved": True, "whole": False}


def test_it_shows_what_a_whole_bake_shows(lightmaps: dict[str, np.ndarray]) -> None:
    before, moved, whole = (lightmaps[name][:-1] for name in ("before", "moved", "whole"))
    scale = whole.mean()
    assert np.sqrt(((moved - whole) ** 2).mean()) < 0.01 * scale
    assert np.sqrt(((before - whole) ** 2).mean()) > 0.1 * scale
