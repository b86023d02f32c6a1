"""Stand-ins that the user copies, applies modifiers on, adds slots to, or moves and deletes."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import pytest

from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material
from tests.blender.stand_in_ends import AFTER

pytestmark = pytest.mark.usefixtures("record")


def _link(obj: bpy.types.Object) -> bpy.types.Object:
    bpy.context.scene.collection.objects.link(obj)
    return obj


def _subdivided() -> bpy.types.Object:
    obj = add_plane("Ball", principled_material())
    obj.modifiers.new("Subdivision", "SUBSURF")
    return obj


def _text() -> bpy.types.Object:
    obj = _link(bpy.data.objects.new("Text", bpy.data.curves.new("Text", "FONT")))
    obj.data.body, obj.data.extrude, obj.location = "A", 0.1, (1, 2, 3)
    obj.data.materials.append(principled_material())
    bpy.context.view_layer.update()
    return obj


@AFTER
@pytest.mark.parametrize("edited", [False, True])
def test_an_unlinked_copy_of_a_shared_mesh_keeps_a_mesh_of_its_own(
    then: Callable[[], list[str]], edited: bool
) -> None:
    first = add_plane("First", principled_material())
    second = _link(bpy.data.objects.new("Second", first.data))
    mesh = first.data
    bake_by_hand()
    third = _link(first.copy())
    third.data = first.data.copy()
    if edited:
        third.data.vertices[0].co.z = 0.5
    then()
    assert first.data == second.data == mesh
    assert third.data != mesh
    heights = [obj.data.vertices[0].co.z for obj in (first, second, third)]
    assert heights == [0, 0, 0.5 if edited else 0]
    assert [material.name for material in third.data.materials] == ["Paint"]


@AFTER
def test_an_unlinked_copy_of_what_modifiers_make_keeps_a_mesh_of_its_own(
    then: Callable[[], list[str]],
) -> None:
    ball = _subdivided()
    mesh = ball.data
    bake_by_hand()
    copy = _link(ball.copy())
    copy.data = ball.data.copy()
    then()
    assert ball.data == mesh
    assert copy.data != mesh
    assert [len(obj.data.vertices) for obj in (ball, copy)] == [4, 4]
    assert [modifier.show_render for modifier in copy.modifiers] == [True]


@AFTER
def test_applied_modifiers_stay_applied(then: Callable[[], list[str]]) -> None:
    ball = _subdivided()
    bake_by_hand()
    with bpy.context.temp_override(object=ball, active_object=ball, selected_objects=[ball]):
        bpy.ops.object.modifier_apply(modifier="Subdivision")
    count = len(ball.data.vertices)
    assert count > 4
    then()
    assert (len(ball.data.vertices), len(ball.modifiers)) == (count, 0)
    assert [material.name for material in ball.data.materials] == ["Paint"]
    assert "Lightmap" not in ball.data.uv_layers


@AFTER
def test_a_new_slot_stays_where_modifiers_make_the_mesh(then: Callable[[], list[str]]) -> None:
    ball = _subdivided()
    bake_by_hand()
    ball.data.materials.append(principled_material(name="New"))
    then()
    assert [material.name for material in ball.data.materials] == ["Paint", "New"]


@AFTER
def test_a_text_moves_along_with_what_shows_its_lightmap(then: Callable[[], list[str]]) -> None:
    text = _text()
    bake_by_hand()
    stand_in = bpy.data.objects["Text (Lightmap)"]
    stand_in.location.z += 2
    bpy.context.view_layer.update()
    assert then() == ["Text"]
    assert tuple(text.location) == (1, 2, 5)
    assert [obj.name for obj in bpy.data.objects] == ["Text"]


@AFTER
def test_a_material_assigned_to_what_shows_a_text_s_lightmap_is_the_text_s(
    then: Callable[[], list[str]],
) -> None:
    text = _text()
    bake_by_hand()
    bpy.data.objects["Text (Lightmap)"].material_slots[0].material = principled_material(name="New")
    assert then() == []
    assert [material.name for material in text.data.materials] == ["New"]
    assert [mesh.name for mesh in bpy.data.meshes] == []


@AFTER
def test_deleting_what_shows_a_text_s_lightmap_is_answered(then: Callable[[], list[str]]) -> None:
    text = _text()
    bake_by_hand()
    bpy.data.objects.remove(bpy.data.objects["Text (Lightmap)"])
    assert then() == ["Text"]
    assert not text.hide_render


@AFTER
@pytest.mark.parametrize("slots", [0, 1])
def test_a_material_assigned_to_the_original_survives_an_edit_of_a_stand_in(
    then: Callable[[], list[str]], slots: int
) -> None:
    first = add_plane("First", principled_material())
    mesh = first.data
    _link(bpy.data.objects.new("Second", mesh))
    if not slots:
        mesh.materials.clear()
    bake_by_hand()
    third = _link(bpy.data.objects.new("Third", mesh))
    mesh.materials.append(principled_material(name="New"))
    first.data.vertices[0].co.z = 0.5
    assert "First" in then()
    assert first.data.vertices[0].co.z == 0.5
    assert third.data.materials[-1].name == "New"
