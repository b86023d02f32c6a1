"""Emission of the materials that show lightmaps, brought up to that of the originals."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import bpy

from ..solver.radiometry import radiance_of_radiosity
from .bake_record import is_made
from .lightmap_materials import ORIGINAL
from .materials import read_material, uses_nodes
from .node_group import EMISSION
from .surface_nodes import Surface, feed_color, feeding_socket, read_surface


def refresh(names: Collection[str]) -> None:
    """Have the lightmap copies of some materials glow as their originals do.

    The copies still hold the originals' nodes: their values are taken over, and what they make of the
    emission is fed to the lightmap's node anew.

    Parameters
    ----------
    names : collection of str
        Of the originals whose emission has changed.
    """
    for copy, original in lightmap_copies(names):
        if not uses_nodes(original):
            continue
        tree = copy.node_tree
        _take_values(tree, original.node_tree)
        radiance = radiance_of_radiosity(read_material(original).emission)
        plain = Surface((0.0, 0.0, 0.0), tuple(radiance.tolist()))
        for output in original.node_tree.nodes:
            source = feeding_socket(output.inputs["Surface"]) if output.type == "OUTPUT_MATERIAL" else None
            node = _lightmap_node(tree.nodes.get(output.name)) if source is not None else None
            if source is None or node is None or not _shows_emission(node):
                continue
            probe = tree.nodes.new("NodeReroute")
            twin = tree.nodes[source.node.name].outputs
            tree.links.new(next(s for s in twin if s.identifier == source.identifier), probe.inputs[0])
            surface = read_surface(tree, probe.inputs[0], plain)
            for link in node.inputs[EMISSION].links:
                tree.links.remove(link)
            feed_color(tree, node.inputs[EMISSION], surface.emission)
            tree.nodes.remove(probe)


def show_emission(names: Collection[str]) -> None:
    """Have the copies of some materials glow as their originals do, as far as a constant can say it: fast."""
    for copy, original in lightmap_copies(names):
        radiance = radiance_of_radiosity(read_material(original).emission)
        for node in copy.node_tree.nodes:
            if _shows_emission(node) and not node.inputs[EMISSION].is_linked:
                node.inputs[EMISSION].default_value = (*radiance.tolist(), 1.0)


def lightmap_copies(names: Collection[str]) -> Iterator[tuple[bpy.types.Material, bpy.types.Material]]:
    """Yield the lightmap copies of the materials of these names, and the originals."""
    for copy in [block for block in bpy.data.materials if is_made(block) and block.node_tree is not None]:
        original = copy.get(ORIGINAL)
        if original is not None and original.name in names:
            yield copy, original


def _take_values(tree: bpy.types.NodeTree, of: bpy.types.NodeTree) -> None:
    """Give the inputs of a copied tree's nodes the values that those of its original have now."""
    for node in of.nodes:
        twin = tree.nodes.get(node.name)
        if twin is None or twin.bl_idname != node.bl_idname:
            continue
        for socket, copied in zip(node.inputs, twin.inputs, strict=False):
            if hasattr(socket, "default_value") and not copied.is_linked:
                copied.default_value = socket.default_value
        for socket, copied in zip(node.outputs, twin.outputs, strict=False):
            if node.type in {"RGB", "VALUE"}:
                copied.default_value = socket.default_value


def _lightmap_node(output: bpy.types.Node | None) -> bpy.types.Node | None:
    """Return the node that shows the lightmap at a material output, itself or behind a Mix Shader."""
    source = None if output is None else feeding_socket(output.inputs["Surface"])
    if source is not None and source.node.type == "MIX_SHADER":
        source = feeding_socket(source.node.inputs[2])
    return None if source is None else source.node


def _shows_emission(node: bpy.types.Node) -> bool:
    return node.type == "GROUP" and EMISSION in node.inputs
