"""Have lightmaps follow keyframes and drivers: by drivers of ours that read the original's values.

They cannot read the copy's own: in one tree, Blender takes that for a cycle.
"""

from __future__ import annotations

import bpy

from ..datablocks.bake_record import ORIGINAL
from ..datablocks.keyed_paths import curves, is_keyed, path_of
from .copy_marks import FOLLOWS, copied_groups, followed_socket, is_added


def follow_keys(copy: bpy.types.Material) -> None:
    """Have the nodes of ours in a lightmap copy follow the keyframes and drivers of what they stand for."""
    original = copy.get(ORIGINAL)
    if original is not None:
        _follow(copy.node_tree, original, "MATERIAL", "node_tree.")
    for group in dict.fromkeys(copied_groups(copy.node_tree)):
        _follow(group, group[ORIGINAL], "NODETREE", "")


def overruled(tree: bpy.types.NodeTree) -> list[str]:
    """Return the nodes of ours that follow an animated value, and that the user animated all the same."""
    return [
        node.name
        for node in tree.nodes
        if node.get(FOLLOWS) is not None and is_added(node) and any(map(_is_users, _curves_of(tree, node)))
    ]


def _curves_of(tree: bpy.types.NodeTree, node: bpy.types.Node) -> list[bpy.types.FCurve]:
    path = path_of(node.outputs[0])
    return [curve for curve in curves(tree) if curve.data_path == path]


def _is_users(curve: bpy.types.FCurve) -> bool:
    """Whether a curve of a node that follows is not the driver of ours."""
    driver = curve.driver
    return driver is None or driver.type != "AVERAGE" or len(driver.variables) != 1


def is_animated(tree: bpy.types.NodeTree) -> bool:
    """Whether keyframes or drivers move any value of a tree, or of a group in it."""
    inner = {node.node_tree for node in tree.nodes if node.type == "GROUP" and node.node_tree is not None}
    return any(True for _ in curves(tree)) or any(map(is_animated, inner))


def _follow(tree: bpy.types.NodeTree, source: bpy.types.ID, kind: str, prefix: str) -> None:
    """Have a tree's nodes follow; `source` owns the original tree, at `prefix`."""
    for node in tree.nodes:
        socket = followed_socket(tree, node) if node.get(FOLLOWS) is not None else None
        if socket is None or not is_keyed(socket):
            continue
        curves = node.outputs[0].driver_add("default_value")
        for index, curve in enumerate(curves if isinstance(curves, list) else [curves]):
            curve.driver.type = "AVERAGE"  # of one variable: no script, which files may not run
            target = curve.driver.variables.new().targets[0]
            target.id_type, target.id = kind, source
            component = f"[{index}]" if isinstance(curves, list) else ""
            target.data_path = f"{prefix}{path_of(socket)}{component}"
