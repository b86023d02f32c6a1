"""Other lightmap copies, and marks, that are given to stand-ins: the originals have them afterwards."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import pytest

from tests.blender.edited_copies import GREEN, base_color, color_node
from tests.blender.hand_bake import BASE, add_plane, bake_by_hand, principled_material
from tests.blender.stand_in_ends import AFTER

pytestmark = pytest.mark.usefixtures("record")

Then = Callable[[], list[str]]


def shared() -> bpy.types.Object:
    """One of two objects that share a mesh."""
    obj = add_plane("First", principled_material())
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Second", obj.data))
    return obj


def modified() -> bpy.types.Object:
    obj = add_plane("Modified", principled_material())
    obj.modifiers.new("Solid", "SOLIDIFY").thickness = 0.5
    return obj


EITHER = pytest.mark.parametrize("make", [shared, modified])


@EITHER
@AFTER
def test_a_new_material_made_of_a_lightmap_s_copy_stays_assigned(
    make: Callable[[], bpy.types.Object], then: Then
) -> None:
    """As by the button that counts a material's users."""
    obj = make()
    bake_by_hand()
    new = obj.material_slots[0].material.copy()
    color_node(new).default_value = GREEN
    obj.material_slots[0].material = new
    then()
    (slot,) = obj.material_slots
    assert base_color(slot.material) == pytest.approx(GREEN)
    assert base_color(bpy.data.materials["Paint"]) == pytest.approx((*BASE, 1.0))


@EITHER
@AFTER
def test_the_lightmap_s_copy_of_another_material_stays_assigned(
    make: Callable[[], bpy.types.Object], then: Then
) -> None:
    """As it is offered in the list of materials."""
    obj = make()
    other = add_plane("Other", principled_material(name="Other"))
    bake_by_hand()
    obj.material_slots[0].material = other.material_slots[0].material
    then()
    assert [slot.material.name for slot in obj.material_slots] == ["Other"]
    assert [slot.material.name for slot in other.material_slots] == ["Other"]


@EITHER
@AFTER
def test_marks_of_a_stand_in_s_mesh_are_the_original_s(
    make: Callable[[], bpy.types.Object], then: Then
) -> None:
    """There is no other mesh afterwards that has them."""
    obj = make()
    original = obj.data
    bake_by_hand()
    obj.data.use_fake_user = True
    obj.data.asset_mark()
    then()
    assert obj.data == original
    assert original.use_fake_user
    assert original.asset_data is not None
    assert list(bpy.data.meshes) == [original]


@AFTER
def test_an_edit_of_a_shared_mesh_leaves_its_marks(then: Then) -> None:
    obj = shared()
    obj.data.asset_mark()
    obj.data.asset_data.description = "A floor"
    bake_by_hand()
    obj.data.vertices[0].co.z = 0.5
    then()
    assert obj.data.vertices[0].co.z == 0.5
    assert obj.data.asset_data.description == "A floor"
    assert list(bpy.data.meshes) == [obj.data]
