"""Nodes that are linked in a circle: the links that Blender drops are dropped, and the bake ends."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import pytest

from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.materials.materials import read_material
from radiosity_addon.blender.materials.shader_nodes import is_followed
from tests.blender.hand_bake import add_plane, bake_by_hand
from tests.blender.scenes import add_node, with_nodes

pytestmark = pytest.mark.usefixtures("record")

GLOW = (0.25, 0.5, 0.75, 1.0)
Tree = bpy.types.NodeTree
Socket = bpy.types.NodeSocket


def _emission(tree: Tree, color: tuple[float, ...] = GLOW) -> bpy.types.Node:
    return add_node(tree, "ShaderNodeEmission", Color=color, Strength=2.0)


def _shader_to_itself(tree: Tree) -> Socket:
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.75
    tree.links.new(mix.outputs[0], mix.inputs[1])
    tree.links.new(_emission(tree).outputs[0], mix.inputs[2])
    return mix.outputs[0]


def _two_shaders(tree: Tree) -> Socket:
    mix, other = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeMixShader")
    for node, glow, second in ((mix, _emission(tree), other), (other, _emission(tree, (1, 0, 0, 1)), mix)):
        tree.links.new(second.outputs[0], node.inputs[1])
        tree.links.new(glow.outputs[0], node.inputs[2])
    return mix.outputs[0]


def _number_to_itself(tree: Tree) -> Socket:
    number = tree.nodes.new("ShaderNodeMath")
    number.operation = "ADD"
    number.inputs[0].default_value, number.inputs[1].default_value = 0.5, 2.0
    glow = _emission(tree)
    tree.links.new(number.outputs[0], number.inputs[0])
    tree.links.new(number.outputs[0], glow.inputs["Strength"])
    return glow.outputs[0]


def _two_numbers(tree: Tree) -> Socket:
    one, other = tree.nodes.new("ShaderNodeMath"), tree.nodes.new("ShaderNodeMath")
    for node, second, value in ((one, other, 0.5), (other, one, 0.25)):
        node.operation = "ADD"
        node.inputs[0].default_value, node.inputs[1].default_value = value, 1.0
        tree.links.new(second.outputs[0], node.inputs[0])
    glow = _emission(tree)
    tree.links.new(one.outputs[0], glow.inputs["Strength"])
    return glow.outputs[0]


def _reroutes(tree: Tree) -> Socket:
    one, other = tree.nodes.new("NodeReroute"), tree.nodes.new("NodeReroute")
    tree.links.new(one.outputs[0], other.inputs[0])
    tree.links.new(other.outputs[0], one.inputs[0])
    glow = _emission(tree)
    tree.links.new(one.outputs[0], glow.inputs["Strength"])
    return glow.outputs[0]


def _group_to_itself(tree: Tree) -> Socket:
    group = bpy.data.node_groups.new("Passed", "ShaderNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Shader", in_out=direction, socket_type="NodeSocketShader")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    sum_of_both = group.nodes.new("ShaderNodeAddShader")
    group.links.new(entry.outputs[0], sum_of_both.inputs[0])
    group.links.new(_emission(group).outputs[0], sum_of_both.inputs[1])
    group.links.new(sum_of_both.outputs[0], leave.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(node.outputs[0], node.inputs[0])
    return node.outputs[0]


CYCLES = (_shader_to_itself, _two_shaders, _number_to_itself, _two_numbers, _reroutes, _group_to_itself)
cycles = pytest.mark.parametrize("build", CYCLES)


def _material(build: Callable[[Tree], Socket], texture: bool = False) -> bpy.types.Material:
    """A material whose surface is in a cycle; with `texture`, what varies over the surface is, too."""
    material = bpy.data.materials.new("Circle")
    tree = with_nodes(material)
    shader = build(tree)
    if texture:
        total, glow, noise = (
            tree.nodes.new(f"ShaderNode{kind}") for kind in ("AddShader", "Emission", "TexNoise")
        )
        tree.links.new(noise.outputs["Color"], noise.inputs["Scale"])
        tree.links.new(noise.outputs["Color"], glow.inputs["Color"])
        tree.links.new(shader, total.inputs[0])
        tree.links.new(glow.outputs[0], total.inputs[1])
        shader = total.outputs[0]
    tree.links.new(shader, tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def _links(material: bpy.types.Material) -> list[tuple[str, str]]:
    return sorted((link.from_node.name, link.to_node.name) for link in material.node_tree.links)


@cycles
def test_cycles_are_read_as_if_the_dropped_links_were_not_there(build: Callable[[Tree], Socket]) -> None:
    material = _material(build)
    read = read_material(material)
    tree = material.node_tree
    dropped = [link for link in tree.links if not is_followed(link)]
    assert dropped
    for link in dropped:
        tree.links.remove(link)
    assert all(map(is_followed, tree.links))
    without = read_material(material)
    assert read.emission.tolist() == without.emission.tolist()
    assert read.reflectance.tolist() == without.reflectance.tolist()


@pytest.mark.parametrize("texture", [False, True])
@cycles
def test_the_bake_ends_and_restore_brings_the_links_back(
    build: Callable[[Tree], Socket], texture: bool
) -> None:
    material = _material(build, texture)
    plane = add_plane("Plane", material)
    before = _links(material)
    bake_by_hand(resolution=8)
    assert plane.material_slots[0].material != material
    restore(bpy.context)
    assert plane.material_slots[0].material == material
    assert _links(material) == before
