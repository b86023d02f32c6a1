"""The node group that converts a lightmap's texel to the light leaving a surface."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import bpy

from ..datablocks.bake_record import is_made, mark_made

GROUP_NAME = "Radiosity Lightmap"

SURFACE = "Surface"
BASE_COLOR = "Base Color"
DIFFUSE_COLOR = "Diffuse Color"
LIGHTMAP = "Lightmap"
EMISSION = "Emission"
EMISSION_FACTOR = "Emission Factor"
SCALE = "Scale"
ALPHA = "Alpha"
SHADER = "Shader"

LIGHTMAP_ONLY = "Lightmap Only"
"""Input of the groups of earlier versions: 1 shows the lightmap without base color."""

SHINE, MATTE, LOOK_LIGHTMAP = "shine", "matte", "lightmap"
"""What can be shown. The group has a node of each name, one of which is linked to its output."""

_KIND = "radiosity_lightmap_kind"
"""On a group: which of them it is. Those of earlier versions have none, and can only show two looks."""


def lightmap_group(shines: bool, see_through: bool) -> bpy.types.NodeTree:
    """Return the node group, created if this file has none of ours.

    matte:    radiance = Scale · Lightmap · Base Color + Emission · Emission Factor
    lightmap: radiance = Scale · Lightmap
    shine:    radiance = Scale · Lightmap · Diffuse Color + Emission · Emission Factor,
              added to what `Surface` reflects

    `Scale` brings the texel to what a white surface would send out [W/m²/sr]; materials set
    it to suit the quantity their lightmap holds. `Emission Factor` is that of the emission's light group.

    shines: It can show the shine; else that looks as matte.
    see_through: It has an input `Alpha`, the share of the surface that is there. Others are opaque: EEVEE
        takes longer for what may be transparent.
    """
    kind = f"{SHINE if shines else MATTE}{' alpha' if see_through else ''}"
    for tree in _groups():
        if tree.get(_KIND) == kind and tree.name.startswith(GROUP_NAME):
            return tree
    tree = bpy.data.node_groups.new(GROUP_NAME, "ShaderNodeTree")
    mark_made(tree)
    tree[_KIND] = kind
    _declare_sockets(tree, see_through)
    _build(tree, shines, see_through)
    _show(tree, SHINE)
    return tree


def show_in_groups(look: str) -> None:
    """Have all groups show a look: all materials change, and none of their nodes."""
    for tree in _groups():
        if tree.get(_KIND) is not None:
            _show(tree, look)


def is_shown_by_all(look: str) -> bool:
    """Whether all groups of this file show a look, as far as they can; appended ones may show another."""
    trees = [tree for tree in _groups() if tree.get(_KIND) is not None]
    return all(_shown(tree) == _node_of(tree, look).name for tree in trees)


def libraries_showing_others(look: str) -> list[bpy.types.Library]:
    """Return the libraries with groups that show another look, which this file cannot change."""
    trees = [
        tree for tree in bpy.data.node_groups if tree.library is not None and tree.get(_KIND) is not None
    ]
    others = [tree for tree in trees if tree.users and _shown(tree) != _node_of(tree, look).name]
    return list(dict.fromkeys(tree.library for tree in others))


def looks_of_groups() -> dict[int, str]:
    """Return the look that each group shows, by its `session_uid`."""
    return {tree.session_uid: _shown(tree) for tree in _groups() if tree.get(_KIND) is not None}


def put_looks_back(looks: Mapping[int, str]) -> None:
    """Have the groups that are still there show what they showed; see `looks_of_groups`."""
    for tree in _groups():
        if tree.session_uid in looks:
            _show(tree, looks[tree.session_uid])


@contextmanager
def matte_groups() -> Iterator[None]:
    """Have groups that show the shine be matte as long as this lasts."""
    shining = [tree for tree in _groups() if tree.get(_KIND) is not None and _shown(tree) == SHINE]
    for tree in shining:
        _show(tree, MATTE)
    try:
        yield
    finally:
        for tree in shining:
            _show(tree, SHINE)


def _groups() -> list[bpy.types.NodeTree]:
    return [tree for tree in bpy.data.node_groups if is_made(tree) and tree.library is None]


def _result(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    return next(node for node in tree.nodes if node.type == "GROUP_OUTPUT").inputs[SHADER]


def _shown(tree: bpy.types.NodeTree) -> str:
    return _result(tree).links[0].from_node.name


def _show(tree: bpy.types.NodeTree, look: str) -> None:
    tree.links.new(_node_of(tree, look).outputs[0], _result(tree))


def _node_of(tree: bpy.types.NodeTree, look: str) -> bpy.types.Node:
    return tree.nodes.get(look) or tree.nodes[MATTE]


def _declare_sockets(tree: bpy.types.NodeTree, see_through: bool) -> None:
    """Give the group its inputs and its one output."""

    def declare(name: str, kind: str, tip: str, default: Any = None) -> Any:
        socket = tree.interface.new_socket(name, description=tip, in_out="INPUT", socket_type=kind)
        if default is not None:
            socket.default_value = default
        return socket

    white, black = (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 1.0)
    declare(SURFACE, "NodeSocketShader", "The material's own shader, which was baked")
    declare(BASE_COLOR, "NodeSocketColor", "Color that the surface reflects, where it is shown matte", white)
    declare(DIFFUSE_COLOR, "NodeSocketColor", "Color that it reflects without the shine", white)
    declare(LIGHTMAP, "NodeSocketColor", "The lightmap's texel", black)
    declare(EMISSION, "NodeSocketColor", "Emission, including its strength", black)
    factor = declare(EMISSION_FACTOR, "NodeSocketColor", "Multiplies the emission", white)
    factor.hide_value = True
    scale = declare(SCALE, "NodeSocketFloat", "Radiance of a white surface per texel value", 1.0)
    scale.hide_value = True
    if see_through:
        declare(ALPHA, "NodeSocketFloat", "The share of the surface that is there", 1.0)
    tree.interface.new_socket(SHADER, in_out="OUTPUT", socket_type="NodeSocketShader")


def _build(tree: bpy.types.NodeTree, shines: bool, see_through: bool) -> None:
    """Wire the group's formula."""
    given = _place(tree.nodes.new("NodeGroupInput"), 0, 0).outputs
    _place(tree.nodes.new("NodeGroupOutput"), 7, 0)

    def combined(
        operation: str, one: bpy.types.NodeSocket, other: bpy.types.NodeSocket, column: int, row: int
    ) -> bpy.types.NodeSocket:
        node = _place(tree.nodes.new("ShaderNodeVectorMath"), column, row)
        node.operation = operation
        tree.links.new(one, node.inputs[0])
        tree.links.new(other, node.inputs["Scale" if operation == "SCALE" else 1])
        return node.outputs["Vector"]

    def emitting(color: bpy.types.NodeSocket, row: int) -> bpy.types.Node:
        node = _place(tree.nodes.new("ShaderNodeEmission"), 5, row)
        tree.links.new(color, node.inputs["Color"])
        return node

    def covering(shader: bpy.types.Node, row: int) -> bpy.types.Node:
        if not see_through:
            return shader
        clear, mix = tree.nodes.new("ShaderNodeBsdfTransparent"), tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(given[ALPHA], mix.inputs[0])
        tree.links.new(_place(clear, 5, row + 1).outputs[0], mix.inputs[1])
        tree.links.new(shader.outputs[0], mix.inputs[2])
        return _place(mix, 6, row)

    light = combined("SCALE", given[LIGHTMAP], given[SCALE], 1, 0)
    glow = combined("MULTIPLY", given[EMISSION], given[EMISSION_FACTOR], 1, -2)
    reflected = combined("MULTIPLY", light, given[BASE_COLOR], 2, 0)
    covering(emitting(combined("ADD", reflected, glow, 3, 0), 0), 0).name = MATTE
    covering(emitting(light, 2), 2).name = LOOK_LIGHTMAP
    if not shines:
        return
    diffuse = combined("ADD", combined("MULTIPLY", light, given[DIFFUSE_COLOR], 2, -2), glow, 3, -2)
    if see_through:
        from ..materials.node_algebra import NodeAlgebra

        diffuse = combined("SCALE", diffuse, NodeAlgebra(tree).saturate(given[ALPHA]), 4, -2)
    whole = _place(tree.nodes.new("ShaderNodeAddShader"), 6, -2)
    whole.name = SHINE
    tree.links.new(given[SURFACE], whole.inputs[0])
    tree.links.new(emitting(diffuse, -2).outputs[0], whole.inputs[1])


def socket_by_identifier(sockets: Any, identifier: str) -> bpy.types.NodeSocket:
    """Find a socket where several share a name, as those of the Mix node do."""
    return next(socket for socket in sockets if socket.identifier == identifier)


def _place(node: bpy.types.Node, column: int, row: int) -> bpy.types.Node:
    """Put a node on a coarse grid."""
    node.location = (200 * column, 150 * row)
    return node
