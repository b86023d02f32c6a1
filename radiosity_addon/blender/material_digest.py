"""Digests of all that a user can edit in a material or a node group: equal ones look equal and work equally.

Names, places of nodes, selections and panels that are open do not count. Node groups and images count by name.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import lru_cache
from typing import Any, TypeAlias

import bpy

from .copy_marks import (
    COPY_MARKS,
    FED,
    NODE_MARKS,
    ORIGINAL,
    is_added,
    is_copied_group,
)
from .keyed_paths import curves
from .materials import uses_nodes
from .node_group import BASE_COLOR, EMISSION

Reader: TypeAlias = Callable[[Any], Any]

_SIMPLE = frozenset((bool, int, float, str, type(None)))
_OUTPUTS_WITH_VALUES = {"RGB", "VALUE", "NORMAL"}

_NOT_CONTENT = frozenset(
    (
        "rna_type", "name", "use_fake_user", "use_extra_user", "is_runtime_data", "tag", "use_nodes",
        "node_tree", "animation_data", "asset_data", "preview", "grease_pencil", "lineart", "library",
        "library_weak_reference", "override_library", "original", "texture_paint_images",
        "texture_paint_slots", "paint_active_slot", "paint_clone_slot", "preview_render_type",
        "use_preview_world", "select", "parent", "index", "position", "frame_current", "inspection_index",
        "paired_output", "internal_links", "inputs", "outputs",
    )
)  # fmt: skip


def digest(material: bpy.types.Material, as_copy: bool = False) -> str:
    """Return the digest of a material.

    Parameters
    ----------
    material : Material
    as_copy : bool
        It is a lightmap copy: our copies of node groups count as those they are of, and of the nodes that we
        added only their links and what the user can set.
    """
    content = [_read(material, _NOT_CONTENT), _custom(material, COPY_MARKS), _animation(material)]
    if uses_nodes(material):
        content.append(_tree(material.node_tree, as_copy))
    return _hash(content)


def tree_digest(tree: bpy.types.NodeTree, as_copy: bool = False) -> str:
    """Return the digest of a node group, as `digest`."""
    return _hash([_interface(tree), _custom(tree, COPY_MARKS), _tree(tree, as_copy)])


def links_of(tree: bpy.types.NodeTree) -> list[tuple[str, str, str, str, bool]]:
    """Return the links of a tree, by names of nodes and identifiers of sockets, sorted."""
    return sorted(
        (
            link.from_node.name,
            link.from_socket.identifier,
            link.to_node.name,
            link.to_socket.identifier,
            link.is_muted,
        )
        for link in tree.links
    )


def properties_of_material(material: bpy.types.Material) -> tuple[str, ...]:
    """Return the names of a material's properties that count."""
    return tuple(name for name, _ in _readers(type(material), _NOT_CONTENT))


def properties_of_node(struct: bpy.types.bpy_struct) -> tuple[str, ...]:
    """Return the names of the properties of a node, or of a struct in it, that count."""
    without = _BASE_NODE if isinstance(struct, bpy.types.Node) else _NOT_CONTENT - {"name"}
    return tuple(name for name, _ in _readers(type(struct), without))


def animation_of(tree: bpy.types.NodeTree) -> Any:
    """Return what moves a tree's values, as plain data."""
    return _animation(tree)


def _hash(content: Any) -> str:
    return hashlib.blake2b(repr(content).encode("utf-8", "surrogatepass"), digest_size=16).hexdigest()


def _tree(tree: bpy.types.NodeTree, as_copy: bool) -> list[Any]:
    nodes = [_node(node, as_copy) for node in sorted(tree.nodes, key=lambda node: node.name)]
    return [nodes, links_of(tree), _animation(tree)]


def _node(node: bpy.types.Node, as_copy: bool) -> list[Any]:
    kind = node.type
    if as_copy and is_added(node):
        value = list(_plain(node.outputs[0].default_value)) if kind == "RGB" else None
        if kind == "VALUE":
            value = [node.outputs[0].default_value]
        if node.get(FED) is not None:
            value = [list(node.inputs[name].default_value) for name in (BASE_COLOR, EMISSION)]
        return [node.name, kind, value]
    content = [node.name, node.bl_idname, node.label, node.mute]
    for identifier, read in _readers(type(node), _BASE_NODE):
        value = getattr(node, identifier)
        if as_copy and kind == "GROUP" and identifier == "node_tree" and is_copied_group(value):
            value = value[ORIGINAL]
        content.append(read(value))
    content.append([(socket.identifier, _value(socket)) for socket in node.inputs])
    if kind in _OUTPUTS_WITH_VALUES:
        content.append([_value(socket) for socket in node.outputs])
    if node.keys():
        content.append(_custom(node, NODE_MARKS))
    return content


_BASE_NODE = frozenset(prop.identifier for prop in bpy.types.Node.bl_rna.properties) | _NOT_CONTENT - {"node_tree"}


def _value(socket: bpy.types.NodeSocket) -> Any:
    value = getattr(socket, "default_value", None)
    return value if type(value) in _SIMPLE else _plain(value)


def _interface(tree: bpy.types.NodeTree) -> list[Any]:
    return [[item.item_type, item.name, _read(item, _NOT_CONTENT)] for item in tree.interface.items_tree]


def _custom(owner: Any, marks: tuple[str, ...]) -> list[tuple[str, Any]]:
    """Return the custom properties, but for ours and those that are registered."""
    known = owner.bl_rna.properties
    return [(key, _plain(owner[key])) for key in sorted(owner.keys()) if key not in marks and key not in known]


def _animation(owner: bpy.types.ID) -> Any:
    data = owner.animation_data
    if data is None or (data.action is None and not data.drivers and not data.nla_tracks):
        return None
    action = None if data.action is None else data.action.name_full
    moved = sorted((curve.data_path, curve.array_index) for curve in curves(owner))
    drivers = sorted(
        repr((curve.data_path, curve.array_index, curve.mute, _read(curve.driver, _NOT_CONTENT - {"name"})))
        for curve in data.drivers
    )
    return [action, moved, drivers, [track.name for track in data.nla_tracks]]


def _read(struct: Any, without: frozenset[str]) -> list[tuple[str, Any]]:
    """Return what a struct's properties hold."""
    return [(name, read(getattr(struct, name))) for name, read in _readers(type(struct), without)]


def _readers(kind: type, without: frozenset[str]) -> tuple[tuple[str, Reader], ...]:
    # Properties can be registered at any time.
    return _readers_of(kind, without, len(kind.bl_rna.properties))


@lru_cache(maxsize=None)
def _readers_of(kind: type, without: frozenset[str], _: int) -> tuple[tuple[str, Reader], ...]:
    """Return the properties of a kind of struct that count, and how each is read."""
    found: list[tuple[str, Reader]] = []
    for prop in kind.bl_rna.properties:
        name = prop.identifier
        if name in without or name.startswith(("active_", "show_", "bl_")):
            continue
        if prop.type == "COLLECTION":
            found.append((name, _items))
        elif prop.type == "POINTER":
            found.append((name, _pointer))
        elif not prop.is_readonly:
            found.append((name, _plain if getattr(prop, "is_array", False) or prop.type == "ENUM" else _same))
    return tuple(found)


def _same(value: Any) -> Any:
    return value


def _items(values: Any) -> list[Any]:
    return [_pointer(value) for value in values]


def _pointer(value: Any) -> Any:
    if value is None or isinstance(value, (bpy.types.ID, bpy.types.Node, bpy.types.NodeSocket)):
        return _plain(value)
    return _read(value, _NOT_CONTENT - {"name"})


def _plain(value: Any) -> Any:
    """Return a value of a property as plain data."""
    if type(value) in _SIMPLE:
        return value
    if type(value) is bpy.types.bpy_prop_array and not isinstance(value[0], bpy.types.bpy_prop_array):
        return value[:]
    if isinstance(value, bpy.types.ID):
        return (value.id_type, value.name_full)
    if isinstance(value, bpy.types.bpy_struct):
        return getattr(value, "name", "")
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    if hasattr(value, "to_dict"):
        return repr(value.to_dict())
    return [_plain(item) for item in value]
