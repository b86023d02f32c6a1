"""A baked room of default materials, with metal and coat, looks as the path-traced one does."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.files.cornell import REFLECTANCE, build_cornell_box
from tests.blender.hand_bake import principled_material

SIZE = 64


ALLOWED = {
    "Left Wall": 0.015,
    "Right Wall": 0.015,
    "Tall Block": 0.025,
    "Short Block": 0.03,
    "Ceiling": 0.03,
    "Back Wall": 0.035,
    "Ball": 0.05,
    "Floor": 0.065,
}
"""How far the mean of each is off in any channel, at most."""


def build() -> None:
    """The Cornell box of Principled materials, a coated block, and a ball of metal on the other one."""
    for name, color in REFLECTANCE.items():
        paint = principled_material(name=f"{name} Paint", Base_Color=(*color, 1.0))
        bpy.data.materials[f"Cornell {name}"].user_remap(paint)
    coated = principled_material(name="Coated", Base_Color=(0.6, 0.5, 0.4, 1.0), Coat_Weight=1.0)
    bpy.data.objects["Tall Block"].data.materials[0] = coated
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.35, location=(0.8, 1.7, 2.0), segments=48, ring_count=24)
    ball = bpy.context.object
    ball.name = "Ball"
    bpy.ops.object.shade_smooth()
    metal = principled_material(name="Metal", Base_Color=(0.9, 0.7, 0.4, 1.0), Metallic=1.0, Roughness=0.3)
    ball.data.materials.append(metal)


def rendered(scene: bpy.types.Scene, path: Path, samples: int) -> np.ndarray:
    """The camera's picture (SIZE, SIZE, 3), bottom row first."""
    scene.render.engine = "CYCLES"
    cycles, settings = scene.cycles, scene.render.image_settings
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = samples, False, False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 32
    cycles.sample_clamp_indirect, cycles.blur_glossy = 0.0, 0.0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path), check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    return np.array(image.pixels[:]).reshape(SIZE, SIZE, -1)[..., :3]


def seen_objects(scene: bpy.types.Scene) -> np.ndarray:
    """The name of the object in each pixel (SIZE, SIZE); "" at edges."""
    camera = scene.camera
    corners = [camera.matrix_world @ corner for corner in camera.data.view_frame(scene=scene)]
    _, bottom_right, bottom_left, top_left = corners
    names = np.full((SIZE, SIZE), "", dtype=object)
    layer = bpy.context.evaluated_depsgraph_get()
    for row in range(SIZE):
        for column in range(SIZE):
            found = set()
            for dx in (-0.5, 0.5, 1.5):
                for dy in (-0.5, 0.5, 1.5):
                    u, v = (column + dx) / SIZE, (row + dy) / SIZE
                    point = bottom_left + u * (bottom_right - bottom_left) + v * (top_left - bottom_left)
                    start = camera.matrix_world.translation
                    hit, *_, obj, _ = scene.ray_cast(layer, start, (point - start).normalized())
                    found.add(obj.name if hit else "")
            if len(found) == 1:
                names[row, column] = found.pop()
    return names


@pytest.mark.one_blender
@pytest.mark.usefixtures("registered")
def test_a_baked_room_with_its_shine_looks_as_the_path_traced_one(tmp_path: Path) -> None:
    """The walls nearly so; the rest as far as gloss that is baked as diffuse lights it rightly.

    Matte walls lack what they reflect of the lamp's color.
    """
    scene = build_cornell_box()
    build()
    names = seen_objects(scene)
    traced = rendered(scene, tmp_path / "traced.exr", 512)
    scene.radiosity.resolution, scene.radiosity.quality = 256, "medium"
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT") == {"FINISHED"}
    shown = {}
    for look in ("shine", "matte"):
        scene.radiosity.show = look
        shown[look] = rendered(scene, tmp_path / f"{look}.exr", 256)

    def off(look: str, name: str) -> float:
        there = names == name
        return float(np.abs(shown[look][there].mean(axis=0) / traced[there].mean(axis=0) - 1.0).max())

    for name, allowed in ALLOWED.items():
        assert off("shine", name) < allowed, name
    assert off("matte", "Left Wall") > 0.5
    assert off("matte", "Right Wall") > 0.5
