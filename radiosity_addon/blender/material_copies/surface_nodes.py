"""Find what a material's shaders reflect, emit and cover, as sockets to wire on from.

Nothing is evaluated: a texture that feeds Base Color keeps feeding it. A constant becomes a node
that feeds its socket and all that is made of it, so that editing it shows at once. Where sockets must
be combined (emission strength, Mix Shader) nodes are added too. So the tree has to be a copy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import bpy

from ..datablocks.bake_record import ORIGINAL, mark_made
from ..datablocks.keyed_paths import is_keyed
from ..images.node_group import socket_by_identifier
from ..materials.shader_nodes import default_rgb, feed_of
from ..materials.shader_terms import ShaderWalk
from .copy_marks import FOLLOWS, SOCKETS, VALUE, is_copied_group

Color: TypeAlias = tuple[float, float, float]
ColorSource: TypeAlias = Color | bpy.types.NodeSocket
FloatSource: TypeAlias = float | bpy.types.NodeSocket

BLACK: Color = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class SurfaceSockets:
    """A shader seen as a diffuse, emitting and partly transparent surface.

    Parameters
    ----------
    base : color or socket
        Reflectance.
    emission : color or socket
        Radiance it sends out of its own [W/m²/sr].
    alpha : float or socket
        0 lets everything through.
    glows : bool
        Its emission is not the constant 0.
    diffuse : color or socket
        The part of `base` that the lightmap lights where the shader shows the rest itself; see
        `parted_surfaces.py`.
    """

    base: ColorSource
    emission: ColorSource = BLACK
    alpha: FloatSource = 1.0
    glows: bool = False
    diffuse: ColorSource = BLACK


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


class SurfaceReader(ShaderWalk[bpy.types.NodeTree, SurfaceSockets]):
    """Reads shaders, through Mix and Add Shaders; places are trees, to which nodes are added.

    unknown: Taken for shaders that have no base color of their own to read.
    """

    def __init__(self, unknown: SurfaceSockets) -> None:
        self._unknown = unknown

    def shader(self, socket: bpy.types.NodeSocket, place: bpy.types.NodeTree) -> SurfaceSockets:
        """Read what feeds a shader input, such as Surface of the Material Output."""
        feed = feed_of(socket, enter_groups=False)
        node = feed.node
        if node is not None and node.type == "GROUP" and node.node_tree is not None:
            return self._grouped(node, feed.socket.identifier)
        if node is not None and node.type == "GROUP_INPUT":
            return self.not_understood(node)
        return self.fed_by(feed, socket, place, place)

    def _nothing(self) -> SurfaceSockets:
        return SurfaceSockets(BLACK)

    def _glow(self, socket: bpy.types.NodeSocket, place: bpy.types.NodeTree) -> SurfaceSockets:
        return SurfaceSockets(BLACK, self.emitted(socket, place), glows=True)

    def _principled(self, node: bpy.types.Node, place: bpy.types.NodeTree) -> SurfaceSockets:
        emission, glows = self._scaled(node, "Emission Color", "Emission Strength", place)
        base, diffuse = self.reflected(node, node.inputs["Base Color"], place)
        return SurfaceSockets(base, emission, _alpha(place, node), glows, diffuse)

    def _diffuse(
        self, node: bpy.types.Node, color: bpy.types.NodeSocket, place: bpy.types.NodeTree
    ) -> SurfaceSockets:
        base, diffuse = self.reflected(node, color, place)
        return SurfaceSockets(base, diffuse=diffuse)

    def _emission(self, node: bpy.types.Node, place: bpy.types.NodeTree) -> SurfaceSockets:
        emission, glows = self._scaled(node, "Color", "Strength", place)
        return SurfaceSockets(BLACK, emission, glows=glows)

    def _transparent(self, _: bpy.types.Node, __: bpy.types.NodeTree) -> SurfaceSockets:
        return SurfaceSockets(BLACK, alpha=0.0)

    def _mixed(self, node: bpy.types.Node, place: bpy.types.NodeTree) -> SurfaceSockets:
        first, second = (self.shader(socket, place) for socket in node.inputs[1:3])
        return _mixed(place, source_of(place, node.inputs[0]), first, second)

    def _added(self, node: bpy.types.Node, place: bpy.types.NodeTree) -> SurfaceSockets:
        first, second = (self.shader(socket, place) for socket in node.inputs[:2])
        return _added(place, first, second)

    def not_understood(self, _: bpy.types.Node, /) -> SurfaceSockets:
        """Return what stands for other shaders: the constants of the whole material."""
        return self._unknown

    def reflected(
        self, node: bpy.types.Node, color: bpy.types.NodeSocket, place: bpy.types.NodeTree
    ) -> tuple[ColorSource, ColorSource]:
        """Return a shader's base color, from the input that takes it, and `diffuse` of the surface."""
        del node
        return source_of(place, color), BLACK

    def emitted(self, color: bpy.types.NodeSocket, place: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        """Return the color of what glows, from the input that takes it."""
        return source_of(place, color)

    def _scaled(
        self, node: bpy.types.Node, color: str, strength: str, place: bpy.types.NodeTree
    ) -> tuple[bpy.types.NodeSocket, bool]:
        """Return color × strength of two inputs, and whether it is not the constant 0."""
        inputs = node.inputs[color], node.inputs[strength]
        glows = all(_varies(socket) or default_rgb(socket).any() for socket in inputs)
        scaled = place.nodes.new("ShaderNodeVectorMath")
        scaled.operation = "SCALE"
        place.links.new(self.emitted(inputs[0], place), scaled.inputs["Vector"])
        place.links.new(source_of(place, inputs[1]), scaled.inputs["Scale"])
        return scaled.outputs["Vector"], glows

    def _grouped(self, node: bpy.types.Node, identifier: str) -> SurfaceSockets:
        """Read a shader inside a node group, through outputs added to a copy of the group."""
        if not any(n.type == "GROUP_OUTPUT" and n.is_active_output for n in node.node_tree.nodes):
            return self.not_understood(node)
        if not is_copied_group(node.node_tree):
            group = node.node_tree.copy()
            mark_made(group)
            group[ORIGINAL] = node.node_tree
            node.node_tree = group
        group = node.node_tree
        result = next(n for n in group.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output)
        inner = self.shader(socket_by_identifier(result.inputs, identifier), group)

        def outward(source: ColorSource | FloatSource, name: str) -> Any:
            """Pass an inner socket through the group's border; constants need not."""
            if not isinstance(source, bpy.types.NodeSocket):
                return source
            kind = "NodeSocketFloat" if name == "Alpha" else "NodeSocketColor"
            declared = group.interface.new_socket(name, in_out="OUTPUT", socket_type=kind)
            group[SOCKETS] = [*group.get(SOCKETS, ()), declared.identifier]
            group.links.new(source, socket_by_identifier(result.inputs, declared.identifier))
            return socket_by_identifier(node.outputs, declared.identifier)

        base, emission, alpha = (
            outward(inner.base, "Base Color"),
            outward(inner.emission, "Emission"),
            outward(inner.alpha, "Alpha"),
        )
        return SurfaceSockets(base, emission, alpha, inner.glows, outward(inner.diffuse, "Diffuse Color"))


def _alpha(tree: bpy.types.NodeTree, node: bpy.types.Node) -> FloatSource:
    """Return a node's alpha; a constant 0 or 1 stays one, as it takes other shaders."""
    socket = node.inputs["Alpha"]
    if not socket.is_linked and not is_keyed(socket) and socket.default_value in (0.0, 1.0):
        return float(socket.default_value)
    return source_of(tree, socket)


def source_of(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Return the output that feeds an input: where nothing does, that of a new node with its constant.

    The new node feeds the input too, unless muted links or nodes do in vain, or it is animated: then the
    node follows it (`followed_values.py`).
    """
    feed = feed_of(socket, enter_groups=False)
    if feed.node is not None:
        return feed.socket
    is_color = socket.type == "RGBA"
    node = tree.nodes.new("ShaderNodeRGB" if is_color else "ShaderNodeValue")
    node.name = node.label = socket.name
    node.location = (socket.node.location.x - 220, socket.node.location.y)
    output = node.outputs[0]
    output.default_value = socket.default_value
    if socket.is_linked or is_keyed(socket):
        node[FOLLOWS] = [socket.node.name, socket.identifier]
    else:
        node[VALUE] = list(output.default_value) if is_color else [output.default_value]
        tree.links.new(output, socket)
    return output


def _varies(socket: bpy.types.NodeSocket) -> bool:
    """Whether something feeds or animates a socket that is not a constant of ours."""
    node = feed_of(socket, enter_groups=False).node
    return is_keyed(socket) if node is None else node.get(VALUE) is None


def _mixed(
    tree: bpy.types.NodeTree, factor: FloatSource, first: SurfaceSockets, second: SurfaceSockets
) -> SurfaceSockets:
    """Mix two surfaces; one that is wholly transparent lends no base color."""
    base = _mix_colors(tree, factor, first.base, second.base)
    diffuse = _mix_colors(tree, factor, first.diffuse, second.diffuse)
    if first.alpha == 0.0:
        base, diffuse = second.base, second.diffuse
    elif second.alpha == 0.0:
        base, diffuse = first.base, first.diffuse
    emission = _mix_colors(tree, factor, first.emission, second.emission)
    alpha = _mix_floats(tree, factor, first.alpha, second.alpha)
    return SurfaceSockets(base, emission, alpha, first.glows or second.glows, diffuse)


def _added(tree: bpy.types.NodeTree, first: SurfaceSockets, second: SurfaceSockets) -> SurfaceSockets:
    """Add two surfaces, as a diffuse shader plus an emission; one opaque makes both opaque."""
    alpha = second.alpha if first.alpha == 0.0 else first.alpha
    base, emission, diffuse = (
        _add_colors(tree, first.base, second.base),
        _add_colors(tree, first.emission, second.emission),
        _add_colors(tree, first.diffuse, second.diffuse),
    )
    return SurfaceSockets(base, emission, alpha, first.glows or second.glows, diffuse)


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
