"""The node group that parts a color into what a lightmap lights and what a shader reflects itself."""

from __future__ import annotations

import bpy
import numpy as np

from ..datablocks.bake_record import is_made, mark_made
from ..materials import glossy_albedo
from ..materials.node_algebra import NodeAlgebra, NodeColor, Scalar
from .node_group import BASE_COLOR, DIFFUSE_COLOR

GROUP_NAME = "Radiosity Shine"

COLOR = "Color"
GLOSSY_COLOR = "Glossy Color"
METALLIC, TRANSMISSION = "Metallic", "Transmission Weight"

_INPUTS = {
    METALLIC: 0.0,
    TRANSMISSION: 0.0,
    "Roughness": 0.5,
    "IOR": 1.5,
    "Specular IOR Level": 0.0,
    "Specular Tint": (1.0, 1.0, 1.0, 1.0),
    "Coat Weight": 0.0,
    "Coat Roughness": 0.03,
    "Coat IOR": 1.5,
    "Coat Tint": (1.0, 1.0, 1.0, 1.0),
}
"""Those of a Principled BSDF that say how much light gets to its diffuse part, with values for a shader
that is diffuse alone."""

LAYERS = tuple(_INPUTS)


def shine_group() -> bpy.types.NodeTree:
    """Return the node group, created if this file has none of ours.

    Base Color = Color
    Glossy Color = Color · max(Metallic, Transmission): what the shader has instead. It is black where the
        lightmap does all, and whole for metal and glass. Between these the shader reflects
        the share max (1 − max) of the light as a diffuse surface.
    Diffuse Color = Color · (1 − Metallic) · (1 − Transmission) · what passes the layers above it
    """
    for tree in bpy.data.node_groups:
        if is_made(tree) and tree.library is None and tree.name.startswith(GROUP_NAME):
            return tree
    tree = bpy.data.node_groups.new(GROUP_NAME, "ShaderNodeTree")
    mark_made(tree)
    tree.interface.new_socket(COLOR, in_out="INPUT", socket_type="NodeSocketColor")
    for name, value in _INPUTS.items():
        kind = "NodeSocketColor" if isinstance(value, tuple) else "NodeSocketFloat"
        tree.interface.new_socket(name, in_out="INPUT", socket_type=kind).default_value = value
    for name in (BASE_COLOR, DIFFUSE_COLOR, GLOSSY_COLOR):
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketColor")
    _build(tree)
    return tree


def _build(tree: bpy.types.NodeTree) -> None:
    """Wire the group's formulas."""
    given = tree.nodes.new("NodeGroupInput").outputs
    result = tree.nodes.new("NodeGroupOutput").inputs
    algebra = NodeAlgebra(tree)
    metallic, transmission = (algebra.saturate(given[name]) for name in (METALLIC, TRANSMISSION))
    whole = algebra.calculate("MAXIMUM", metallic, transmission)
    share = algebra.calculate("MULTIPLY", algebra.complement(metallic), algebra.complement(transmission))
    diffuse = algebra.multiply(algebra.scale(given[COLOR], share), _passing(tree, given))
    tree.links.new(given[COLOR], result[BASE_COLOR])
    tree.links.new(diffuse, result[DIFFUSE_COLOR])
    tree.links.new(algebra.scale(given[COLOR], whole), result[GLOSSY_COLOR])
    for number, node in enumerate(tree.nodes):
        node.location = (200 * (number % 8), -150 * (number // 8))


def _passing(tree: bpy.types.NodeTree, given: bpy.types.bpy_prop_collection) -> NodeColor:
    """Return the share of the light that coat and dielectric layer leave to what is below them, as seen.

    A tinted layer takes from all channels what it reflects of one, as in Cycles.
    """
    algebra = NodeAlgebra(tree)
    away = tree.nodes.new("ShaderNodeLayerWeight").outputs["Facing"]
    tinted = tree.nodes.new("ShaderNodeSeparateColor")
    tinted.mode = "HSV"
    tree.links.new(given["Specular Tint"], tinted.inputs["Color"])
    largest = tinted.outputs[2]

    def reflected(ior: str, level: Scalar, roughness: str) -> Scalar:
        return glossy_albedo.dielectric_seen(algebra, given[ior], level, given[roughness], away)

    def rest(part: NodeColor) -> NodeColor:
        return algebra.add(np.ones(3), algebra.scale(part, -1.0))

    layer = algebra.calculate("MULTIPLY", largest, reflected("IOR", given["Specular IOR Level"], "Roughness"))
    weight = algebra.saturate(given["Coat Weight"])
    coat = algebra.calculate("MULTIPLY", weight, reflected("Coat IOR", 0.5, "Coat Roughness"))
    tint = algebra.scale(rest(given["Coat Tint"]), weight)
    below = algebra.scale(rest(tint), algebra.complement(coat))
    return algebra.scale(below, algebra.complement(layer))
