"""Write the values of a node tree or material into another one that has the same nodes."""

from __future__ import annotations

from typing import Any

import bpy

from ..material_copies.copy_marks import (
    COPY_MARKS,
    FOLLOWS,
    NODE_MARKS,
    VALUE,
    behind_ours,
    followed_socket,
    is_copied_group,
)
from ..material_copies.material_digest import (
    OUTPUTS_WITH_VALUES,
    animation_of,
    links_of,
    properties_of_material,
    properties_of_node,
)


def write_material(target: bpy.types.Material, source: bpy.types.Material) -> bool:
    """Give a material what another one holds; False, with some of it done, where that takes other nodes."""
    if not write_tree(target.node_tree, source.node_tree):
        return False
    return write_settings(target, source)


def write_settings(target: bpy.types.Material, source: bpy.types.Material) -> bool:
    """Give a material what another one holds besides nodes; False where Blender refuses some of it."""
    _write_custom(target, source, COPY_MARKS)
    return _attempt(lambda: _write(target, source, properties_of_material(source)))


def write_tree(target: bpy.types.NodeTree, source: bpy.types.NodeTree) -> bool:
    """Give a tree the values of another one; False, with some of it done, where that takes other nodes."""
    if {n.name: n.bl_idname for n in target.nodes} != {n.name: n.bl_idname for n in source.nodes}:
        return False
    if links_of(target) != links_of(source) or animation_of(target) != animation_of(source):
        return False

    return _attempt(lambda: all(_write_node(node, source.nodes[node.name]) for node in target.nodes))


def take_values(
    copy: bpy.types.NodeTree, original: bpy.types.NodeTree, sockets: set[str] | None = None
) -> None:
    """Give the constants of a lightmap copy's tree the values that those of its original have now.

    copy, original: Of a material, or a node group.
    sockets set of str, optional: The names of the inputs that count; all of them by default.
    """
    for node in original.nodes:
        twin = copy.nodes.get(node.name)
        if twin is None or twin.bl_idname != node.bl_idname:
            continue
        if node.type == "GROUP" and is_copied_group(twin.node_tree) and node.node_tree is not None:
            take_values(twin.node_tree, node.node_tree, sockets)
        for socket, copied in zip(node.inputs, twin.inputs, strict=False):
            if (sockets is None or socket.name in sockets) and hasattr(socket, "default_value"):
                _take(copied, socket.default_value)
        if sockets is None and node.type in OUTPUTS_WITH_VALUES:
            _set(twin.outputs[0], node.outputs[0].default_value)
    for node in copy.nodes:
        socket = None if node.get(FOLLOWS) is None else followed_socket(original, node)
        if socket is not None and (sockets is None or socket.name in sockets):
            _set(node.outputs[0], socket.default_value)


def _take(copied: bpy.types.NodeSocket, value: Any) -> None:
    """Set a copy's constant, and the node of ours that stands for it."""
    reader = behind_ours(copied)
    if reader.is_linked:
        node = reader.links[0].from_node
        if node.get(VALUE) is not None:
            node[VALUE] = list(value) if hasattr(value, "__len__") else [value]
            _set(node.outputs[0], value)
        elif node.get(FOLLOWS) is None:
            return
    elif reader != copied:
        _set(reader, value)
    _set(copied, value)


def _set(socket: bpy.types.NodeSocket, value: Any) -> None:
    if not _equal(socket.default_value, value):
        socket.default_value = value


def _attempt(write: Any) -> bool:
    try:
        return bool(write())
    except (AttributeError, TypeError, ValueError, RuntimeError):
        return False  # something that Blender does not let us set


def _write_node(target: bpy.types.Node, source: bpy.types.Node) -> bool:
    target.label, target.mute = source.label, source.mute
    if not _write(target, source, properties_of_node(source)):
        return False
    if [s.identifier for s in target.inputs] != [s.identifier for s in source.inputs]:
        return False
    pairs = list(zip(target.inputs, source.inputs, strict=True))
    if source.type in OUTPUTS_WITH_VALUES:
        pairs += zip(target.outputs, source.outputs, strict=True)
    for copied, original in pairs:
        if hasattr(original, "default_value"):
            _set(copied, original.default_value)
    _write_custom(target, source, NODE_MARKS)
    return True


def _write(target: Any, source: Any, names: tuple[str, ...]) -> bool:
    """Write properties of a struct, those of structs in it included; False where lists differ in length."""
    for name in names:
        old, new = getattr(target, name), getattr(source, name)
        kind = source.bl_rna.properties[name].type
        if kind == "COLLECTION":
            if len(old) != len(new) and not _resize(old, new):
                return False
            if not all(
                _write(one, other, properties_of_node(other)) for one, other in zip(old, new, strict=True)
            ):
                return False
        elif kind == "POINTER" and not isinstance(new or old, bpy.types.ID):
            if new is not None and (old is None or not _write(old, new, properties_of_node(new))):
                return False
        elif not _equal(old, new):
            setattr(target, name, new)
    if isinstance(target, bpy.types.CurveMapping):
        target.update()
    return True


def _resize(old: Any, new: Any) -> bool:
    """Bring the points of a color ramp or curve to a number; False for other lists."""
    kind = type(new[0]).__name__ if len(new) else ""
    if kind not in ("ColorRampElement", "CurveMapPoint"):
        return False
    while len(old) > len(new):
        old.remove(old[-1])
    while len(old) < len(new):
        old.new(1.0) if kind == "ColorRampElement" else old.new(1.0, 1.0)
    return True


def _write_custom(target: Any, source: Any, marks: tuple[str, ...]) -> None:
    without = {*marks, *source.bl_rna.properties.keys()}
    wanted = set(source.keys())
    for key in set(target.keys()) - wanted - without:
        del target[key]
    for key in wanted - without:
        target[key] = source[key]


def _equal(old: Any, new: Any) -> bool:
    if hasattr(old, "__len__") and hasattr(new, "__len__") and not isinstance(old, (str, set)):
        return len(old) == len(new) and all(_equal(a, b) for a, b in zip(old, new, strict=True))
    return bool(old == new)
