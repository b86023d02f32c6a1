"""Baking again: the new bake sees the originals, and only success removes the earlier one."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from radiosity_addon.bake.result.result import BakedObject, BakeResult
from radiosity_addon.blender.apply.apply import apply_lightmaps
from radiosity_addon.blender.apply.rebake import originals_shown, replacing_earlier
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks.bake_record import recorded_objects
from radiosity_addon.blender.images.images import write_pages
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene

SETTINGS = BakeSettings(resolution=4)


@pytest.fixture(autouse=True)
def scene(registered: None) -> None:
    """A plain cube, one with a modifier, one with a material of its own, and an instanced one."""
    cubes = []
    for index, name in enumerate(("Plain", "Bevelled", "Own Material", "Instanced")):
        bpy.ops.mesh.primitive_cube_add(location=(3 * index, 0, 0))
        cubes.append(bpy.context.object)
        cubes[-1].name = name
        cubes[-1].data.materials.append(bpy.data.materials.new(f"{name} Paint"))
    cubes[1].modifiers.new("Bevel", "BEVEL")
    cubes[2].material_slots[0].link = "OBJECT"
    cubes[2].material_slots[0].material = bpy.data.materials.new("Object Paint")

    collection = bpy.data.collections.new("Instanced Cubes")
    bpy.context.scene.collection.objects.unlink(cubes[3])
    collection.objects.link(cubes[3])
    empty = bpy.data.objects.new("Instancer", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()


def result_of(scene: BakeScene, value: float) -> BakeResult:
    """A bake that found the same light everywhere."""
    pixels = np.full((4, 4, 3), value, dtype=np.float32)
    page = LightmapPage(pixels=pixels, coverage=np.ones((4, 4), dtype=bool))
    corners = np.array([[0, 0], [1, 0], [1, 1]], dtype=np.float32)
    baked = [BakedObject(obj, np.tile(corners, (obj.count, 1, 1)), 0) for obj in scene.objects if obj.bake]
    return BakeResult(pages=(page,), objects=tuple(baked), solver={}, warnings=())


def bake(value: float, then: type[BaseException] | None = None) -> BakeScene:
    """Bake the scene, and fail after the lightmaps are on the objects if told to."""
    context = bpy.context
    with originals_shown(context):
        export = export_scene(context, SETTINGS)
    result = result_of(export.bake_scene, value)
    with replacing_earlier(context) as earlier:
        images = write_pages(result, SETTINGS, None)
        apply_lightmaps(context, export, result, images, SETTINGS, earlier=earlier)
        if then is not None:
            raise then
    return export.bake_scene


def snapshot() -> dict[str, Any]:
    """All that a bake could have changed."""
    kinds = ("objects", "meshes", "materials", "images", "node_groups", "collections")
    return {
        "datablocks": sorted(
            (kind, block.name, block.users) for kind in kinds for block in getattr(bpy.data, kind)
        ),
        "objects": {
            obj.name: (
                obj.data and obj.data.name,
                [(slot.link, slot.material and slot.material.name) for slot in obj.material_slots],
                [(m.name, m.show_viewport, m.show_render) for m in obj.modifiers],
                (obj.hide_viewport, obj.hide_render),
                obj.active_material_index,
            )
            for obj in bpy.data.objects
        },
        "pixels": {image.name: list(image.pixels)[:4] for image in bpy.data.images},
    }


def test_baking_again_replaces_the_lightmaps_and_nothing_else() -> None:
    first = bake(0.25)
    before = snapshot()
    second = bake(0.75)
    after = snapshot()
    np.testing.assert_array_equal(second.scene.triangles, first.scene.triangles)
    assert [obj.name for obj in second.objects] == [obj.name for obj in first.objects]
    assert {**after, "pixels": None} == {**before, "pixels": None}
    assert before["pixels"] == {"lightmap.exr": [0.25, 0.25, 0.25, 1.0]}
    assert after["pixels"] == {"lightmap.exr": [0.75, 0.75, 0.75, 1.0]}


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, GeneratorExit])
def test_a_bake_that_fails_leaves_the_earlier_one(error: type[BaseException]) -> None:
    bake(0.25)
    before = snapshot()
    with pytest.raises(error):
        bake(0.75, then=error)
    assert snapshot() == before


def test_the_originals_show_for_a_moment_only() -> None:
    bare = snapshot()
    bake(0.25)
    before = snapshot()
    with originals_shown(bpy.context):
        assert recorded_objects() == []
        shown = snapshot()["objects"]
        assert {name: shown[name] for name in bare["objects"]} == bare["objects"]
    assert snapshot() == before


def test_restore_after_baking_twice_brings_the_originals_back() -> None:
    bare = snapshot()
    bake(0.25)
    bake(0.75)
    restore(bpy.context)
    assert snapshot() == bare
