"""Baked objects show lightmaps on their own mesh or on a copy; what is around them stays as it was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError, SceneError
from radiosity_addon.blender.apply.apply import apply_lightmaps, check_targets
from radiosity_addon.blender.datablocks import bake_record
from radiosity_addon.blender.images.images import write_pages
from radiosity_addon.blender.images.node_group import GROUP_NAME
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.file_dump import differences, dump_file
from tests.blender.hand_bake import SMALL, add_plane, bake_by_hand, hand_result, principled_material
from tests.blender.zoo import build_zoo

pytestmark = pytest.mark.usefixtures("record")


def test_uv_layers_keep_names_order_and_roles() -> None:
    plane = add_plane()
    for name in ("A", "B"):
        plane.data.uv_layers.new(name=name)
    plane.data.uv_layers["B"].active_render = True
    plane.data.uv_layers.active = plane.data.uv_layers["A"]
    original = plane.data
    result = bake_by_hand()
    layers = plane.data.uv_layers
    assert [(layer.name, layer.active, layer.active_render) for layer in layers] == [
        ("A", True, False),
        ("B", False, True),
        ("Lightmap", False, False),
    ]
    assert plane.data == original
    (baked,) = result.objects
    uv = np.empty(8, np.float32)
    plane.data.attributes["Lightmap"].data.foreach_get("vector", uv)
    written = dict(zip(baked.object.loops.ravel().tolist(), baked.uv.reshape(-1, 2).tolist(), strict=True))
    assert uv.reshape(-1, 2).tolist() == [written[loop] for loop in range(4)]


def test_polygons_loops_and_slots_stay_without_generative_modifiers() -> None:
    build_zoo(bpy.context)
    cube = bpy.data.objects["Cube"]
    before = [(p.loop_start, p.loop_total, p.material_index, tuple(p.vertices)) for p in cube.data.polygons]
    bake_by_hand()
    after = [(p.loop_start, p.loop_total, p.material_index, tuple(p.vertices)) for p in cube.data.polygons]
    assert after == before
    assert len(cube.data.materials) == 3
    assert all(material.name.endswith("(Lightmap)") for material in cube.data.materials)


def test_linked_duplicates_and_shared_materials_do_not_get_each_other_s_lightmaps(tmp_path: Path) -> None:
    material = principled_material()
    first = add_plane("First", material)
    second = bpy.data.objects.new("Second", first.data)
    third = add_plane("Third", material)
    bpy.context.scene.collection.objects.link(second)
    result = bake_by_hand(colors=((1, 0, 0), (0, 1, 0)), folder=tmp_path)
    objects = [bpy.data.objects[baked.object.name] for baked in result.objects]
    assert len({obj.data for obj in (first, second, third)}) == 3

    def image(obj: bpy.types.Object) -> str:
        return next(
            n.image.name for n in obj.data.materials[0].node_tree.nodes if n.type == "TEX_IMAGE" and n.image
        )

    # Two pages dealt in turn: the first and last object share a page, hence a material.
    assert [image(obj) for obj in objects] == ["lightmap.exr", "lightmap_2.exr", "lightmap.exr"]
    shown = [obj.data.materials[0] for obj in objects]
    assert shown[0] == shown[2] != shown[1]
    assert sum(tree.name.startswith(GROUP_NAME) for tree in bpy.data.node_groups) == 1


def test_materials_linked_to_the_object_are_the_ones_copied() -> None:
    build_zoo(bpy.context)
    bake_by_hand()
    names = [slot.material.name for slot in bpy.data.objects["Duplicate"].material_slots]
    assert names[0] == "Of the Object (Lightmap)"
    links = [slot.link for slot in bpy.data.objects["Duplicate"].material_slots]
    assert links == ["OBJECT", "DATA", "DATA"]
    assert bpy.data.materials["Of the Object"].users


def test_stand_ins_stand_where_the_instances_were(tmp_path: Path) -> None:
    """World-space corners of all that is rendered, before and after, sheared instances included."""
    build_zoo(bpy.context)
    export = export_scene(bpy.context, BakeSettings(resolution=SMALL))
    before = export.bake_scene.scene
    bake_by_hand(folder=tmp_path)
    after = export_scene(bpy.context, BakeSettings(resolution=SMALL)).bake_scene.scene

    def soup(scene: object) -> np.ndarray:
        """Corners in an order that does not depend on the objects', winding kept."""
        corners = scene.triangles.round(3) + 0.0
        first = np.array([min(range(3), key=lambda i: tuple(t[i])) for t in corners])
        rolled = [np.roll(t, -i, axis=0).ravel() for t, i in zip(corners, first, strict=True)]
        return np.array(rolled)[np.lexsort(np.array(rolled).T)]

    np.testing.assert_allclose(soup(after), soup(before), atol=2e-3)
    stand_ins = bpy.data.collections["Radiosity Lightmaps"].objects
    assert len(stand_ins) > 10
    assert all(stand_in.data.users == 1 for stand_in in stand_ins)
    assert bpy.data.objects["Instancer 0"].hide_render


def test_an_instancer_s_other_instances_stay_visible() -> None:
    """Only one of its two objects is baked, yet hiding the instancer must not lose the other."""
    build_zoo(bpy.context)
    settings = BakeSettings(objects=("Instancer 0/Leaf",), resolution=SMALL)
    export = export_scene(bpy.context, settings)
    result = hand_result(export)
    apply_lightmaps(bpy.context, export, result, write_pages(result, settings, None), settings)
    names = {obj.name for obj in bpy.data.collections["Radiosity Lightmaps"].objects}
    assert names == {"Instancer 0/Leaf (Lightmap)", "Instancer 0/Branch (Lightmap)"}
    unbaked = bpy.data.objects["Instancer 0/Branch (Lightmap)"].data
    assert "Lightmap" not in unbaked.uv_layers
    assert [material.name for material in unbaked.materials] == ["Brick"]
    assert not bpy.data.objects["Instancer 1"].hide_render


def test_modifiers_that_made_the_mesh_are_off() -> None:
    build_zoo(bpy.context)
    bake_by_hand()
    modified = bpy.data.objects["Modified"]
    assert len(modified.data.polygons) > 6
    assert not any(modifier.show_viewport or modifier.show_render for modifier in modified.modifiers)


def test_a_ninth_layer_is_refused_before_anything_changes() -> None:
    settings = BakeSettings()
    full = add_plane("Full of UVs")
    for i in range(8):
        full.data.uv_layers.new(name=f"UV {i}")
    add_plane("Other")
    full.hide_render = True
    export_without = export_scene(bpy.context, settings)
    full.hide_render = False
    with pytest.raises(SceneError, match="Full of UVs"):
        export_scene(bpy.context, settings)

    # The layers may also have come since the export.
    full.data.uv_layers.remove(full.data.uv_layers[7])
    full.data.update()
    export = export_scene(bpy.context, settings)
    full.data.uv_layers.new(name="UV 7")
    result = hand_result(export)
    images = write_pages(result, settings, None)
    dump_file()
    before = dump_file()
    with pytest.raises(SceneError, match="Full of UVs"):
        check_targets(export)
    with pytest.raises(SceneError, match="Full of UVs"):
        apply_lightmaps(bpy.context, export, result, images, settings)
    assert differences(before, dump_file()) == []
    assert len(export_without.sources) == 1


def test_an_attribute_called_lightmap_is_refused() -> None:
    add_plane().data.attributes.new("Lightmap", "FLOAT", "POINT")
    with pytest.raises(SceneError, match=r"'Plane'.*'Lightmap'"):
        check_targets(export_scene(bpy.context, BakeSettings()))


def test_an_object_that_went_away_is_named_and_nothing_changes() -> None:
    add_plane("Stays")
    leaves = add_plane("Leaves")
    settings = BakeSettings()
    export = export_scene(bpy.context, settings)
    result = hand_result(export)
    bpy.data.objects.remove(leaves)
    images = write_pages(result, settings, None)
    dump_file()
    before = dump_file()
    with pytest.raises(BakeError, match="'Leaves'"):
        apply_lightmaps(bpy.context, export, result, images, settings)
    assert differences(before, dump_file()) == []


def test_a_mesh_that_changed_is_named() -> None:
    plane = add_plane()
    settings = BakeSettings()
    export = export_scene(bpy.context, settings)
    target = export.bake_scene.objects[0]
    result = hand_result(export)
    result = replace(result, objects=(replace(result.objects[0], object=target),))
    plane.data.clear_geometry()
    with pytest.raises(BakeError, match="'Plane' changed while"):
        apply_lightmaps(bpy.context, export, result, write_pages(result, settings, None), settings)


def test_a_second_bake_takes_the_place_of_the_first() -> None:
    plane = add_plane()
    bake_by_hand()
    (first,) = bpy.data.images
    bake_by_hand(colors=((1, 2, 3),))
    (second,) = bpy.data.images
    assert first != second or tuple(second.pixels[:3]) == (1, 2, 3)
    assert (second.name, len(plane.data.uv_layers), len(plane.data.materials)) == ("lightmap.exr", 1, 1)


def test_one_undo_step_takes_the_bake_back() -> None:
    plane = add_plane()
    bpy.ops.ed.undo_push(message="before")
    name = plane.data.name
    bake_by_hand()
    bpy.ops.ed.undo_push(message="bake")
    bpy.ops.ed.undo()
    assert bpy.data.objects["Plane"].data.name == name
    assert not bake_record.is_baked()
