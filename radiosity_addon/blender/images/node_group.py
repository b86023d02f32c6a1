"""The node group that converts a lightmap's texel to the light leaving a surface."""

from __future__ import annotations

from typing import Any

import bpy

from ..datablocks.bake_record import is_made, mark_made

GROUP_NAME = "Radiosity Lightmap"

SURFACE = "Surface"
BASE_COLOR = "Base Color"
LIGHTMAP = "Lightmap"
EMISSION = "Emission"
EMISSION_FACTOR = "Emission Factor"
SCALE = "Scale"
LIGHTMAP_ONLY = "Lightmap Only"
SHADER = "Shader"


def lightmap_group() -> bpy.types.NodeTree:
    """Return the node group, created if this file has none of ours.

    radiance = Scale · Lightmap · (Base Color, or white if Lightmap Only)
               + Emission · Emission Factor · (1 − Lightmap Only)

    `Scale` brings the texel to what a white surface would send out [W/m²/sr]; materials set
    it to suit the quantity their lightmap holds. `Emission Factor` is that of the emission's light group.
    """
    for tree in bpy.data.node_groups:
        if is_made(tree) and tree.name.startswith(GROUP_NAME):
            if not any(item.name == SURFACE for item in tree.interface.items_tree):
                _declare_surface(tree)  # one of an earlier version
            return tree
    tree = bpy.data.node_groups.new(GROUP_NAME, "ShaderNodeTree")
    mark_made(tree)
    _declare_sockets(tree)
    _build(tree)
    return tree


def _declare_sockets(tree: bpy.types.NodeTree) -> None:
    """Give the group its inputs and its one output."""

    def declare(name: str, kind: str, tip: str, default: Any) -> Any:
        socket = tree.interface.new_socket(name, description=tip, in_out="INPUT", socket_type=kind)
        socket.default_value = default
        return socket

    _declare_surface(tree)
    declare(BASE_COLOR, "NodeSocketColor", "Color that the surface reflects", (1.0, 1.0, 1.0, 1.0))
    declare(LIGHTMAP, "NodeSocketColor", "The lightmap's texel", (0.0, 0.0, 0.0, 1.0))
    declare(EMISSION, "NodeSocketColor", "Emission, including its strength", (0.0, 0.0, 0.0, 1.0))
    factor = declare(EMISSION_FACTOR, "NodeSocketColor", "Multiplies the emission", (1.0, 1.0, 1.0, 1.0))
    factor.hide_value = True
    scale = declare(SCALE, "NodeSocketFloat", "Radiance of a white surface per texel value", 1.0)
    scale.hide_value = True
    switch = declare(LIGHTMAP_ONLY, "NodeSocketFloat", "1 shows the lightmap without base color", 0.0)
    switch.subtype = "FACTOR"
    switch.min_value, switch.max_value = 0.0, 1.0
    tree.interface.new_socket(SHADER, in_out="OUTPUT", socket_type="NodeSocketShader")


def _declare_surface(tree: bpy.types.NodeTree) -> None:
    """Give the group the input that holds the material's own shader."""
    tip = "The material's own shader, which was baked"
    kind = "NodeSocketShader"
    socket = tree.interface.new_socket(SURFACE, description=tip, in_out="INPUT", socket_type=kind)
    tree.interface.move(socket, 0)


def _build(tree: bpy.types.NodeTree) -> None:
    """Wire the group's formula."""
    nodes, links = tree.nodes, tree.links
    given = _place(nodes.new("NodeGroupInput"), 0, 0)

    shade = _place(nodes.new("ShaderNodeMix"), 1, 1)
    shade.data_type = "RGBA"
    white = (1.0, 1.0, 1.0, 1.0)
    links.new(given.outputs[LIGHTMAP_ONLY], socket_by_identifier(shade.inputs, "Factor_Float"))
    links.new(given.outputs[BASE_COLOR], socket_by_identifier(shade.inputs, "A_Color"))
    socket_by_identifier(shade.inputs, "B_Color").default_value = white

    reflected = _place(nodes.new("ShaderNodeVectorMath"), 2, 1)
    reflected.operation = "MULTIPLY"
    links.new(socket_by_identifier(shade.outputs, "Result_Color"), reflected.inputs[0])
    links.new(given.outputs[LIGHTMAP], reflected.inputs[1])
    scaled = _place(nodes.new("ShaderNodeVectorMath"), 3, 1)
    scaled.operation = "SCALE"
    links.new(reflected.outputs["Vector"], scaled.inputs["Vector"])
    links.new(given.outputs[SCALE], scaled.inputs["Scale"])

    share = _place(nodes.new("ShaderNodeMath"), 1, -1)
    share.operation = "SUBTRACT"
    share.inputs[0].default_value = 1.0
    links.new(given.outputs[LIGHTMAP_ONLY], share.inputs[1])
    factored = _place(nodes.new("ShaderNodeVectorMath"), 2, -2)
    factored.operation = "MULTIPLY"
    links.new(given.outputs[EMISSION], factored.inputs[0])
    links.new(given.outputs[EMISSION_FACTOR], factored.inputs[1])
    own = _place(nodes.new("ShaderNodeVectorMath"), 3, -1)
    own.operation = "SCALE"
    links.new(factored.outputs["Vector"], own.inputs["Vector"])
    links.new(share.outputs["Value"], own.inputs["Scale"])

    total = _place(nodes.new("ShaderNodeVectorMath"), 4, 0)
    total.operation = "ADD"
    links.new(scaled.outputs["Vector"], total.inputs[0])
    links.new(own.outputs["Vector"], total.inputs[1])
    emission = _place(nodes.new("ShaderNodeEmission"), 5, 0)
    links.new(total.outputs["Vector"], emission.inputs["Color"])
    result = _place(nodes.new("NodeGroupOutput"), 6, 0)
    links.new(emission.outputs["Emission"], result.inputs[SHADER])


def socket_by_identifier(sockets: Any, identifier: str) -> bpy.types.NodeSocket:
    """Find a socket where several share a name, as those of the Mix node do."""
    return next(socket for socket in sockets if socket.identifier == identifier)


def _place(node: bpy.types.Node, column: int, row: int) -> bpy.types.Node:
    """Put a node on a coarse grid."""
    node.location = (200 * column, 150 * row)
    return node
