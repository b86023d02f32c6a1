"""Keep images where they are on an object that had no UV layer and gets its first one.

Without any layer a node that reads "the active UVs" reads (0, 0, 0); with `Lightmap` as the
only layer it would suddenly read that. In the material's copy such nodes are fed the
constant they used to read.
"""

from __future__ import annotations

import bpy

from .bake_record import mark_made


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
    origin = None
    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree is not None and reads_active_uvs(node.node_tree):
            group = node.node_tree
            if group not in copies:
                copies[group] = group.copy()
                mark_made(copies[group])
                _pin(copies[group], copies)
            node.node_tree = copies[group]
        elif _is_reader(node):
            origin = origin or tree.nodes.new("ShaderNodeCombineXYZ")
            _feed(tree, node, origin.outputs["Vector"])


def _feed(tree: bpy.types.NodeTree, node: bpy.types.Node, origin: bpy.types.NodeSocket) -> None:
    """Put the constant in the place of what the node reads."""
    if node.type == "TEX_IMAGE":
        tree.links.new(origin, node.inputs["Vector"])
        return
    output = node.outputs["UV"]
    for link in list(output.links):
        tree.links.new(origin, link.to_socket)
