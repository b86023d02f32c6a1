"""What is renamed, locked, keyed or made active on a stand-in reaches its original."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import pytest

from radiosity_addon.blender.datablocks.bake_record import is_made
from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material
from tests.blender.stand_in_ends import AFTER, restored

pytestmark = pytest.mark.usefixtures("record")


def _shared(name: str) -> bpy.types.Object:
    first = add_plane(name, principled_material())
    second = bpy.data.objects.new(f"{name} Twin", first.data)
    bpy.context.scene.collection.objects.link(second)
    return first


def _modified(name: str) -> bpy.types.Object:
    obj = add_plane(name, principled_material())
    obj.modifiers.new("Bevel", "BEVEL")
    return obj


def _with_keys(name: str) -> bpy.types.Object:
    obj = _shared(name)
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Tall").data[0].co.z = 1
    obj.data.shape_keys.key_blocks["Tall"].value = 0
    return obj


KINDS = pytest.mark.parametrize("make", [_shared, _modified], ids=["shared", "modified"])


def _groups(obj: bpy.types.Object) -> list[tuple[str, bool]]:
    return [(group.name, group.lock_weight) for group in obj.vertex_groups]


@AFTER
@KINDS
def test_vertex_groups(make: Callable[[str], bpy.types.Object], then: Callable[[], list[str]]) -> None:
    obj = make("Plane")
    for name in ("First", "Second", "Third"):
        obj.vertex_groups.new(name=name).add([0, 1], 0.5, "REPLACE")
    bake_by_hand()
    assert is_made(obj.data)
    groups = obj.vertex_groups
    groups["Second"].name = "Renamed"
    groups["First"].name = "Second"
    groups["Third"].lock_weight = True
    groups.new(name="Added")
    assert then() == []
    assert _groups(obj) == [("Second", False), ("Renamed", False), ("Third", True), ("Added", False)]
    assert [group.group for group in obj.data.vertices[0].groups] == [0, 1, 2]
    assert len(bpy.data.objects) == (2 if make is _shared else 1)


@AFTER
@KINDS
def test_a_removed_group_is_an_edit(
    make: Callable[[str], bpy.types.Object], then: Callable[[], list[str]]
) -> None:
    obj = make("Plane")
    for name in ("First", "Second"):
        obj.vertex_groups.new(name=name)
    bake_by_hand()
    obj.vertex_groups.remove(obj.vertex_groups["First"])
    assert then() == ["Plane"]
    if make is _shared:
        assert _groups(obj) == [("Second", False)]
    else:
        assert "Plane (edited)" in bpy.data.meshes


def test_a_renamed_bone_moves_its_vertices_still() -> None:
    armature = bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", armature)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    armature.edit_bones.new("Bone").tail = (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.pose.bones["Bone"].location = (0, 3, 0)
    obj = add_plane("Body", principled_material())
    obj.vertex_groups.new(name="Bone").add(range(4), 1.0, "REPLACE")
    obj.modifiers.new("Armature", "ARMATURE").object = rig

    def height() -> float:
        bpy.context.view_layer.update()
        return max(vertex.co.z for vertex in obj.evaluated_get(_depsgraph()).data.vertices)

    before = height()
    assert before == pytest.approx(3)
    bake_by_hand()
    armature.bones["Bone"].name = "Spine"
    assert restored() == []
    assert _groups(obj) == [("Spine", False)]
    assert height() == pytest.approx(before)


def _depsgraph() -> bpy.types.Depsgraph:
    return bpy.context.evaluated_depsgraph_get()


@AFTER
def test_values_and_keyframes_of_shape_keys(then: Callable[[], list[str]]) -> None:
    obj = _with_keys("Face")
    reader = bpy.data.objects.new("Reader", None)
    variable = reader.driver_add("location", 2).driver.variables.new()
    target = variable.targets[0]
    target.id_type, target.id = "KEY", obj.data.shape_keys
    target.data_path = 'key_blocks["Tall"].value'
    bake_by_hand()
    keys = obj.data.shape_keys
    keys.key_blocks["Tall"].value = 0.25
    keys.key_blocks["Tall"].keyframe_insert("value", frame=7)
    keys.name = "Smiles"
    assert then() == ["Face"]
    keys = obj.data.shape_keys
    assert keys.key_blocks["Tall"].value == 0.25
    assert keys.key_blocks["Tall"].data[0].co.z == 1
    assert keys.animation_data.action is not None
    assert keys.name == "Smiles"
    assert keys == bpy.data.objects["Face Twin"].data.shape_keys
    assert target.id == keys
    assert len(bpy.data.shape_keys) == 1


@AFTER
def test_a_frame_change_is_no_edit(then: Callable[[], list[str]]) -> None:
    obj = _with_keys("Face")
    block = obj.data.shape_keys.key_blocks["Tall"]
    for frame, value in ((1, 0.0), (5, 1.0)):
        block.value = value
        block.keyframe_insert("value", frame=frame)
    bpy.context.scene.frame_set(1)
    bake_by_hand()
    bpy.context.scene.frame_set(5)
    assert then() == []
    bpy.context.scene.frame_set(5)
    assert obj.data.shape_keys.key_blocks["Tall"].value == 1


@AFTER
@KINDS
def test_the_mesh_s_name_and_active_layers(
    make: Callable[[str], bpy.types.Object], then: Callable[[], list[str]]
) -> None:
    obj = make("Plane")
    for name in ("First", "Lightmap", "Second"):
        obj.data.uv_layers.new(name=name)
    bake_by_hand()
    mesh = obj.data
    assert is_made(mesh)
    mesh.name = "Chair"
    mesh.uv_layers["Second"].active = True
    mesh.uv_layers["Lightmap (original)"].active_render = True
    assert then() == []
    assert obj.data.name == "Chair"
    assert obj.data.uv_layers.active.name == "Second"
    assert [layer.name for layer in obj.data.uv_layers if layer.active_render] == ["Lightmap"]
    assert [layer.name for layer in obj.data.uv_layers] == ["First", "Lightmap", "Second"]


@AFTER
def test_a_look_at_the_lightmap_s_layer_changes_none(then: Callable[[], list[str]]) -> None:
    obj = _shared("Plane")
    for name in ("First", "Second"):
        obj.data.uv_layers.new(name=name)
    obj.data.uv_layers["Second"].active = True
    bake_by_hand()
    obj.data.uv_layers["Lightmap"].active = True
    assert then() == []
    assert obj.data.uv_layers.active.name == "Second"


@AFTER
def test_keyframes_of_a_mesh(then: Callable[[], list[str]]) -> None:
    obj = _shared("Plane")
    obj.data["wear"] = 1.0
    bake_by_hand()
    obj.data.keyframe_insert('["wear"]', frame=3)
    assert then() == ["Plane"]
    assert obj.data.animation_data.action is not None
    assert obj.data["wear"] == 1.0
