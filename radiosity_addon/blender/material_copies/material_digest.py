"""Digests of all that a user can edit in a material or a node group.

The name, places of nodes, selections and open panels do not count. Node groups and images count by name.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection
from operator import attrgetter
from typing import Any

import bpy

from ..datablocks.bake_record import ORIGINAL
from ..datablocks.keyed_paths import curves, path_of
from ..datablocks.plain_values import SIMPLE, StructReader, custom_properties, plain
from ..images.node_group import BASE_COLOR, DIFFUSE_COLOR, EMISSION
from ..materials.materials import uses_nodes
from .copy_marks import COPY_MARKS, FED, FOLLOWS, NODE_MARKS, is_added, is_copied_group

_NAME, _IDENTIFIER = attrgetter("name"), attrgetter("identifier")
_LINK = attrgetter(
    "from_node.name", "from_socket.identifier", "to_node.name", "to_socket.identifier", "is_muted"
)
OUTPUTS_WITH_VALUES = {"RGB", "VALUE", "NORMAL"}

_NOT_CONTENT = frozenset(
    (
        "rna_type", "name", "use_fake_user", "use_extra_user", "is_runtime_data", "tag", "use_nodes",
        "node_tree", "animation_data", "asset_data", "preview", "grease_pencil", "lineart", "library",
        "library_weak_reference", "override_library", "original", "texture_paint_images",
        "texture_paint_slots", "paint_active_slot", "paint_clone_slot", "preview_render_type",
        "use_preview_world", "select", "parent", "index", "position", "frame_current", "inspection_index",
        "paired_output", "internal_links", "inputs", "outputs", "is_valid",
    )
)  # fmt: skip

_STRUCTS = StructReader(_NOT_CONTENT - {"name"}, ("active_", "show_", "bl_"))


def digest_of_material(material: bpy.types.Material, as_copy: bool = False) -> str:
    """Return the digest of a material.

    as_copy: It is a lightmap copy: our copies of node groups count as those they are of, and of the nodes
        that we added only their links and what the user can set.
    """
    keyed = frozenset(curve.data_path for curve in curves(material))
    custom = [each for each in custom_properties(material, COPY_MARKS) if f'["{each[0]}"]' not in keyed]
    content = [_STRUCTS.read(material, _NOT_CONTENT | keyed), custom, _animation(material)]
    if uses_nodes(material):
        content.append(_tree(material.node_tree, as_copy))
    # Drivers of a copy read from the copy what those of the original read from that.
    return _hash(content, itself=repr(plain(material)))


def tree_digest(tree: bpy.types.NodeTree, as_copy: bool = False) -> str:
    """Return the digest of a node group, as `digest_of_material`."""
    return _hash([_interface(tree), custom_properties(tree, COPY_MARKS), _tree(tree, as_copy)])


def links_of(tree: bpy.types.NodeTree) -> list[tuple[str, str, str, str, bool]]:
    """Return the links of a tree, by names of nodes and identifiers of sockets, sorted."""
    return sorted(map(_LINK, tree.links))


def properties_of_material(material: bpy.types.Material) -> tuple[str, ...]:
    """Return the names of a material's properties that count."""
    return _STRUCTS.names(type(material), _NOT_CONTENT)


def properties_of_node(struct: bpy.types.bpy_struct) -> tuple[str, ...]:
    """Return the names of the properties of a node, or of a struct in it, that count."""
    without = _BASE_NODE if isinstance(struct, bpy.types.Node) else _NOT_CONTENT - {"name"}
    return _STRUCTS.names(type(struct), without)


def animation_of(tree: bpy.types.NodeTree) -> Any:
    """Return what moves a tree's values, as plain data."""
    return _animation(tree)


def _hash(content: Any, itself: str = "") -> str:
    text = repr(content)
    if itself:
        text = text.replace(itself, "itself")
    return hashlib.blake2b(text.encode("utf-8", "surrogatepass"), digest_size=16).hexdigest()


def _tree(tree: bpy.types.NodeTree, as_copy: bool) -> list[Any]:
    keyed = {curve.data_path for curve in curves(tree)}
    nodes = [_node(node, as_copy, keyed) for node in sorted(tree.nodes, key=_NAME)]
    following = [node for node in tree.nodes if node.get(FOLLOWS) is not None] if as_copy and keyed else []
    ours = {path_of(node.outputs[0]) for node in following if is_added(node)}
    return [nodes, links_of(tree), _animation(tree, ours)]


def _node(node: bpy.types.Node, as_copy: bool, keyed: set[str]) -> list[Any]:
    kind = node.type
    if as_copy and is_added(node):
        return [node.name, kind, _values(_settable(node), keyed)]
    content: list[Any] = [node.name, node.bl_idname, node.label, node.mute]
    simple, others = _STRUCTS.readers(type(node), _BASE_NODE)
    content.append(simple(node))
    for identifier, read in others:
        value = getattr(node, identifier)
        if as_copy and kind == "GROUP" and identifier == "node_tree" and is_copied_group(value):
            value = value[ORIGINAL]
        content.append(read(value))
    inputs = node.inputs
    content.append(_values(inputs, keyed))
    if kind == "GROUP":  # others have the inputs that their properties say
        content.append(list(map(_IDENTIFIER, inputs)))
    if kind in OUTPUTS_WITH_VALUES:
        content.append(_values(node.outputs, keyed))
    if node.keys():
        content.append(custom_properties(node, NODE_MARKS))
    return content


def _settable(node: bpy.types.Node) -> list[bpy.types.NodeSocket]:
    """Return those sockets of a node of ours whose values the user may want to set."""
    if node.get(FED) is not None:
        names = (BASE_COLOR, EMISSION, DIFFUSE_COLOR)  # those of earlier versions do not have the last one
        return [node.inputs[name] for name in names if name in node.inputs]
    return list(node.outputs) if node.type in OUTPUTS_WITH_VALUES else []


def _values(sockets: Any, keyed: set[str]) -> list[Any]:
    """Return sockets' constants, except for those that keyframes and drivers move."""
    if keyed:
        sockets = [socket for socket in sockets if path_of(socket) not in keyed]
    values = [getattr(socket, "default_value", None) for socket in sockets]
    return [value if type(value) in SIMPLE else plain(value) for value in values]


_BASE_NODE = frozenset(prop.identifier for prop in bpy.types.Node.bl_rna.properties) | _NOT_CONTENT - {
    "node_tree"
}


def _interface(tree: bpy.types.NodeTree) -> list[Any]:
    return [
        [item.item_type, item.name, _STRUCTS.read(item, _NOT_CONTENT)] for item in tree.interface.items_tree
    ]


def _animation(owner: bpy.types.ID, ours: Collection[str] = ()) -> Any:
    """Return what moves a datablock's values, but for those of `ours`, by their paths."""
    data = owner.animation_data
    if data is None or (data.action is None and not data.drivers and not data.nla_tracks):
        return None
    action = None if data.action is None else data.action.name_full
    moved = sorted(
        (curve.data_path, curve.array_index) for curve in curves(owner) if curve.data_path not in ours
    )
    drivers = sorted(
        repr(
            (
                curve.data_path,
                curve.array_index,
                curve.mute,
                _STRUCTS.read(curve.driver, _NOT_CONTENT - {"name"}),
            )
        )
        for curve in data.drivers
        if curve.data_path not in ours
    )
    return [action, moved, drivers, [track.name for track in data.nla_tracks]]
