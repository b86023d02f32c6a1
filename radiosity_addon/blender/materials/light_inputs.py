"""Where strength and color of a lamp, an emissive material or the world are set: for sliders in a panel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from .materials import uses_nodes
from .shader_nodes import output_node

Input = tuple[Any, str]
"""The owner of a property, None if there is none, and the property's name."""

NO_INPUT: Input = (None, "")

_EMISSIVE = {
    "EMISSION": ("Color", "Strength"),
    "BSDF_PRINCIPLED": ("Emission Color", "Emission Strength"),
    "BACKGROUND": ("Color", "Strength"),
}
"""Sockets of the nodes that emit."""


@dataclass(frozen=True)
class LightInputs:
    """Where a light's color and strength are set, and the datablock that holds them."""

    icon: str
    block: bpy.types.ID
    color: Input = NO_INPUT
    strength: Input = NO_INPUT


def inputs_of(scene: bpy.types.Scene, name: str, emits: bool) -> LightInputs | None:
    """Return the inputs of a source of a kept bake.

    name: The lamp object's, the world's, or the emissive material's.
    emits: Whether it is a material.
    Returns inputs: None if there is no such thing any more.
    """
    if emits:
        material = bpy.data.materials.get(name)
        return None if material is None else _of_nodes(material, "MATERIAL")
    lamp = scene.objects.get(name)
    if lamp is not None and lamp.type == "LIGHT":
        data = lamp.data
        return LightInputs(f"LIGHT_{data.type}", data, (data, "color"), (data, "energy"))
    world = shown_world(scene, name)
    return None if world is None else _of_nodes(world, "WORLD")


def shown_world(scene: bpy.types.Scene, name: str) -> bpy.types.World | None:
    """Return the world of a name if the scene, or one of its view layers, shows it."""
    own = [getattr(layer, "world_override", None) for layer in scene.view_layers]
    return next((world for world in (*own, scene.world) if world is not None and world.name == name), None)


def _of_nodes(owner: Any, icon: str) -> LightInputs:
    """Return the inputs of the node that feeds an owner's surface, or the first one that emits."""
    if not uses_nodes(owner):
        return LightInputs(icon, owner, (owner, "color") if isinstance(owner, bpy.types.World) else NO_INPUT)
    output = output_node(owner.node_tree)
    links = output.inputs["Surface"].links if output is not None else ()
    nodes = [link.from_node for link in links] + list(owner.node_tree.nodes)
    node = next((node for node in nodes if node.type in _EMISSIVE), None)
    if node is None:
        return LightInputs(icon, owner)
    color, strength = (_socket(node, name) for name in _EMISSIVE[node.type])
    return LightInputs(icon, owner, color, strength)


def _socket(node: bpy.types.Node, name: str) -> Input:
    socket = node.inputs.get(name)
    return NO_INPUT if socket is None or socket.is_linked else (socket, "default_value")
