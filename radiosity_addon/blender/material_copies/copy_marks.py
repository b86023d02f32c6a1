"""What a lightmap copy of a material, or of a node group in it, says of itself, in custom properties.

Every node that we add to a copied tree is marked, with what it stands for, so that `stripping.py` can
take all of it out again.
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ..datablocks.bake_record import MADE_MARKER, ORIGINAL, is_made
from ..datablocks.image_marks import GROUP

SUFFIX = " (Lightmap)"
"""What a copy's name ends with."""

NO_MATERIAL = f"No Material{SUFFIX}"

COPY_NAME = "radiosity_copy_name"
"""On a copied material: the name we gave it."""

TOKEN = "radiosity_token"
"""On a copied material: shared with no other, except for those that the user duplicated from it."""

SAMPLING = "radiosity_emission_sampling"
"""On a copied material: how Cycles sampled the original's emission."""

EMPTY_SLOT = "radiosity_empty_slot"
"""On a copied material: the slots that it fills are empty ones of objects: it is of the mesh's material."""

PLAIN = "radiosity_plain"
"""On a copied material: the original has no nodes."""

CONTENT = "radiosity_content"
"""On a copy: the digest of what it was made from, without what we added."""

SOURCE = "radiosity_source"
"""On a copy: the digest of the original when it was made."""

STATE = "radiosity_state"
"""On a copy: the digest of all of it when it was made."""

CARRIED = "radiosity_carried"
"""On a copied material of an earlier version: the digest of all of it when its edits were carried."""

SOCKETS = "radiosity_sockets"
"""On a copied node group: the identifiers of the sockets that we added."""

ADDED = "radiosity_added"
"""On a node that we added: its name."""

VALUE = "radiosity_value"
"""On a node that we added: the constant of a socket, which is read from this node, as it was then."""

THROUGH = "radiosity_through"
"""On a node that we added: what feeds an input fed, before, what the output feeds; see `passed_input`."""

FOLLOWS = "radiosity_follows"
"""On a node that we added: node and input whose constant it repeats, where it cannot feed that."""

FED, FED_BY = "radiosity_fed", "radiosity_fed_by"
"""On the lightmap group's node: constants and sources of base color, emission and diffuse color when it
was made."""

COPY_MARKS = (
    ORIGINAL,
    COPY_NAME,
    TOKEN,
    SAMPLING,
    EMPTY_SLOT,
    PLAIN,
    CONTENT,
    SOURCE,
    STATE,
    CARRIED,
    SOCKETS,
    MADE_MARKER,
    GROUP,
)
NODE_MARKS = (ADDED, VALUE, THROUGH, FOLLOWS, FED, FED_BY)


def mark_added(tree: bpy.types.NodeTree, before: set[str]) -> None:
    """Mark all nodes of a tree but those of some names."""
    for node in tree.nodes:
        if node.name not in before:
            node[ADDED] = node.name


def is_added(node: bpy.types.Node) -> bool:
    """Whether we added a node. One that the user duplicated from ours, or renamed, is the user's."""
    name = node.get(ADDED)
    return name is not None and (name == node.name or _is_ours(node))


def linked_output(socket: bpy.types.NodeSocket) -> str:
    """Return a name for the output that is linked to an input; "" where none is."""
    if not socket.is_linked:
        return ""
    link = socket.links[0]
    return f"{link.from_node.name}\n{link.from_socket.identifier}"


def followed_socket(tree: bpy.types.NodeTree, node: bpy.types.Node) -> bpy.types.NodeSocket | None:
    """Return the input of a tree, our copy or the original, whose constant a node of ours repeats."""
    name, identifier = node[FOLLOWS]
    reader = tree.nodes.get(name)
    inputs = () if reader is None else reader.inputs
    return next((socket for socket in inputs if socket.identifier == identifier), None)


def passed_input(output: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Return the input that stands for an output of a node marked as `THROUGH`.

    It is the one of the same name, else the first.
    """
    inputs = output.node.inputs
    return inputs.get(output.name) or inputs[0]


def behind_ours(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Return the input that takes what an input would take without the nodes that we put in between."""
    while socket.is_linked and socket.links[0].from_node.get(THROUGH):
        socket = passed_input(socket.links[0].from_socket)
    return socket


def users_inputs(output: bpy.types.NodeSocket) -> Iterator[bpy.types.NodeSocket]:
    """Yield the inputs of the user's that an output feeds, also by nodes that we put in between."""
    for link in output.links:
        node = link.to_node
        if not is_added(node):
            yield link.to_socket
        elif node.get(THROUGH):
            for passed in node.outputs:
                if passed_input(passed) == link.to_socket:
                    yield from users_inputs(passed)


def is_copied_group(tree: bpy.types.NodeTree | None) -> bool:
    """Whether a node group is our copy of one of the user's."""
    return tree is not None and is_made(tree) and tree.get(ORIGINAL) is not None


def copied_groups(tree: bpy.types.NodeTree) -> Iterator[bpy.types.NodeTree]:
    """Yield our copies of node groups that a tree uses, inner ones first."""
    for node in tree.nodes:
        if node.type == "GROUP" and is_copied_group(node.node_tree):
            yield from copied_groups(node.node_tree)
            yield node.node_tree


def _is_ours(node: bpy.types.Node) -> bool:
    """Whether a node has no meaning without the lightmap: it shows an image or a group that we made."""
    if node.type == "GROUP":
        return node.node_tree is not None and is_made(node.node_tree) and not is_copied_group(node.node_tree)
    return node.type == "TEX_IMAGE" and node.image is not None and is_made(node.image)
