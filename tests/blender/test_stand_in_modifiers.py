"""Modifiers that are off while a stand-in shows what they make: none is lost, nor is what they made."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import pytest

from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material
from tests.blender.stand_in_ends import AFTER

pytestmark = pytest.mark.usefixtures("record")

Then = Callable[[], list[str]]


def solid() -> bpy.types.Object:
    obj = add_plane("Solid", principled_material())
    obj.modifiers.new("Thick", "SOLIDIFY").thickness = 0.5
    return obj


def given_own_mesh(obj: bpy.types.Object) -> None:
    obj.data = bpy.data.meshes.new("Mine")


def given_mesh_of_stand_in(obj: bpy.types.Object) -> None:
    obj.data = bpy.data.objects["First"].data


@AFTER
@pytest.mark.parametrize("give", [given_own_mesh, given_mesh_of_stand_in])
def test_they_show_again_where_the_object_was_given_another_mesh(
    give: Callable[[bpy.types.Object], None], then: Then
) -> None:
    obj, first = solid(), add_plane("First")
    obj.modifiers.new("Off", "WELD").show_viewport = False
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Second", first.data))
    bake_by_hand()
    give(obj)
    then()
    flags = [(each.name, each.show_viewport, each.show_render) for each in obj.modifiers]
    assert flags == [("Thick", True, True), ("Off", False, True)]


@AFTER
def test_what_they_made_is_kept_where_the_object_was_converted(then: Then) -> None:
    obj = solid()
    bake_by_hand()
    shown = len(obj.data.polygons)
    with bpy.context.temp_override(object=obj, active_object=obj, selected_objects=[obj]):
        obj.select_set(True)
        bpy.context.view_layer.objects.active = obj
        bpy.ops.object.convert(target="MESH")
    assert len(obj.modifiers) == 0
    assert then() == ["Solid"]
    kept = [mesh for mesh in bpy.data.meshes if len(mesh.polygons) == shown]
    assert [mesh.use_fake_user for mesh in kept] == [True]
    assert "Lightmap" not in kept[0].uv_layers


@AFTER
def test_applying_them_to_what_they_made_is_answered(then: Then) -> None:
    obj = solid()
    obj.data["note"] = "mine"
    bake_by_hand()
    with bpy.context.temp_override(object=obj, active_object=obj, selected_objects=[obj]):
        bpy.ops.object.modifier_apply(modifier="Thick")
    assert then() == ["Solid"]
    assert dict(obj.data.items()) == {"note": "mine"}
