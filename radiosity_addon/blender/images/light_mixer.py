"""The node group in which light groups are mixed: one in the file, so that one slider changes all materials.

    lightmap = Σ_g  Color_g · Strength_g · Scale_g · texel_g

Each group g is a node in it, with its color and strength as inputs that can be keyframed and driven. The
node group also puts out Color_g · Strength_g, which what glows of itself is multiplied with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ..datablocks.bake_record import is_made, mark_made
from .node_group import LIGHTMAP

MIXER_NAME = "Radiosity Light Groups"
SLIDERS_NAME = "Radiosity Light Group"

COLOR, STRENGTH, TEXEL, SCALE = "Color", "Strength", "Texel", "Scale"
FACTOR, LIGHT = "Factor", "Light"

KIND = "radiosity_mixer"
"""Custom property of the mixer, also where it is set aside."""

GROUP = "radiosity_group_shown"
"""Custom property of a node in the mixer: the group whose sliders it holds."""

WHITE = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class Sliders:
    """The sliders of one light group."""

    name: str
    color: bpy.types.NodeSocket
    strength: bpy.types.NodeSocket


def mixers() -> list[bpy.types.NodeTree]:
    """Return the mixers of the lightmaps that this file shows: one a bake, and those of what was appended."""
    return [tree for tree in _all_mixers() if is_made(tree)]


def _all_mixers() -> list[bpy.types.NodeTree]:
    return [tree for tree in bpy.data.node_groups if tree.get(KIND) is not None and tree.library is None]


def new_mixer(names: Sequence[str], scales: Sequence[float]) -> bpy.types.NodeTree:
    """Make the mixer of groups; common sliders are copied from one that was set aside.

    scales: What the groups' texels must be multiplied by to get the quantity.
    """
    earlier = next((tree for tree in _all_mixers() if not is_made(tree)), None)
    # A copy has its values, its keyframes and its drivers.
    tree = bpy.data.node_groups.new(MIXER_NAME, "ShaderNodeTree") if earlier is None else earlier.copy()
    tree.name = MIXER_NAME
    tree[KIND] = True
    mark_made(tree)
    tree.interface.clear()
    for node in list(tree.nodes):
        if node.get(GROUP) not in names:
            tree.nodes.remove(node)
    _wire(tree, names, scales, _sliders_tree())
    return tree


def sliders_of(tree: bpy.types.NodeTree) -> list[Sliders]:
    """Return the sliders of a mixer's groups, in their order."""
    nodes = {node[GROUP]: node for node in tree.nodes if node.get(GROUP) is not None}
    names = [item.name for item in tree.interface.items_tree if item.in_out == "INPUT"]
    return [
        Sliders(name, nodes[name].inputs[COLOR], nodes[name].inputs[STRENGTH])
        for name in names
        if name in nodes
    ]


def factor_of(node: bpy.types.Node, group: str) -> bpy.types.NodeSocket:
    """Return the output of a material's mixer node that holds a group's color times strength.

    By place: the output of all light may have the same name.
    """
    names = [socket.name for socket in node.inputs]
    return node.outputs[1 + names.index(group)]


def set_scale(tree: bpy.types.NodeTree, name: str, scale: float) -> None:
    """Set what a group's texels are multiplied by."""
    for node in tree.nodes:
        if node.get(GROUP) == name:
            node.inputs[SCALE].default_value = scale


def _wire(
    tree: bpy.types.NodeTree, names: Sequence[str], scales: Sequence[float], sliders: bpy.types.NodeTree
) -> None:
    """Add up the groups' light and put out their factors."""
    nodes, links = tree.nodes, tree.links
    for name in names:
        texel = tree.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketColor")
        texel.default_value = (0.0, 0.0, 0.0, 1.0)
        texel.description = "The texel of this light group's lightmap"
    tree.interface.new_socket(LIGHTMAP, in_out="OUTPUT", socket_type="NodeSocketColor")
    for name in names:
        factor = tree.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketColor")
        factor.description = "Factor for light of this group"
    given, result = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    given.location, result.location = (-250, 0), (700, 0)
    kept = {node[GROUP]: node for node in nodes if node.get(GROUP) is not None}
    total = None
    for row, (name, scale) in enumerate(zip(names, scales, strict=True)):
        node = kept.get(name) or _new_group_node(tree, name)
        _set_tree(node, sliders)
        node.location = (0, -220 * row)
        node.inputs[SCALE].default_value = scale
        links.new(given.outputs[row], node.inputs[TEXEL])
        links.new(node.outputs[FACTOR], result.inputs[1 + row])
        light = node.outputs[LIGHT]
        if total is not None:
            add = nodes.new("ShaderNodeVectorMath")
            add.operation = "ADD"
            add.location = (300, -220 * row)
            links.new(total, add.inputs[0])
            links.new(light, add.inputs[1])
            light = add.outputs["Vector"]
        total = light
    if total is not None:
        links.new(total, result.inputs[0])


def _new_group_node(tree: bpy.types.NodeTree, name: str) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeGroup")
    node.name = node.label = name
    node[GROUP] = name
    node.width = 200
    return node


def _set_tree(node: bpy.types.Node, sliders: bpy.types.NodeTree) -> None:
    """Make a node show the sliders with their earlier values."""
    old = node.inputs
    color, strength = (tuple(old[COLOR].default_value), old[STRENGTH].default_value) if old else (WHITE, 1.0)
    node.node_tree = sliders
    node.inputs[COLOR].default_value = color
    node.inputs[STRENGTH].default_value = strength


def _sliders_tree() -> bpy.types.NodeTree:
    """Return the node group of one light group, created if the file has none of ours."""
    for tree in bpy.data.node_groups:
        is_ours = is_made(tree) and tree.library is None and tree.get(KIND) is None
        # The mixer's name begins with the same words.
        if is_ours and tree.name.startswith(SLIDERS_NAME) and not tree.name.startswith(MIXER_NAME):
            return tree
    tree = bpy.data.node_groups.new(SLIDERS_NAME, "ShaderNodeTree")
    mark_made(tree)

    def declare(name: str, kind: str, tip: str) -> bpy.types.NodeTreeInterfaceSocket:
        return tree.interface.new_socket(name, description=tip, in_out="INPUT", socket_type=kind)

    declare(COLOR, "NodeSocketColor", "Multiplies the light of this group").default_value = WHITE
    strength = declare(
        STRENGTH, "NodeSocketFloat", "Multiplies the light of this group; 1 is as it was baked"
    )
    strength.default_value, strength.min_value, strength.max_value = 1.0, 0.0, 1000.0
    texel = declare(TEXEL, "NodeSocketColor", "The texel of this group's lightmap")
    texel.default_value, texel.hide_value = (0.0, 0.0, 0.0, 1.0), True
    scale = declare(SCALE, "NodeSocketFloat", "Factor from a texel to the quantity")
    scale.default_value, scale.hide_value = 1.0, True
    for name in (FACTOR, LIGHT):
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketColor")

    nodes, links = tree.nodes, tree.links
    given, result = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    factor, light, value = (nodes.new("ShaderNodeVectorMath") for _ in range(3))
    factor.operation = light.operation = "SCALE"
    value.operation = "MULTIPLY"
    for column, node in enumerate((given, factor, value, result)):
        node.location = (200 * column, 0)
    light.location = (200, -200)
    links.new(given.outputs[COLOR], factor.inputs["Vector"])
    links.new(given.outputs[STRENGTH], factor.inputs["Scale"])
    links.new(given.outputs[TEXEL], light.inputs["Vector"])
    links.new(given.outputs[SCALE], light.inputs["Scale"])
    links.new(factor.outputs["Vector"], value.inputs[0])
    links.new(light.outputs["Vector"], value.inputs[1])
    links.new(factor.outputs["Vector"], result.inputs[FACTOR])
    links.new(value.outputs["Vector"], result.inputs[LIGHT])
    return tree
