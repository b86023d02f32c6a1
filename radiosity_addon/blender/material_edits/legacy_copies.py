"""Lightmap copies of earlier versions: without a record, what the lightmap added is recognized by its kind.

The lightmap's node holds the constants of base color and emission, and the shader is not linked.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..datablocks.bake_record import ORIGINAL, is_made
from ..images.node_group import BASE_COLOR, EMISSION, SHADER
from ..material_copies.copy_marks import COPY_MARKS, STATE
from ..material_copies.material_digest import digest_of_material
from ..materials.materials import DEFAULT_GRAY
from ..materials.shader_nodes import feed_of
from .stripping import COLOR_INPUTS

_OURS = {"UVMAP", "MIX", "VECT_MATH", "MATH", "COMBXYZ", "MIX_SHADER", "BSDF_TRANSPARENT"}
"""Kinds of nodes that were added, besides images and groups of ours."""

Constants = tuple[np.ndarray, np.ndarray]
"""Base color and emission."""


def is_legacy(copy: bpy.types.Material) -> bool:
    """Whether a lightmap copy is one without a record."""
    return copy.get(STATE) is None


def was_edited(copy: bpy.types.Material) -> tuple[bpy.types.Material, bool]:
    """Return a new material with what a copy holds without the lightmap, and whether the user edited it.

    Where they differ, and the copy's shader agrees with the constants in the lightmap's node, the original
    was edited and not the copy. In doubt the copy was.
    """
    original = copy.get(ORIGINAL)
    stripped = copy.copy()
    shown = _shown(stripped.node_tree)
    tree = None if original is None else original.node_tree
    _strip(stripped, tree)
    for name in COPY_MARKS:
        stripped.pop(name, None)
    if original is None:
        return stripped, _was_plain_edited(stripped.node_tree, shown)
    if hasattr(stripped, "cycles") and stripped.cycles.emission_sampling == "NONE":
        stripped.cycles.emission_sampling = original.cycles.emission_sampling
    own, wanted = _constants(stripped.node_tree), _constants(tree)
    agrees = shown is None or own is None or _are_close(own, shown)
    if not agrees and own is not None and _are_close(own, wanted):
        _set_constants(stripped.node_tree, own, shown)  # the node was edited, which shows
    if digest_of_material(stripped) == digest_of_material(original):
        return stripped, False
    if not agrees or own is None or wanted is None:
        return stripped, True
    as_original = stripped.copy()
    _set_constants(as_original.node_tree, own, wanted, _main(tree))
    only_original = digest_of_material(as_original) == digest_of_material(original)
    bpy.data.materials.remove(as_original)
    return stripped, not only_original


def _lightmap_nodes(tree: bpy.types.NodeTree) -> list[bpy.types.Node]:
    return [
        node
        for node in tree.nodes
        if node.type == "GROUP"
        and node.node_tree is not None
        and is_made(node.node_tree)
        and EMISSION in node.inputs
        and SHADER in node.outputs
    ]


def _shown(tree: bpy.types.NodeTree) -> Constants | None:
    """Return the constants in the lightmap's node; None where something is linked to it."""
    for node in _lightmap_nodes(tree):
        base, emission = node.inputs[BASE_COLOR], node.inputs[EMISSION]
        if not base.is_linked and not emission.is_linked:
            return np.array(base.default_value[:3]), np.array(emission.default_value[:3])
    return None


def _main(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """Return the shader at a tree's output, if its constants were written into the lightmap's node."""
    for output in tree.nodes:
        if output.type == "OUTPUT_MATERIAL":
            node = feed_of(output.inputs["Surface"], enter_groups=False).node
            if node is not None and node.type in COLOR_INPUTS:
                return node
    return None


def _constants(tree: bpy.types.NodeTree) -> Constants | None:
    """Return base color and emission of the shader at a tree's output; None where they are no constants."""
    node = _main(tree)
    if node is None:
        return None
    base, color, strength = (None if name is None else node.inputs[name] for name in COLOR_INPUTS[node.type])
    if any(socket is not None and socket.is_linked for socket in (base, color, strength)):
        return None
    reflected = np.zeros(3) if base is None else np.array(base.default_value[:3])
    if color is None or strength is None:
        return reflected, np.zeros(3)
    return reflected, np.array(color.default_value[:3]) * strength.default_value


def _are_close(one: Constants | None, other: Constants | None) -> bool:
    if one is None or other is None:
        return False
    return all(np.allclose(a, b, rtol=1e-5, atol=1e-7) for a, b in zip(one, other, strict=True))


def _set_constants(
    tree: bpy.types.NodeTree, own: Constants, wanted: Constants | None, of: bpy.types.Node | None = None
) -> None:
    """Give the shader at a tree's output other constants: those of a node, where there is one."""
    node = _main(tree)
    if node is None or wanted is None:
        return
    for name in filter(None, COLOR_INPUTS[node.type]):
        if of is not None and of.type == node.type:
            node.inputs[name].default_value = of.inputs[name].default_value
    if of is not None:
        return
    base, color, strength = COLOR_INPUTS[node.type]
    if base is not None and not np.allclose(own[0], wanted[0]):
        node.inputs[base].default_value = (*wanted[0], 1.0)
    if color is not None and not np.allclose(own[1], wanted[1]):
        node.inputs[color].default_value = (*wanted[1], 1.0)
        node.inputs[strength].default_value = 1.0


def _strip(material: bpy.types.Material, original: bpy.types.NodeTree | None) -> None:
    """Remove what the lightmap added, and connect what is left as it is in the original."""
    tree = material.node_tree
    known = set() if original is None else {node.name for node in original.nodes}
    added = [node for node in _behind(tree) if node.name not in known]
    added += [n for n in tree.nodes if n.type == "COMBXYZ" and n.name not in known and _is_origin(n)]
    targets = {
        (link.to_node.name, link.to_socket.identifier)
        for link in tree.links
        if link.from_node in added and link.to_node not in added
    }
    for node in dict.fromkeys(added):
        tree.nodes.remove(node)
    for link in () if original is None else original.links:
        source, target = tree.nodes.get(link.from_node.name), tree.nodes.get(link.to_node.name)
        if (link.to_node.name, link.to_socket.identifier) in targets and source is not None:
            _link(tree, source, link.from_socket.identifier, target, link.to_socket.identifier, link.is_muted)
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree is not None and is_made(node.node_tree):
            twin = None if original is None else original.nodes.get(node.name)
            if twin is not None and twin.type == "GROUP":
                node.node_tree = twin.node_tree


def _behind(tree: bpy.types.NodeTree) -> list[bpy.types.Node]:
    """Return the lightmap's nodes and those of our kinds on the way to and from them."""
    found = _lightmap_nodes(tree)
    for node in found:  # grows
        for socket in (*node.inputs, *node.outputs):
            for link in socket.links:
                other = link.from_node if link.to_node == node else link.to_node
                if other not in found and _is_our_kind(other):
                    found.append(other)
    return found


def _is_our_kind(node: bpy.types.Node) -> bool:
    if node.type == "GROUP":
        return node.node_tree is not None and is_made(node.node_tree)
    if node.type == "TEX_IMAGE":
        return node.image is not None and is_made(node.image)
    return node.type in _OURS


def _is_origin(node: bpy.types.Node) -> bool:
    return not any(socket.is_linked or socket.default_value for socket in node.inputs)


def _link(
    tree: bpy.types.NodeTree,
    source: bpy.types.Node,
    out: str,
    target: bpy.types.Node,
    into: str,
    is_muted: bool,
) -> None:
    first = next((socket for socket in source.outputs if socket.identifier == out), None)
    second = next((socket for socket in target.inputs if socket.identifier == into), None)
    if first is not None and second is not None:
        tree.links.new(first, second).is_muted = is_muted


def _was_plain_edited(tree: bpy.types.NodeTree, shown: Constants | None) -> bool:
    """Whether a copy of no material was edited; it then gets a shader of the color that it shows."""
    others = [node for node in tree.nodes if node.type != "OUTPUT_MATERIAL"]
    plain = shown is not None and _are_close(shown, (np.full(3, DEFAULT_GRAY), np.zeros(3)))
    outputs = [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]
    if shown is not None and outputs and not outputs[0].inputs["Surface"].is_linked:
        shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
        shader.inputs["Color"].default_value = (*shown[0], 1.0)
        tree.links.new(shader.outputs[0], outputs[0].inputs["Surface"])
    return bool(others) or not plain
