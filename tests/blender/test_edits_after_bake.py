"""What is edited on a baked object is the user's: it survives Restore and the next bake."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks import bake_record
from tests.blender.file_dump import differences_since, tidy_dump
from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material

pytestmark = pytest.mark.usefixtures("record")


def _again() -> None:
    bake_by_hand(colors=((9, 9, 9),))


def _restored() -> None:
    restore(bpy.context)


AFTER = pytest.mark.parametrize("then", [_again, _restored], ids=["baked again", "restored"])


def _plane() -> bpy.types.Object:
    # Not from_pydata, which leaves some values of edges to chance.
    bpy.ops.mesh.primitive_plane_add(calc_uvs=False)
    plane = bpy.context.object
    plane.data.name = "Plane"
    plane.data.materials.append(principled_material())
    plane.data.uv_layers.new(name="Own")
    plane.data.attributes.new("Tint", "FLOAT_COLOR", "CORNER")
    plane.vertex_groups.new(name="Some").add([0], 0.5, "REPLACE")
    return plane


def move_vertex(plane: bpy.types.Object) -> None:
    plane.data.vertices[0].co.z = 0.25


def move_uv(plane: bpy.types.Object) -> None:
    plane.data.attributes["Own"].data[1].vector = (0.125, 0.75)


def paint(plane: bpy.types.Object) -> None:
    plane.data.attributes["Tint"].data[2].color = (1, 0, 0, 1)


def weigh(plane: bpy.types.Object) -> None:
    plane.vertex_groups["Some"].add([1, 2], 0.75, "REPLACE")


def add_shape_key(plane: bpy.types.Object) -> None:
    plane.shape_key_add(name="Basis")
    plane.shape_key_add(name="Up").data[0].co.z = 2


def add_property(plane: bpy.types.Object) -> None:
    plane.data["note"] = "mine"


def add_uv_layer(plane: bpy.types.Object) -> None:
    plane.data.uv_layers.new(name="Second")


def assign_material(plane: bpy.types.Object) -> None:
    plane.material_slots[0].material = principled_material(name="New")


def add_slot(plane: bpy.types.Object) -> None:
    plane.data.materials.append(principled_material(name="New"))
    plane.data.polygons[0].material_index = 1


def link_slot_to_object(plane: bpy.types.Object) -> None:
    plane.material_slots[0].link = "OBJECT"
    plane.material_slots[0].material = principled_material(name="New")


EDITS = [
    move_vertex, move_uv, paint, weigh, add_shape_key, add_property, add_uv_layer, assign_material, add_slot,
    link_slot_to_object,
]  # fmt: skip


@pytest.mark.parametrize("rebaked", [False, True], ids=["restored", "baked again and restored"])
@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_on_a_baked_object_is_as_if_it_was_never_baked(
    edit: Callable[[bpy.types.Object], None], rebaked: bool
) -> None:
    edit(_plane())
    expected = tidy_dump()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    plane = _plane()
    bake_by_hand()
    edit(plane)
    if rebaked:
        _again()
        assert "Lightmap" in plane.data.uv_layers
    restore(bpy.context)
    assert differences_since(expected, tidy_dump()) == []


@AFTER
def test_new_faces_stay(then: Callable[[], None]) -> None:
    plane = _plane()
    bake_by_hand()
    bpy.context.view_layer.objects.active = plane
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    then()
    assert plane.mode == "OBJECT"
    assert len(plane.data.polygons) == 4


@AFTER
def test_joined_and_separated_parts_stay(then: Callable[[], None]) -> None:
    first, second = _plane(), add_plane("Second", principled_material(name="Other"))
    second.location.x = 5
    bake_by_hand(colors=((1, 0, 0), (0, 1, 0)))
    with bpy.context.temp_override(
        active_object=first, object=first, selected_objects=[first, second],
        selected_editable_objects=[first, second],
    ):  # fmt: skip
        bpy.ops.object.join()
    assert len(first.data.polygons) == 2
    bpy.context.view_layer.objects.active = first
    first.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.separate(type="LOOSE")
    bpy.ops.object.mode_set(mode="OBJECT")
    then()
    assert sorted(len(obj.data.polygons) for obj in bpy.data.objects) == [1, 1]
    restore(bpy.context)
    assert not bake_record.is_baked()
    names = {material.name for obj in bpy.data.objects for material in obj.data.materials}
    assert names == {"Paint", "Other"}
    assert all([layer.name for layer in obj.data.uv_layers] == ["Own"] for obj in bpy.data.objects)
    assert {material.name for material in bpy.data.materials} == {"Paint", "Other"}


@AFTER
@pytest.mark.parametrize("linked", [True, False], ids=["Alt-D", "Shift-D"])
def test_duplicates_stay(linked: bool, then: Callable[[], None]) -> None:
    plane = _plane()
    bake_by_hand()
    copy = plane.copy()
    if not linked:
        copy.data = plane.data.copy()
    copy.location.x = 4
    bpy.context.scene.collection.objects.link(copy)
    then()
    assert {obj.name for obj in bpy.data.objects} == {"Plane", "Plane.001"}
    restore(bpy.context)
    assert (copy.data == plane.data) == linked
    for obj in (plane, copy):
        assert [layer.name for layer in obj.data.uv_layers] == ["Own"]
        assert [material.name for material in obj.data.materials] == ["Paint"]
    assert not bake_record.is_baked()
    assert [mesh.name for mesh in bpy.data.meshes if "Lightmap" in mesh.name] == []


@AFTER
def test_an_object_that_gets_a_baked_mesh_stays(then: Callable[[], None]) -> None:
    """As by Ctrl-L, or a script; also where the mesh is a stand-in."""
    plane = _plane()
    shared = bpy.data.objects.new("Shared", plane.data)
    bpy.context.scene.collection.objects.link(shared)
    bake_by_hand()
    assert bake_record.is_made(plane.data)
    mine = bpy.data.objects.new("Mine", plane.data)
    bpy.context.scene.collection.objects.link(mine)
    then()
    assert "Mine" in bpy.data.objects
    assert len(mine.data.polygons) == 1
    restore(bpy.context)
    assert mine.data == plane.data == shared.data
    assert [mesh.name for mesh in bpy.data.meshes] == ["Plane"]


def test_a_deleted_object_leaves_nothing_of_its_bake() -> None:
    plane, other = _plane(), add_plane("Other", principled_material(name="Other"))
    bake_by_hand(colors=((1, 0, 0), (0, 1, 0)))
    bpy.data.objects.remove(plane)
    restore(bpy.context)
    assert [material.name for material in other.data.materials] == ["Other"]
    assert list(bpy.data.images) == []
    assert not any(bake_record.is_made(material) for material in bpy.data.materials)


@AFTER
def test_a_removed_slot_stays_removed(then: Callable[[], None]) -> None:
    plane = _plane()
    plane.data.materials.append(principled_material(name="Second"))
    bake_by_hand()
    plane.data.materials.pop(index=0)
    then()
    restore(bpy.context)
    assert [material.name for material in plane.data.materials] == ["Second"]


@pytest.mark.parametrize("layers", [["Lightmap"], ["A", "Lightmap", "B"], [*"ABCDEFG", "Lightmap"]])
def test_a_layer_of_the_user_s_by_our_name_comes_back(layers: list[str]) -> None:
    plane = add_plane(material=principled_material())
    for name in layers:
        plane.data.uv_layers.new(name=name)
    values = np.arange(8, dtype=np.float32) / 3
    plane.data.attributes["Lightmap"].data.foreach_set("vector", values)
    plane.data.uv_layers["Lightmap"].active_render = True
    before = tidy_dump()
    original = plane.data
    bake_by_hand()
    assert plane.data == original
    assert len(plane.data.uv_layers) == min(len(layers) + 1, 8)
    bake_by_hand(colors=((9, 9, 9),))
    restore(bpy.context)
    assert differences_since(before, tidy_dump()) == []


def test_kept_uvs_are_the_user_s_own_layer() -> None:
    plane = add_plane()
    plane.data.uv_layers.new(name="Lightmap")
    before = tidy_dump()
    bake_by_hand(keep_uvs=True)
    restore(bpy.context)
    assert differences_since(before, tidy_dump()) == []


def test_a_baked_object_that_was_appended_is_restored_there(tmp_path) -> None:
    _plane().name = "Baked"
    bake_by_hand()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "baked.blend"), link=False) as (_, wanted):
        wanted.objects = ["Baked"]
    (baked,) = wanted.objects
    bpy.context.scene.collection.objects.link(baked)
    assert len(bpy.data.scenes) == 1
    assert restore(bpy.context) == 1
    assert [layer.name for layer in baked.data.uv_layers] == ["Own"]
    assert [material.name for material in bpy.data.materials] == ["Paint"]
    assert list(bpy.data.images) == []


def test_undo_and_redo_of_bake_edit_and_restore() -> None:
    plane = _plane()
    bpy.ops.ed.undo_push(message="start")
    bake_by_hand()
    bpy.ops.ed.undo_push(message="bake")
    plane = bpy.data.objects["Plane"]
    move_vertex(plane)
    bpy.ops.ed.undo_push(message="edit")
    restore(bpy.context)
    bpy.ops.ed.undo_push(message="restore")

    def state() -> tuple:
        mesh = bpy.data.objects["Plane"].data
        return mesh.vertices[0].co.z, "Lightmap" in mesh.uv_layers, bake_record.is_baked()

    seen = [state()]
    for _ in range(3):
        bpy.ops.ed.undo()
        seen.append(state())
    for _ in range(3):
        bpy.ops.ed.redo()
        seen.append(state())
    steps = [(0.25, False, False), (0.25, True, True), (0.0, True, True), (0.0, False, False)]
    assert seen == [*steps, *steps[2::-1]]
