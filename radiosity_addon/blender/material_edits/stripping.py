"""Take what shows the lightmap out of a copied material: the original is left, as the user edited it."""

from __future__ import annotations

import bpy

from ..datablocks.bake_record import ORIGINAL, is_made
from ..datablocks.keyed_paths import is_keyed, move_keys, path_of
from ..images.node_group import BASE_COLOR, DIFFUSE_COLOR, EMISSION, SHADER, SURFACE
from ..material_copies.copy_marks import (
    COPY_MARKS,
    FED,
    FED_BY,
    NODE_MARKS,
    SAMPLING,
    SOCKETS,
    THROUGH,
    VALUE,
    is_added,
    is_copied_group,
    linked_output,
    passed_input,
    users_inputs,
)
from ..materials.shader_nodes import feed_of

COLOR_INPUTS = {
    "BSDF_PRINCIPLED": ("Base Color", "Emission Color", "Emission Strength"),
    "BSDF_DIFFUSE": ("Color", None, None),
    "EMISSION": (None, "Color", "Strength"),
}
"""Where shaders take base color, emission and its strength."""


def stripped_copy(copy: bpy.types.Material) -> tuple[bpy.types.Material, bool]:
    """Return a new material with what a lightmap copy holds, without the lightmap.

    Returns complete: False if the user fed the lightmap's node with what the shaders cannot take; it stays,
        unconnected.
    """
    material = copy.copy()
    complete = strip_tree(material.node_tree)
    sampling = material.get(SAMPLING)
    if sampling is not None and material.cycles.emission_sampling == "NONE":
        material.cycles.emission_sampling = sampling
    for name in COPY_MARKS:
        material.pop(name, None)
    return material, complete


def stripped_group(copy: bpy.types.NodeTree) -> bpy.types.NodeTree:
    """Return a new node group with what our copy of one holds, without what we added."""
    group = copy.copy()
    added = set(group.get(SOCKETS, ()))
    for item in [item for item in group.interface.items_tree if getattr(item, "identifier", None) in added]:
        group.interface.remove(item)
    strip_tree(group)
    for name in COPY_MARKS:
        group.pop(name, None)
    return group


def strip_tree(tree: bpy.types.NodeTree) -> bool:
    """Remove our nodes from a tree and connect the user's as they were; see `stripped_copy`."""
    complete = True
    for node in [node for node in tree.nodes if is_lightmap_node(node)]:
        complete = _keep_overrides(tree, node) and complete
    for node in [node for node in tree.nodes if VALUE in node.keys() and is_added(node)]:  # noqa: SIM118
        _put_value_back(tree, node)
    added = {node.name for node in tree.nodes if is_added(node)}
    outward = [
        (link.from_socket, link.to_socket)
        for link in tree.links
        if link.from_node.name in added and link.to_node.name not in added
    ]
    for source, target in outward:
        _reconnect(tree, source, target)
    for name in added:
        for output in tree.nodes[name].outputs:
            if is_keyed(output):
                output.driver_remove("default_value")
        tree.nodes.remove(tree.nodes[name])
    for node in tree.nodes:
        if node.type == "GROUP" and is_copied_group(node.node_tree):
            node.node_tree = node.node_tree[ORIGINAL]
        for mark in NODE_MARKS:
            node.pop(mark, None)
    return complete


def is_lightmap_node(node: bpy.types.Node) -> bool:
    """Whether a node is the one that shows the lightmap in a material."""
    if node.type != "GROUP" or node.node_tree is None or not is_made(node.node_tree):
        return False
    return SURFACE in node.inputs and SHADER in node.outputs and EMISSION in node.inputs


def _reconnect(tree: bpy.types.NodeTree, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
    """Give an input of the user's what fed it before we put a node in between."""
    node = _behind_mix(source.node)
    link = target.links[0]
    is_muted = link.is_muted and not is_lightmap_node(node)
    while is_added(node):
        before = passed_input(source) if node.get(THROUGH) else None
        if is_lightmap_node(node):
            before = node.inputs[SURFACE]
        if before is None or not before.is_linked:
            tree.links.remove(link)
            return
        inner = before.links[0]
        is_muted = is_muted or inner.is_muted
        node, source = inner.from_node, inner.from_socket
    tree.links.new(source, target).is_muted = is_muted


def _behind_mix(node: bpy.types.Node) -> bpy.types.Node:
    """Return the node that shows the lightmap, itself or behind the Mix Shader for what is transparent."""
    if node.type == "MIX_SHADER" and node.inputs[2].is_linked:
        return node.inputs[2].links[0].from_node
    return node


def _put_value_back(tree: bpy.types.NodeTree, node: bpy.types.Node) -> None:
    """Put the value of a node of ours into the socket it stands for; one used differently is the user's."""
    output = node.outputs[0]
    targets = list(users_inputs(output))
    if len(targets) > 1 or any(target.type != output.type for target in targets):
        for mark in NODE_MARKS:
            node.pop(mark, None)
        return
    for target in targets:
        before, set_there = list(node[VALUE]), _values(target)
        for link in list(target.links):
            tree.links.remove(link)
        # A script may have set the socket, and the node may still be as it was.
        if _values(output) != before or set_there == before:
            target.default_value = output.default_value
        move_keys(tree, path_of(output), path_of(target))


def _values(socket: bpy.types.NodeSocket) -> list[float]:
    value = socket.default_value
    return list(value) if hasattr(value, "__len__") else [value]


def _keep_overrides(tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
    """Give the shader what the user fed the lightmap's node instead; False where no shader can take it."""
    shader = feed_of(node.inputs[SURFACE], enter_groups=False).node
    base, color, strength = (None,) * 3 if shader is None else COLOR_INPUTS.get(shader.type, (None,) * 3)
    constants, sources = list(node.get(FED, ())), list(node.get(FED_BY, ("", "")))
    complete = True
    for name, wanted, before, source_before in (
        (BASE_COLOR, base, constants[:4], sources[0]),
        (EMISSION, color, constants[4:8], sources[1]),
        *((DIFFUSE_COLOR, base, constants[8:], source) for source in sources[2:]),
    ):
        given = node.inputs[name]
        if given.is_linked and linked_output(given) == source_before:
            continue
        own = None if shader is None or wanted is None else shader.inputs[wanted]
        source = feed_of(given, enter_groups=False)
        if source.node is None:
            if given.is_linked or not before or _values(given) == before:
                continue
        elif is_added(source.node) or _is_extra(source.socket) or _same_feed(own, source.socket):
            continue
        if own is None:
            complete = False
            continue
        for link in list(own.links):
            tree.links.remove(link)
        if source.node is not None:
            tree.links.new(source.socket, own)
        else:
            own.default_value = given.default_value
        if name == EMISSION and shader is not None and strength is not None:
            for link in list(shader.inputs[strength].links):
                tree.links.remove(link)
            shader.inputs[strength].default_value = 1.0
    return complete


def _is_extra(output: bpy.types.NodeSocket) -> bool:
    """Whether an output of a node group is there for us only."""
    tree = output.node.node_tree if output.node.type == "GROUP" else None
    return tree is not None and output.identifier in tree.get(SOCKETS, ())


def _same_feed(own: bpy.types.NodeSocket | None, source: bpy.types.NodeSocket) -> bool:
    return own is not None and feed_of(own, enter_groups=False).socket == source
