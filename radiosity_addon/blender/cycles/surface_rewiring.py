"""Copies of materials that emit what the originals reflect, emit or transmit.

The shader tree is followed once. Next to it, three expressions are built of Math nodes on the
sockets that feed the shaders; Cycles then evaluates them. Node groups are copied for each use,
and what crosses a group's border does so through sockets added to it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..datablocks.image_values import known_means_only
from ..materials.gloss import ALL, Gloss
from ..materials.node_algebra import NodeAlgebra, NodeColor, Scalar, is_socket
from ..materials.shader_nodes import (
    MissingImageError,
    NotConstantError,
    Stack,
    Value,
    by_identifier,
    default_rgb,
    evaluate,
    feed_of,
    group_output,
    output_node,
)
from ..materials.shader_terms import ShaderTerms, Terms, nothing
from ..materials.shading_inputs import LIGHT_PATHS, asked_by_default, asked_by_outputs

EXPRESSIONS = ("reflected", "radiance", "passed")


class RewiredMaterial:
    """A copy of a material whose output can be switched between the three expressions.

    original: One with nodes.
    attributes mapping of str to str: The names of the mesh attributes that hold inputs of the nodes.
    lets_through, gloss: See `read_material`.
    """

    def __init__(
        self,
        original: bpy.types.Material,
        attributes: Mapping[str, str],
        lets_through: bool = False,
        gloss: Gloss = ALL,
    ) -> None:
        self.made: list[bpy.types.ID] = []
        """The datablocks to remove in the end."""
        self.material = original.copy()
        self.made.append(self.material)
        if hasattr(self.material, "cycles"):
            self.material.cycles.emission_sampling = "NONE"  # or Cycles would sample it as a lamp
        self._tree = self.material.node_tree
        self._shadow_switches: list[bpy.types.Node] = []
        self._prepare(self._tree, attributes)
        output = output_node(self._tree)
        self._terms = nothing()
        if output is not None:
            rewiring = _Rewiring(lets_through, gloss)
            self._terms = rewiring.shader(output.inputs["Surface"], _Place(self._tree))
        self._finish(output)

    @property
    def node_count(self) -> int:
        """The number of nodes in all of its trees."""
        trees = [block for block in self.made if isinstance(block, bpy.types.NodeTree)]
        return sum(len(tree.nodes) for tree in [self._tree, *trees])

    def is_constant(self, channel: str) -> bool:
        """Return whether a channel is constant."""
        return not is_socket(getattr(self._terms, channel))

    def show(self, channel: str, image: bpy.types.Image) -> None:
        """Make the material emit one of `EXPRESSIONS`, and bake into an image."""
        value = getattr(self._terms, channel)
        color = self._emission.inputs["Color"]
        for link in list(color.links):
            self._tree.links.remove(link)
        if is_socket(value):
            self._tree.links.new(value, color)
        else:
            color.default_value = (*value, 1.0)
        for switch in self._shadow_switches:
            switch.outputs[0].default_value = float(channel == "passed")
        self._target.image = image

    def _prepare(self, tree: bpy.types.NodeTree, attributes: Mapping[str, str]) -> None:
        """Give every group a tree of its own, and let nodes read the mesh's attributes."""
        for node in list(tree.nodes):
            if node.type == "GROUP" and node.node_tree is not None:
                node.node_tree = node.node_tree.copy()
                self.made.append(node.node_tree)
                self._prepare(node.node_tree, attributes)
            for identifier, (name, output) in asked_by_outputs(node).items():
                if node.outputs[identifier].is_linked:
                    given = _attribute(tree, attributes[name]).outputs[output]
                    _relink(tree, node.outputs[identifier], _unit(tree, given) if "normal" in name else given)
            default = asked_by_default(node)
            if default is not None and not node.mute:
                tree.links.new(_attribute(tree, attributes[default]).outputs["Vector"], node.inputs["Vector"])
            if node.type == "NEW_GEOMETRY" and node.outputs["Backfacing"].is_linked:
                _relink(tree, node.outputs["Backfacing"], _number(tree, 0.0).outputs[0])
            if node.type == "LIGHT_PATH":
                self._prepare_light_path(tree, node)

    def _prepare_light_path(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> None:
        for output in node.outputs:
            if not output.is_linked:
                continue
            number = _number(tree, LIGHT_PATHS.get(output.name, 0.0))
            if output.name == "Is Shadow Ray":
                self._shadow_switches.append(number)
                # Not a constant: it is another one for each channel.
                number = _hidden(tree, number)
            _relink(tree, output, number.outputs[0])

    def _finish(self, output: bpy.types.Node | None) -> None:
        """Add an emission shader at the output, and an image to bake into."""
        nodes, links = self._tree.nodes, self._tree.links
        if output is None:
            output = nodes.new("ShaderNodeOutputMaterial")
        for name in ("Volume", "Displacement"):
            for link in list(output.inputs[name].links):
                links.remove(link)
        self._emission = nodes.new("ShaderNodeEmission")
        links.new(self._emission.outputs["Emission"], output.inputs["Surface"])
        self._target = nodes.new("ShaderNodeTexImage")
        nodes.active = self._target


@dataclass(frozen=True)
class _Place:
    """A tree, and the group node by which it was entered."""

    tree: bpy.types.NodeTree
    group: bpy.types.Node | None = None
    outer: _Place | None = None

    @property
    def stack(self) -> Stack:
        return () if self.outer is None or self.group is None else (*self.outer.stack, self.group)


class _Rewiring(ShaderTerms[_Place]):
    """Builds the expressions in the tree of a copied material."""

    def __init__(self, lets_through: bool, gloss: Gloss) -> None:
        self.lets_through, self.gloss = lets_through, gloss

    def shader(self, socket: bpy.types.NodeSocket, place: _Place) -> Terms:
        feed = feed_of(socket, enter_groups=False)
        node = feed.node
        if node is not None and node.type == "GROUP" and node.node_tree is not None:
            return self._from_inside(node, feed.socket.identifier, place)
        if node is not None and node.type == "GROUP_INPUT" and place.outer is not None:
            return self._from_outside(feed.socket.identifier, place)
        return self.fed_by(feed, socket, place, place)

    def color(self, socket: bpy.types.NodeSocket, place: _Place) -> NodeColor:
        constant = self._constant(socket, place)
        return socket.links[0].from_socket if constant is None else constant.rgb

    def scalar(self, socket: bpy.types.NodeSocket, place: _Place) -> Scalar:
        constant = self._constant(socket, place)
        return socket.links[0].from_socket if constant is None else constant.scalar

    def algebra(self, place: _Place) -> NodeAlgebra:
        return NodeAlgebra(place.tree)

    def warn(self, message: str) -> None:
        """Do nothing: reading the constants has already warned."""

    def not_understood(self, _: bpy.types.Node) -> Terms:
        return nothing()

    def _constant(self, socket: bpy.types.NodeSocket, place: _Place) -> Value | None:
        """Return a socket's constant; None where it varies."""
        try:
            with known_means_only(None):  # an image varies, whatever its mean
                value = evaluate(socket, place.stack)
        except MissingImageError:
            return Value(default_rgb(socket))
        except NotConstantError:
            value = None
        if value is None or value.notes:
            linked = socket.is_linked and not socket.links[0].is_muted
            return None if linked else Value(default_rgb(socket))
        return value

    def _from_inside(self, node: bpy.types.Node, identifier: str, place: _Place) -> Terms:
        group = node.node_tree
        inner = group_output(group, identifier)
        if inner is None:
            return nothing()
        terms = self.shader(inner, _Place(group, node, place))

        def outward(source: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
            declared = group.interface.new_socket("Term", in_out="OUTPUT", socket_type="NodeSocketVector")
            group.links.new(source, by_identifier(inner.node.inputs, declared.identifier))
            return by_identifier(node.outputs, declared.identifier)

        return _each(terms, outward)

    def _from_outside(self, identifier: str, place: _Place) -> Terms:
        group, outer = place.group, place.outer
        given = None if group is None else by_identifier(group.inputs, identifier)
        if group is None or outer is None or given is None:
            return nothing()
        terms = self.shader(given, outer)
        entry = place.tree.nodes.new("NodeGroupInput")

        def inward(source: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
            declared = place.tree.interface.new_socket("Term", in_out="INPUT", socket_type="NodeSocketVector")
            outer.tree.links.new(source, by_identifier(group.inputs, declared.identifier))
            return by_identifier(entry.outputs, declared.identifier)

        return _each(terms, inward)


def _each(terms: Terms, carry: Callable[[bpy.types.NodeSocket], bpy.types.NodeSocket]) -> Terms:
    """Carry those terms that are sockets over a border."""
    carried: dict[str, Any] = {}
    for channel in EXPRESSIONS:
        value = getattr(terms, channel)
        carried[channel] = carry(value) if is_socket(value) else np.asarray(value)
    return Terms(**carried)


def _relink(tree: bpy.types.NodeTree, output: bpy.types.NodeSocket, instead: bpy.types.NodeSocket) -> None:
    for link in list(output.links):
        target, muted = link.to_socket, link.is_muted
        tree.links.new(instead, target).is_muted = muted


def _attribute(tree: bpy.types.NodeTree, name: str) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "GEOMETRY", name
    return node


def _unit(tree: bpy.types.NodeTree, vector: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "NORMALIZE"
    tree.links.new(vector, node.inputs[0])
    return node.outputs["Vector"]


def _number(tree: bpy.types.NodeTree, value: float) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeValue")
    node.outputs[0].default_value = value
    return node


def _hidden(tree: bpy.types.NodeTree, number: bpy.types.Node) -> bpy.types.Node:
    """Return a node that passes a number on, but which `evaluate` does not compute."""
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = "ABSOLUTE"
    tree.links.new(number.outputs[0], node.inputs[0])
    return node
