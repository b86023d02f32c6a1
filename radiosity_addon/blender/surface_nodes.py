"""Find what a material's shaders reflect, emit and cover, as sockets to wire on from.

Nothing is evaluated: a texture that feeds Base Color keeps feeding it. Where sockets must
be combined (emission strength, Mix Shader) nodes are added to the tree, which therefore
has to be a copy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import bpy

from .bake_record import mark_made
from .node_group import socket_by_identifier

Color: TypeAlias = tuple[float, float, float]
ColorSource: TypeAlias = Color | bpy.types.NodeSocket
FloatSource: TypeAlias = float | bpy.types.NodeSocket

BLACK: Color = (0.0, 0.0, 0.0)

_UNREADABLE = {"BSDF_GLASS", "BSDF_REFRACTION", "GROUP_INPUT", "HOLDOUT"}
"""Shaders whose color is not what they reflect diffusely."""


@dataclass(frozen=True)
class Surface:
    """A shader seen as a diffuse, emitting and partly transparent surface.

    Parameters
    ----------
    base : color or socket
        Reflectance.
    emission : color or socket
        Radiance it sends out of its own [W/m²/sr].
    alpha : float or socket
        0 lets everything through.
    """

    base: ColorSource
    emission: ColorSource = BLACK
    alpha: FloatSource = 1.0


def read_surface(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, unknown: Surface) -> Surface:
    """Read the shader that feeds `socket`, through Mix and Add Shaders.

    Parameters
    ----------
    tree : NodeTree
        Nodes are added to it where sockets must be combined.
    socket : NodeSocket
        A shader input, such as Surface of the Material Output.
    unknown : Surface
        Taken for shaders that have no base color of their own to read.
    """
    source = feeding_socket(socket)
    if source is None:
        return Surface(BLACK)
    if source.type != "SHADER" and source.node.type not in ("GROUP", "GROUP_INPUT"):
        return Surface(BLACK, source)
    node = source.node
    if node.type == "BSDF_PRINCIPLED":
        emission = _scaled(tree, node.inputs["Emission Color"], node.inputs["Emission Strength"])
        return Surface(_color(node.inputs["Base Color"]), emission, _float(node.inputs["Alpha"]))
    if node.type == "BSDF_DIFFUSE":
        return Surface(_color(node.inputs["Color"]))
    if node.type == "EMISSION":
        return Surface(BLACK, _scaled(tree, node.inputs["Color"], node.inputs["Strength"]))
    if node.type == "BSDF_TRANSPARENT":
        return Surface(BLACK, alpha=0.0)
    if node.type == "GROUP" and node.node_tree is not None:
        return _grouped(tree, node, source, unknown)
    if node.type == "MIX_SHADER":
        first, second = (read_surface(tree, node.inputs[i], unknown) for i in (1, 2))
        return _mixed(tree, _float(node.inputs[0]), first, second)
    if node.type == "ADD_SHADER":
        first, second = (read_surface(tree, node.inputs[i], unknown) for i in (0, 1))
        return _added(tree, first, second)
    if node.type in _UNREADABLE:
        return unknown
    color = node.inputs.get("Color") or node.inputs.get("Base Color")
    return unknown if color is None else Surface(_color(color))


def feeding_socket(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the output that feeds an input, past reroutes; None where nothing does."""
    while socket.is_linked and not socket.links[0].is_muted:
        source = socket.links[0].from_socket
        if source.node.type != "REROUTE":
            return source
        socket = source.node.inputs[0]
    return None


def feed_color(tree: bpy.types.NodeTree, target: bpy.types.NodeSocket, source: ColorSource) -> None:
    """Link or set a color or vector input."""
    if isinstance(source, bpy.types.NodeSocket):
        tree.links.new(source, target)
    else:
        target.default_value = (*source, 1.0) if target.type == "RGBA" else source


def feed_float(tree: bpy.types.NodeTree, target: bpy.types.NodeSocket, source: FloatSource) -> None:
    """Link or set a float input."""
    if isinstance(source, bpy.types.NodeSocket):
        tree.links.new(source, target)
    else:
        target.default_value = source


def _grouped(
    tree: bpy.types.NodeTree, node: bpy.types.Node, output: bpy.types.NodeSocket, unknown: Surface
) -> Surface:
    """Read a shader inside a node group, through outputs added to a copy of the group."""
    group = node.node_tree.copy()
    mark_made(group)
    result = next((n for n in group.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output), None)
    if result is None:
        return unknown
    inner = read_surface(group, socket_by_identifier(result.inputs, output.identifier), unknown)
    user = tree.nodes.new("ShaderNodeGroup")
    user.node_tree = group
    user.location = node.location
    for given in node.inputs:
        target = next((s for s in user.inputs if s.identifier == given.identifier), None)
        source = feeding_socket(given)
        if target is not None and source is not None:
            tree.links.new(source, target)
        elif target is not None and hasattr(given, "default_value"):
            target.default_value = given.default_value

    def outward(source: ColorSource | FloatSource, name: str) -> Any:
        """Pass an inner socket through the group's border; constants need not."""
        if not isinstance(source, bpy.types.NodeSocket):
            return source
        kind = "NodeSocketFloat" if name == "Alpha" else "NodeSocketColor"
        declared = group.interface.new_socket(name, in_out="OUTPUT", socket_type=kind)
        group.links.new(source, socket_by_identifier(result.inputs, declared.identifier))
        return socket_by_identifier(user.outputs, declared.identifier)

    return Surface(
        outward(inner.base, "Base Color"),
        outward(inner.emission, "Emission"),
        outward(inner.alpha, "Alpha"),
    )


def _color(socket: bpy.types.NodeSocket) -> ColorSource:
    """Return what feeds a color input, or its value."""
    source = feeding_socket(socket)
    return tuple(socket.default_value)[:3] if source is None else source


def _float(socket: bpy.types.NodeSocket) -> FloatSource:
    """Return what feeds a float input, or its value."""
    source = feeding_socket(socket)
    return float(socket.default_value) if source is None else source


def _scaled(
    tree: bpy.types.NodeTree, color_socket: bpy.types.NodeSocket, strength_socket: bpy.types.NodeSocket
) -> ColorSource:
    """Return color × strength of two inputs."""
    color, strength = _color(color_socket), _float(strength_socket)
    if color == BLACK or strength == 0.0:
        return BLACK
    if isinstance(color, tuple) and isinstance(strength, float):
        return (color[0] * strength, color[1] * strength, color[2] * strength)
    if strength == 1.0:
        return color
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "SCALE"
    feed_color(tree, node.inputs["Vector"], color)
    feed_float(tree, node.inputs["Scale"], strength)
    return node.outputs["Vector"]


def _mixed(tree: bpy.types.NodeTree, factor: FloatSource, first: Surface, second: Surface) -> Surface:
    """Mix two surfaces; one that is wholly transparent lends no base color."""
    base = _mix_colors(tree, factor, first.base, second.base)
    if first.alpha == 0.0:
        base = second.base
    elif second.alpha == 0.0:
        base = first.base
    emission = _mix_colors(tree, factor, first.emission, second.emission)
    return Surface(base, emission, _mix_floats(tree, factor, first.alpha, second.alpha))


def _added(tree: bpy.types.NodeTree, first: Surface, second: Surface) -> Surface:
    """Add two surfaces, as a diffuse shader plus an emission; one opaque makes both opaque."""
    alpha = second.alpha if first.alpha == 0.0 else first.alpha
    return Surface(
        _add_colors(tree, first.base, second.base), _add_colors(tree, first.emission, second.emission), alpha
    )


def _mix_colors(
    tree: bpy.types.NodeTree, factor: FloatSource, first: ColorSource, second: ColorSource
) -> ColorSource:
    """Return first · (1 − factor) + second · factor."""
    if isinstance(first, tuple) and first == second:
        return first
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type = "RGBA"
    feed_float(tree, socket_by_identifier(node.inputs, "Factor_Float"), factor)
    feed_color(tree, socket_by_identifier(node.inputs, "A_Color"), first)
    feed_color(tree, socket_by_identifier(node.inputs, "B_Color"), second)
    return socket_by_identifier(node.outputs, "Result_Color")


def _mix_floats(
    tree: bpy.types.NodeTree, factor: FloatSource, first: FloatSource, second: FloatSource
) -> FloatSource:
    """Return first · (1 − factor) + second · factor."""
    if isinstance(first, float) and first == second:
        return first
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type = "FLOAT"
    feed_float(tree, socket_by_identifier(node.inputs, "Factor_Float"), factor)
    feed_float(tree, socket_by_identifier(node.inputs, "A_Float"), first)
    feed_float(tree, socket_by_identifier(node.inputs, "B_Float"), second)
    return socket_by_identifier(node.outputs, "Result_Float")


def _add_colors(tree: bpy.types.NodeTree, first: ColorSource, second: ColorSource) -> ColorSource:
    """Return first + second."""
    if first == BLACK:
        return second
    if second == BLACK:
        return first
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "ADD"
    feed_color(tree, node.inputs[0], first)
    feed_color(tree, node.inputs[1], second)
    return node.outputs["Vector"]
