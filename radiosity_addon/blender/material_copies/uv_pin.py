"""Keep images where they are on an object that had no UV layer and gets its first one.

Without any layer a node that reads "the active UVs" reads (0, 0, 0); with `Lightmap` as the
only layer it would suddenly read that. In the material's copy what such nodes read is
multiplied by 0.
"""

from __future__ import annotations

import bpy

from ..datablocks.bake_record import ORIGINAL, mark_made
from .copy_marks import THROUGH


def pin_uvs(tree: bpy.types.NodeTree) -> None:
    """Feed (0, 0, 0) to all that reads the active UV layer in `tree` and the groups it uses.

    Groups that read it are replaced by pinned copies; `tree` itself is edited.
    """
    _pin(tree, {})


def reads_active_uvs(tree: bpy.types.NodeTree) -> bool:
    """Whether the tree, or a group in it, reads the active UV layer."""
    return any(
        _is_reader(node)
        or (node.type == "GROUP" and node.node_tree is not None and reads_active_uvs(node.node_tree))
        for node in tree.nodes
    )


def _is_reader(node: bpy.types.Node) -> bool:
    """Whether this very node reads the active UV layer."""
    if node.type == "TEX_IMAGE":
        return not node.inputs["Vector"].is_linked
    if node.type == "UVMAP":
        return node.uv_map == "" and not node.from_instancer
    if node.type == "TEX_COORD":
        return node.outputs["UV"].is_linked and not node.from_instancer
    return False


def _pin(tree: bpy.types.NodeTree, copies: dict[bpy.types.NodeTree, bpy.types.NodeTree]) -> None:
    """Pin one tree; `copies` holds the pinned copies of groups made so far."""
    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree is not None and reads_active_uvs(node.node_tree):
            group = node.node_tree
            if group not in copies:
                copies[group] = group.copy()
                mark_made(copies[group])
                copies[group][ORIGINAL] = group
                _pin(copies[group], copies)
            node.node_tree = copies[group]
        elif node.type == "TEX_IMAGE" and _is_reader(node):
            origin = tree.nodes.new("ShaderNodeCombineXYZ")
            origin.location = (node.location.x - 220, node.location.y - 200)
            tree.links.new(origin.outputs["Vector"], node.inputs["Vector"])
        elif _is_reader(node):
            _zero(tree, node.outputs["UV"])


def _zero(tree: bpy.types.NodeTree, output: bpy.types.NodeSocket) -> None:
    """Put a node between an output and all that it feeds which makes zeros of it."""
    links = list(output.links)
    if not links:
        return
    zero = tree.nodes.new("ShaderNodeVectorMath")
    zero.operation = "MULTIPLY"
    zero.inputs[1].default_value = (0.0, 0.0, 0.0)
    zero.location = (output.node.location.x + 180, output.node.location.y)
    zero[THROUGH] = True
    for link in links:
        target, is_muted = link.to_socket, link.is_muted
        tree.links.new(zero.outputs["Vector"], target).is_muted = is_muted
    tree.links.new(output, zero.inputs[0])
