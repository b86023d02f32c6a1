"""Edits on stand-ins are moved to what they stand for, or kept as the user's; never dropped."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import pytest

from radiosity_addon.blender.apply.restore import restore_scene
from radiosity_addon.blender.datablocks import bake_record
from radiosity_addon.blender.datablocks.bake_record import is_made
from radiosity_addon.blender.operators import edit_guard
from tests.blender.exporting import add_instance
from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material
from tests.blender.stand_in_ends import AFTER, restored

pytestmark = pytest.mark.usefixtures("record")


def _pair() -> tuple[bpy.types.Object, bpy.types.Object]:
    """Two objects that share a mesh."""
    first = add_plane("First", principled_material())
    second = bpy.data.objects.new("Second", first.data)
    second.location.x = 4
    bpy.context.scene.collection.objects.link(second)
    return first, second


@AFTER
def test_an_edit_of_a_shared_mesh_is_in_all_that_share_it(then: Callable[[], list[str]]) -> None:
    first, second = _pair()
    first.data.use_fake_user = True
    bake_by_hand()
    assert first.data != second.data
    first.data.vertices[0].co.z = 0.5
    assert then() == ["First"]
    assert first.data == second.data
    assert (first.data.name, first.data.use_fake_user) == ("First", True)
    assert first.data.vertices[0].co.z == 0.5
    assert [material.name for material in first.data.materials] == ["Paint"]
    assert [mesh.name for mesh in bpy.data.meshes] == ["First"]
    assert list(first.data.keys()) == []


@AFTER
def test_an_edit_leaves_slots_that_are_linked_to_objects(then: Callable[[], list[str]]) -> None:
    first, second = _pair()
    first.material_slots[0].link = "OBJECT"
    first.material_slots[0].material = principled_material(name="Of First")
    bake_by_hand()
    first.data.vertices[0].co.z = 0.5
    assert then() == ["First"]
    assert first.data == second.data
    slots = [(obj.material_slots[0].link, obj.material_slots[0].material.name) for obj in (first, second)]
    assert slots == [("OBJECT", "Of First"), ("DATA", "Paint")]


@AFTER
def test_an_edit_of_a_mesh_without_slots_adds_none(then: Callable[[], list[str]]) -> None:
    first = add_plane("First")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Second", first.data))
    bake_by_hand()
    first.data.vertices[0].co.z = 0.5
    assert then() == ["First"]
    assert len(first.data.materials) == len(first.material_slots) == 0


@AFTER
def test_an_edit_of_a_mesh_with_eight_layers_keeps_them(then: Callable[[], list[str]]) -> None:
    first, second = _pair()
    for name in (*"ABCDEFG", "Lightmap"):
        first.data.uv_layers.new(name=name)
    first.data.uv_layers["Lightmap"].uv[0].vector = (0.25, 0.75)
    bake_by_hand()
    first.data.vertices[0].co.z = 0.5
    assert then() == ["First"]
    assert first.data == second.data
    assert [layer.name for layer in first.data.uv_layers] == [*"ABCDEFG", "Lightmap"]
    assert tuple(first.data.uv_layers["Lightmap"].uv[0].vector) == (0.25, 0.75)


@AFTER
def test_two_different_edits_are_both_kept(then: Callable[[], list[str]]) -> None:
    first, second = _pair()
    bake_by_hand()
    first.data.vertices[0].co.z = 0.5
    second.data.vertices[0].co.z = -0.5
    assert sorted(then()) == ["First", "Second"]
    assert (first.data.vertices[0].co.z, second.data.vertices[0].co.z) == (0.5, -0.5)
    assert first.data != second.data


@AFTER
def test_a_material_assigned_to_a_stand_in_stays(then: Callable[[], list[str]]) -> None:
    first, second = _pair()
    bake_by_hand()
    first.material_slots[0].material = principled_material(name="New")
    then()
    assert first.data == second.data
    assert [slot.material.name for slot in first.material_slots] == ["New"]


@AFTER
def test_different_materials_assigned_to_stand_ins_of_one_mesh_stay(then: Callable[[], list[str]]) -> None:
    first, second = _pair()
    bake_by_hand()
    first.material_slots[0].material = principled_material(name="A")
    second.material_slots[0].material = principled_material(name="B")
    then()
    shown = [obj.material_slots[0].material.name for obj in (first, second)]
    assert shown == ["A", "B"]


def _modified() -> bpy.types.Object:
    obj = add_plane("Modified", principled_material())
    obj.modifiers.new("Bevel", "SOLIDIFY").thickness = 0.5
    return obj


@AFTER
def test_an_edit_of_what_modifiers_made_is_kept_as_a_mesh(then: Callable[[], list[str]]) -> None:
    obj = _modified()
    original = obj.data
    bake_by_hand()
    assert obj.data != original
    obj.data.vertices[0].co.x = -7
    assert then() == ["Modified"]
    assert obj.data == original
    kept = bpy.data.meshes["Modified (edited)"]
    assert kept.use_fake_user
    assert kept.vertices[0].co.x == -7
    assert not is_made(kept)
    assert [material.name for material in kept.materials] == ["Paint"]
    assert "Lightmap" not in kept.uv_layers


@AFTER
def test_what_the_user_does_to_modifiers_stays(then: Callable[[], list[str]]) -> None:
    obj = _modified()
    obj.modifiers.new("Off", "BEVEL").show_viewport = False
    obj.modifiers.new("Named", "TRIANGULATE")
    bake_by_hand()
    obj.modifiers["Bevel"].thickness = 0.25
    obj.modifiers["Off"].show_viewport = True
    obj.modifiers["Named"].name = "Renamed"
    obj.modifiers.new("Added", "WELD")
    then()
    flags = {each.name: (each.show_viewport, each.show_render) for each in obj.modifiers}
    assert flags == dict.fromkeys(("Bevel", "Off", "Renamed", "Added"), (True, True))
    assert obj.modifiers["Bevel"].thickness == 0.25


def _instance() -> bpy.types.Object:
    group = bpy.data.collections.new("Group")
    part = add_plane("Part", principled_material())
    bpy.context.scene.collection.objects.unlink(part)
    group.objects.link(part)
    return add_instance(group, "Here", location=(0, 0, 5))


STAND_IN = "Here/Part (Lightmap)"


def _move(obj: bpy.types.Object) -> None:
    obj.location.x += 1


def _rename(obj: bpy.types.Object) -> None:
    obj.name = "Mine"


def _constrain(obj: bpy.types.Object) -> None:
    obj.constraints.new("COPY_LOCATION")


def _note(obj: bpy.types.Object) -> None:
    obj["note"] = "mine"


@AFTER
@pytest.mark.parametrize("edit", [_move, _rename, _constrain, _note])
def test_an_edited_stand_in_object_becomes_the_user_s(
    edit: Callable[[bpy.types.Object], None], then: Callable[[], list[str]]
) -> None:
    instancer = _instance()
    bake_by_hand()
    stand_in = bpy.data.objects[STAND_IN]
    edit(stand_in)
    assert len(then()) >= 1
    assert not instancer.hide_render
    assert stand_in.name.endswith("(edited)")
    assert not is_made(stand_in)
    assert stand_in.users_collection == (bpy.context.scene.collection,)
    assert stand_in.hide_render == (edit is not _move)
    assert [material.name for material in stand_in.data.materials] == ["Paint"]
    assert not bake_record.is_baked()


def test_what_refers_to_a_stand_in_goes_on_doing_so() -> None:
    _instance()
    other = add_plane("Other")
    bake_by_hand(objects=("Here",))
    stand_in = bpy.data.objects[STAND_IN]
    child = bpy.data.objects.new("Child", None)
    bpy.context.scene.collection.objects.link(child)
    child.parent, child.location = stand_in, (1, 2, 3)
    other.modifiers.new("Boolean", "BOOLEAN").object = stand_in
    bpy.data.collections["Radiosity Lightmaps"].objects.link(other)
    bpy.context.view_layer.update()
    place = child.matrix_world.copy()
    restored()
    bpy.context.view_layer.update()
    assert child.matrix_world == place
    assert other.modifiers["Boolean"].object == stand_in
    assert "Other" in bpy.context.scene.objects
    assert "Radiosity Lightmaps" not in bpy.data.collections


def test_the_user_s_objects_in_our_collection_stay() -> None:
    _instance()
    bake_by_hand()
    collection = bpy.data.collections["Radiosity Lightmaps"]
    mine, inner = bpy.data.objects.new("Mine", None), bpy.data.collections.new("Inner")
    collection.objects.link(mine)
    collection.children.link(inner)
    restored()
    assert "Mine" in bpy.context.scene.objects
    assert inner.name in bpy.context.scene.collection.children


def test_lightmaps_in_the_user_s_own_materials_stay() -> None:
    plane = add_plane(material=principled_material())
    bake_by_hand()
    mine = principled_material(name="Mine")
    mine.node_tree.nodes.new("ShaderNodeTexImage").image = bpy.data.images["lightmap.exr"]
    mine.use_fake_user = True
    curve = bpy.data.objects.new("Curve", bpy.data.curves.new("Curve", "CURVE"))
    curve.data.materials.append(plane.data.materials[0])
    bpy.context.scene.collection.objects.link(curve)
    restored()
    assert not is_made(bpy.data.images["lightmap.exr"])
    assert [material.name for material in curve.data.materials] == ["Paint"]
    assert sorted(material.name for material in bpy.data.materials) == ["Mine", "Paint"]


def test_what_is_marked_as_an_asset_stays_one() -> None:
    plane = add_plane(material=principled_material())
    bake_by_hand()
    plane.data.materials[0].asset_mark()
    restored()
    (asset,) = (material for material in bpy.data.materials if material.asset_data is not None)
    assert asset.name.startswith("Paint")
    assert not is_made(asset)
    assert [material.name for material in plane.data.materials] == ["Paint"]
    assert not bake_record.is_baked()


@pytest.mark.parametrize("reload", [False, True], ids=["at once", "after a reload"])
def test_a_library_override_is_restored(tmp_path: Path, reload: bool) -> None:
    collection = bpy.data.collections.new("Furniture")
    bpy.context.scene.collection.children.link(collection)
    chair = add_plane("Chair", principled_material())
    bpy.context.scene.collection.objects.unlink(chair)
    collection.objects.link(chair)
    chair.modifiers.new("Solid", "SOLIDIFY")
    stool = add_plane("Stool", principled_material())
    bpy.context.scene.collection.objects.unlink(stool)
    collection.objects.link(stool)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.collections = ["Furniture"]
    bpy.context.scene.collection.children.link(wanted.collections[0])
    wanted.collections[0].override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    bake_by_hand()

    def overrides() -> dict[str, bpy.types.Object]:
        return {obj.name: obj for obj in bpy.data.objects if obj.library is None}

    assert all(is_made(obj.data) for obj in overrides().values())
    if reload:
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=path)
    assert bake_record.is_baked()
    assert restore_scene(bpy.context, None).count == 2
    assert set(overrides()) == {"Chair", "Stool"}
    assert all(obj.data.library is not None for obj in overrides().values())
    (modifier,) = overrides()["Chair"].modifiers
    assert modifier.show_viewport
    assert modifier.show_render
    assert not bake_record.is_baked()


def test_an_edit_on_an_override_becomes_a_mesh_of_its_own(tmp_path: Path) -> None:
    add_plane("Chair", principled_material())
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Chair"]
    chair = wanted.objects[0].override_create(remap_local_usages=True)
    bpy.context.scene.collection.objects.link(chair)
    bake_by_hand()
    chair.data.vertices[0].co.z = 0.5
    assert restored() == ["Chair"]
    assert chair.data.library is None
    assert chair.data.vertices[0].co.z == 0.5


@pytest.mark.parametrize("again", [False, True], ids=["restored", "baked again"])
def test_a_material_assigned_to_an_override_survives_reloads(tmp_path: Path, again: bool) -> None:
    path = str(tmp_path / "scene.blend")
    add_plane("Chair", principled_material())
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Chair"]
    chair = wanted.objects[0].override_create(remap_local_usages=True)
    bpy.context.scene.collection.objects.link(chair)

    def reload() -> bpy.types.Object:
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=path)
        return bpy.context.scene.objects["Chair"]

    bake_by_hand()
    chair.material_slots[0].material = principled_material(name="Mine")
    reload()
    if again:
        bake_by_hand()
        reload()
    restored()
    (slot,) = reload().material_slots
    assert slot.link == "OBJECT"
    assert slot.material is not None
    assert slot.material.name == "Mine"


def test_edits_that_cannot_be_taken_over_are_refused_at_once() -> None:
    instancer = _instance()
    modified = _modified()
    bake_by_hand()
    stand_in = bpy.data.objects[STAND_IN]
    place = stand_in.matrix_basis.copy()
    bpy.app.handlers.depsgraph_update_post.append(edit_guard.note)
    try:
        stand_in.location.x += 3
        bpy.context.view_layer.objects.active = modified
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.view_layer.update()
        messages = edit_guard.refuse(bpy.context)
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(edit_guard.note)
        edit_guard.forget()
    assert sorted(message.split("'")[1] for message in messages) == [STAND_IN, "Modified"]
    assert stand_in.matrix_basis == place
    assert modified.mode == "OBJECT"
    assert restored() == []
    assert not instancer.hide_render


def test_objects_with_their_own_mesh_may_be_edited_and_moved() -> None:
    plane = add_plane()
    bake_by_hand()
    bpy.app.handlers.depsgraph_update_post.append(edit_guard.note)
    try:
        plane.location.x = 3
        bpy.context.view_layer.update()
        assert edit_guard.refuse(bpy.context) == []
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(edit_guard.note)
        edit_guard.forget()
    assert plane.location.x == 3
