"""Baked materials follow the keyframes and drivers of their originals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks.keyed_paths import curves
from radiosity_addon.blender.files.files import empty_scene
from radiosity_addon.blender.material_copies.copy_marks import COPY_MARKS, FOLLOWS
from radiosity_addon.blender.material_edits.material_edits import carry_material_edits
from tests.blender.edited_copies import GREEN, Material, copy_of, grouped_material, shader
from tests.blender.eevee import seen_in_eevee
from tests.blender.hand_bake import TEXEL, add_plane, bake_by_hand, principled_material, seen_from_above
from tests.blender.scenes import add_node, set_world

pytestmark = pytest.mark.usefixtures("record")

WHITE = (1.0, 1.0, 1.0, 1.0)


def key(socket: bpy.types.NodeSocket, first: object, last: object) -> None:
    """Keyframes at 1 and 11."""
    for frame, value in ((1, first), (11, last)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)


def keyed(name: str, first: object, last: object, **inputs: object) -> Callable[[], Material]:
    def make() -> Material:
        material = principled_material(**inputs)
        key(shader(material).inputs[name], first, last)
        return material

    return make


def driven() -> Material:
    material = principled_material()
    for index in range(3):
        driver = shader(material).inputs["Base Color"].driver_add("default_value", index).driver
        driver.expression = f"{index + 1} * frame / 40"
    return material


def driven_by_a_property() -> Material:
    """One of the material itself, with keyframes."""
    material = principled_material()
    for frame, value in ((1, 0.1), (11, 0.9)):
        material["wear"] = value
        material.keyframe_insert('["wear"]', frame=frame)
    driver = shader(material).inputs["Base Color"].driver_add("default_value", 1).driver
    driver.type = "AVERAGE"
    target = driver.variables.new().targets[0]
    target.id_type, target.id, target.data_path = "MATERIAL", material, '["wear"]'
    return material


def keyed_node() -> Material:
    """Of a node that feeds the color."""
    material = principled_material()
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeRGB")
    tree.links.new(node.outputs[0], shader(material).inputs["Base Color"])
    key(node.outputs[0], GREEN, WHITE)
    return material


def keyed_in_a_group() -> Material:
    material, group = grouped_material()
    key(next(node for node in group.nodes if node.type == "BSDF_DIFFUSE").inputs["Color"], GREEN, WHITE)
    return material


def keyed_mix() -> Material:
    material = principled_material()
    tree, mix = material.node_tree, add_node(material.node_tree, "ShaderNodeMixShader")
    other = add_node(tree, "ShaderNodeBsdfDiffuse", Color=GREEN)
    tree.links.new(shader(material).outputs[0], mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], shader(material, "OUTPUT_MATERIAL").inputs["Surface"])
    key(mix.inputs[0], 0.0, 1.0)
    return material


def in_a_strip() -> Material:
    """Of the nonlinear animation."""
    material = keyed("Base Color", GREEN, WHITE)()
    data = material.node_tree.animation_data
    strip = data.nla_tracks.new().strips.new("Strip", 1, data.action)
    if hasattr(strip, "action_slot"):
        strip.action_slot = data.action.slots[0]
    data.action = None
    return material


ANIMATED = {
    "base color": keyed("Base Color", GREEN, WHITE),
    "metallic": keyed("Metallic", 0.0, 1.0),
    "roughness": keyed("Roughness", 0.0, 1.0),
    "alpha": keyed("Alpha", 1.0, 0.25),
    "emission strength": keyed("Emission Strength", 0.0, 2.0, Emission_Color=GREEN),
    "emission color": keyed("Emission Color", GREEN, WHITE, Emission_Strength=1.0),
    "driven": driven,
    "driven by a property": driven_by_a_property,
    "node": keyed_node,
    "group": keyed_in_a_group,
    "mix": keyed_mix,
    "strip": in_a_strip,
}


@pytest.mark.parametrize(
    ("kind", "show"), [*((kind, "shine") for kind in ANIMATED), ("base color", "matte"), ("group", "matte")]
)
def test_a_later_frame_looks_as_if_it_were_baked_then(kind: str, show: str, tmp_path: Path) -> None:
    scene = bpy.context.scene
    add_plane(material=ANIMATED[kind]())
    set_world(1.0, 1.0, 1.0)
    scene.frame_set(1)
    bake_by_hand(show=show)
    first = seen_from_above(tmp_path, samples=64)
    scene.frame_set(8)
    followed = seen_from_above(tmp_path, samples=64)
    assert kind == "roughness" or not np.allclose(followed, first, rtol=0.05)
    bake_by_hand(show=show)
    np.testing.assert_allclose(seen_from_above(tmp_path, samples=64), followed, rtol=1e-5)


def test_keyframes_moved_while_the_lightmap_is_shown_count(tmp_path: Path) -> None:
    material = ANIMATED["base color"]()
    add_plane(material=material)
    bpy.context.scene.frame_set(1)
    bake_by_hand()
    for curve in curves(copy_of(material).node_tree):
        if curve.driver is None:
            for point in curve.keyframe_points:
                point.co_ui.y = 0.5
    bpy.context.scene.frame_set(2)
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.multiply(0.5, TEXEL), rtol=1e-4)


@pytest.mark.parametrize("kind", ANIMATED)
def test_other_frames_are_no_edits_and_no_trace_is_left(kind: str) -> None:
    material = ANIMATED[kind]()
    add_plane(material=material)
    before = animated_paths()
    bake_by_hand()
    marks = {name: copy_of(material).get(name) for name in COPY_MARKS}
    for frame in (5, 9):
        bpy.context.scene.frame_set(frame)
        assert carry_material_edits() == ()
        assert bpy.data.materials.get(material.name) == material
        assert {name: copy_of(material).get(name) for name in COPY_MARKS} == marks
    restore(bpy.context)
    assert animated_paths() == before


def test_it_still_follows_after_saving_and_loading(tmp_path: Path) -> None:
    for kind in ("base color", "group", "driven by a property"):
        add_plane(kind, ANIMATED[kind]())
    bpy.context.scene.frame_set(1)
    bake_by_hand()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "animated.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "animated.blend"))
    for name in ("group", "driven by a property"):
        bpy.data.objects[name].hide_render = True
    bpy.context.scene.frame_set(11)
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], TEXEL, rtol=1e-4)
    assert carry_material_edits() == ()
    restore(bpy.context)
    assert len(bpy.data.materials) == 3


def animated_paths() -> list[str]:
    trees = [material.node_tree for material in bpy.data.materials] + list(bpy.data.node_groups)
    return sorted(curve.data_path for tree in trees if tree is not None for curve in curves(tree))


def unknown() -> Material:
    """Of a shader that the lightmap cannot read: one that comes in from outside of a group."""
    material = principled_material()
    tree, group = material.node_tree, bpy.data.node_groups.new("Through", "ShaderNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Shader", in_out=in_out, socket_type="NodeSocketShader")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    group.links.new(entry.outputs[0], leave.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(shader(material).outputs[0], node.inputs[0])
    tree.links.new(node.outputs[0], shader(material, "OUTPUT_MATERIAL").inputs["Surface"])
    key(shader(material).inputs["Base Color"], GREEN, WHITE)
    return material


@pytest.mark.parametrize(
    ("quantity", "kind"), [("radiosity", "base color"), ("residual", "group"), ("irradiance", "unknown")]
)
def test_a_material_that_cannot_follow_is_named_once(quantity: str, kind: str) -> None:
    material = {**ANIMATED, "unknown": unknown}[kind]()
    add_plane(material=material)
    add_plane("Pinned", material).data.uv_layers.new()
    bpy.context.scene.frame_set(8)
    (warning,) = bake_by_hand(quantity=quantity).warnings
    assert warning.name == material.name
    assert f"'{material.name}' is animated, but its lightmap shows it as at frame 8: " in warning.message


@pytest.mark.parametrize("kind", ["base color", "group"])
def test_what_follows_is_not_warned_of(kind: str) -> None:
    add_plane(material=ANIMATED[kind]())
    assert bake_by_hand().warnings == ()


def test_a_keyed_value_that_is_edited_on_the_copy_keeps_its_keyframes(paint: Material) -> None:
    """The others come over: the roughness, here."""
    material = ANIMATED["base color"]()
    add_plane("Other", material)
    bake_by_hand()
    shader(copy_of(material)).inputs["IOR"].default_value = 1.25
    assert carry_material_edits() == ()
    assert bpy.data.materials.get(material.name) == material
    assert shader(material).inputs["IOR"].default_value == 1.25
    assert [curve.data_path for curve in material.node_tree.animation_data.drivers] == []
    assert len(list(curves(material.node_tree))) == 4


EEVEE = """
from radiosity_addon.blender.datablocks import bake_record
bake_record.register()
paint = hand_bake.principled_material(Specular_IOR_Level=0.0)
socket = paint.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
for frame, value in (1, (0.0, 0.0, 0.0, 1.0)), (11, (1.0, 0.5, 0.25, 1.0)):
    socket.default_value = value
    socket.keyframe_insert("default_value", frame=frame)
hand_bake.add_plane(material=paint)
bpy.context.scene.frame_set(1)
hand_bake.bake_by_hand(folder=Path(sys.argv[1]), show="shine")
for frame in (1, 6, 11):
    bpy.context.scene.frame_set(frame)
    look()
"""


def test_keyframes_on_a_node_that_follows_are_named() -> None:
    """They have no effect there, and Restore keeps the original's."""
    material = keyed("Base Color", GREEN, WHITE)()
    add_plane(material=material)
    bake_by_hand((TEXEL,))
    copy = copy_of(material)
    assert carry_material_edits() == ()
    (node,) = [node for node in copy.node_tree.nodes if node.get(FOLLOWS) is not None]
    node.outputs[0].keyframe_insert("default_value", frame=5)
    (warning,) = carry_material_edits()
    assert f"its node '{node.name}' follows the animation of the original" in warning.message


@pytest.mark.full  # so does Cycles above, and EEVEE the light mixer in test_light_mixer_eevee.py
def test_eevee_follows_keyframes(tmp_path: Path) -> None:
    seen = seen_in_eevee(EEVEE, tmp_path)
    expected = np.multiply.outer([0.0, 0.5, 1.0], np.multiply([1.0, 0.5, 0.25], TEXEL))
    np.testing.assert_allclose(seen, expected, rtol=2e-3, atol=1e-4)


def test_a_linked_material_is_followed(tmp_path: Path) -> None:
    """Its copy is this file's, and the animation the other file's."""
    ANIMATED["base color"]().use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "paints.blend"))
    empty_scene()
    with bpy.data.libraries.load(str(tmp_path / "paints.blend"), link=True) as (_, wanted):
        wanted.materials = ["Paint"]
    add_plane(material=wanted.materials[0])
    bpy.context.scene.frame_set(1)
    bake_by_hand()
    bpy.context.scene.frame_set(11)
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], TEXEL, rtol=1e-4)
    assert carry_material_edits() == ()
