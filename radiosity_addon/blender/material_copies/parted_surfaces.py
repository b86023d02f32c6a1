"""Part a material's shaders: the lightmap shows what is diffuse or emitted, the shaders show the rest.

Between a color and its input in the shader comes a node of ours. It is black for what the lightmap shows,
so that no lamp lights it again, and hands the color on to the lightmap.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..images.node_group import BASE_COLOR, DIFFUSE_COLOR
from ..images.shine_group import COLOR, GLOSSY_COLOR, LAYERS, REPLACED, shine_group
from ..materials.shader_terms import GLASS
from .copy_marks import THROUGH
from .surface_nodes import BLACK, ColorSource, SurfaceReader, SurfaceSockets, source_of

_MATTE = ("BSDF_DIFFUSE", "BSDF_TRANSLUCENT", "BSDF_TOON", "SUBSURFACE_SCATTERING", "EEVEE_SPECULAR")
"""Shaders, besides the Principled one, whose color the lightmap lights; others are not diffuse at all."""


class PartedSurfaces(SurfaceReader):
    """Reads the shaders of one material and parts them.

    is_parted: There is none that shows what the lightmap shows, too.
    """

    def __init__(self, unknown: SurfaceSockets) -> None:
        super().__init__(unknown)
        self.is_parted = True
        self._known: dict[tuple[Any, ...], SurfaceSockets] = {}

    def shader(self, socket: bpy.types.NodeSocket, place: bpy.types.NodeTree) -> SurfaceSockets:
        """Read and part what feeds a shader input."""
        key = (place, socket.node.name, socket.identifier)
        return self._once(key, lambda: super(PartedSurfaces, self).shader(socket, place))

    def node(self, node: bpy.types.Node, place: bpy.types.NodeTree) -> SurfaceSockets:
        """Read and part a shader."""
        return self._once((place, node.name), lambda: super(PartedSurfaces, self).node(node, place))

    def not_understood(self, node: bpy.types.Node, /) -> SurfaceSockets:
        """Return what stands for other shaders; only of glass it is known that nothing is diffuse."""
        surface = super().not_understood(node)
        self.is_parted = self.is_parted and node.type in GLASS and not surface.glows
        return surface

    def reflected(
        self, node: bpy.types.Node, color: bpy.types.NodeSocket, place: bpy.types.NodeTree
    ) -> tuple[ColorSource, ColorSource]:
        """Return a shader's base color, and the part of it that the lightmap lights: black in the shader."""
        is_layered = node.type == "BSDF_PRINCIPLED"
        if not is_layered and node.type not in _MATTE:
            return source_of(place, color), BLACK
        parted = _part(place, color)
        for name in LAYERS if is_layered else ():
            if name in REPLACED:
                _put_between(place, parted.inputs[name], parted.outputs[name], node.inputs[name])
            else:
                place.links.new(source_of(place, node.inputs[name]), parted.inputs[name])
        return parted.outputs[BASE_COLOR], parted.outputs[DIFFUSE_COLOR]

    def emitted(self, color: bpy.types.NodeSocket, place: bpy.types.NodeTree) -> bpy.types.NodeSocket:
        """Return the color of what glows, which is black in the shader."""
        return _part(place, color).outputs[BASE_COLOR]

    def _once(self, key: tuple[Any, ...], read: Callable[[], SurfaceSockets]) -> SurfaceSockets:
        """Read once what several shaders or outputs share: a second time its colors are black."""
        if key not in self._known:
            self._known[key] = read()
        return self._known[key]


def _part(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> bpy.types.Node:
    """Put our node between a color and the input that takes it; returns the node."""
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = shine_group()
    node.name, node.label = node.node_tree.name, f"{node.node_tree.name}: {socket.name}"
    node.location = (socket.node.location.x - 200, socket.node.location.y)
    node[THROUGH] = True
    _put_between(tree, node.inputs[COLOR], node.outputs[GLOSSY_COLOR], socket)
    return node


def _put_between(
    tree: bpy.types.NodeTree,
    taken: bpy.types.NodeSocket,
    given: bpy.types.NodeSocket,
    socket: bpy.types.NodeSocket,
) -> None:
    """Have an input of our node take what feeds a socket, or its constant, and an output feed the socket."""
    if socket.type != "SHADER":  # else a color makes it glow
        taken.default_value = socket.default_value
        if not socket.is_linked:
            tree.links.new(source_of(tree, socket), taken)
    for link in list(socket.links):
        tree.links.new(link.from_socket, taken).is_muted = link.is_muted
    tree.links.new(given, socket)
