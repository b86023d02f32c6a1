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
METALLIC, TRANSMISSION, TINT = "Metallic", "Transmission Weight", "Specular Tint"

_INPUTS = {
    METALLIC: 0.0,
    TRANSMISSION: 0.0,
    "Roughness": 0.5,
    "IOR": 1.5,
    "Specular IOR Level": 0.0,
    TINT: (1.0, 1.0, 1.0, 1.0),
    "Coat Weight": 0.0,
    "Coat Roughness": 0.03,
    "Coat IOR": 1.5,
    "Coat Tint": (1.0, 1.0, 1.0, 1.0),
}
"""Those of a Principled BSDF that say how much light gets to its diffuse part, with values for a shader
that is diffuse alone."""

LAYERS = tuple(_INPUTS)

REPLACED = (METALLIC, TINT)
"""Those that the group has outputs for as well, which the shader takes instead."""

_RISE_AT_82 = (6 / 7) ** 5
"""How far Schlick's formula rises at the angle of cosine 1/7."""

_TINTED = 0.6
"""How much of the tint to apply: it takes more than Schlick's formula adds at angles where more is seen."""


def shine_group() -> bpy.types.NodeTree:
    """Return the node group, created if this file has none of ours.

    Base Color = Color
    Glossy Color: what the shader has instead. Color · Transmission, and so black where the lightmap does all;
        with metal, Color · Metallic + (1 − Metallic) · what the dielectric reflects along the normal.
    Metallic: what the shader has instead, 1 wherever there is metal: by Schlick's formula a metal of the mean
        of two colors reflects the mean of what these reflect, and has no diffuse part. Where there
        is glass too it stays, and the shader reflects the share max (1 − max), of metallic and
        transmission, as a diffuse surface.
    Specular Tint: what the shader has instead. A metal's says what it reflects at 82°: here, the mean.
    Diffuse Color = Color · (1 − Metallic) · (1 − Transmission) · what passes the layers above it
    """
    for tree in bpy.data.node_groups:
        is_ours = is_made(tree) and tree.library is None and tree.name.startswith(GROUP_NAME)
        if is_ours and any(
            item.name == TINT and item.in_out == "OUTPUT" for item in tree.interface.items_tree
        ):
            return tree  # those of earlier versions have no such output
    tree = bpy.data.node_groups.new(GROUP_NAME, "ShaderNodeTree")
    mark_made(tree)
    tree.interface.new_socket(COLOR, in_out="INPUT", socket_type="NodeSocketColor")
    for name, value in _INPUTS.items():
        kind = "NodeSocketColor" if isinstance(value, tuple) else "NodeSocketFloat"
        tree.interface.new_socket(name, in_out="INPUT", socket_type=kind).default_value = value
    for name in (BASE_COLOR, DIFFUSE_COLOR, GLOSSY_COLOR):
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketColor")
    tree.interface.new_socket(METALLIC, in_out="OUTPUT", socket_type="NodeSocketFloat")
    tree.interface.new_socket(TINT, in_out="OUTPUT", socket_type="NodeSocketColor")
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
    no_glass = algebra.complement(algebra.calculate("GREATER_THAN", transmission, 0.0))
    is_metal = algebra.calculate("MULTIPLY", algebra.calculate("GREATER_THAN", metallic, 0.0), no_glass)
    mean, tint = _mean_metal(tree, given, metallic)
    tree.links.new(algebra.blend(is_metal, algebra.scale(given[COLOR], whole), mean), result[GLOSSY_COLOR])
    tree.links.new(algebra.calculate("MAXIMUM", metallic, is_metal), result[METALLIC])
    tree.links.new(algebra.blend(is_metal, given[TINT], tint), result[TINT])
    for number, node in enumerate(tree.nodes):
        node.location = (200 * (number % 8), -150 * (number // 8))


def _mean_metal(
    tree: bpy.types.NodeTree, given: bpy.types.bpy_prop_collection, metallic: Scalar
) -> tuple[NodeColor, NodeColor]:
    """Return color and tint of a metal that reflects the mean of the metal and the dielectric.

    Cycles' tint (F82: Kutz et al. 2021) multiplies what Schlick's formula gives at 82°.
    """
    algebra = NodeAlgebra(tree)
    normal = glossy_albedo.dielectric_normal(algebra, given["IOR"], given["Specular IOR Level"])
    dielectric = algebra.scale(given[TINT], normal)

    def at_82(color: NodeColor, rise: Scalar = 1.0) -> NodeColor:
        rest = algebra.add(np.ones(3), algebra.scale(color, -1.0))
        return algebra.add(color, algebra.scale(algebra.scale(rest, rise), _RISE_AT_82))

    mean = algebra.blend(metallic, dielectric, given[COLOR])
    metal_seen = algebra.multiply(given[TINT], at_82(given[COLOR]))
    layer_seen = at_82(dielectric, glossy_albedo.dielectric_rise(algebra, normal))
    tint = algebra.divide(algebra.blend(metallic, layer_seen, metal_seen), at_82(mean))
    return mean, algebra.blend(_TINTED, given[TINT], tint)


def _passing(tree: bpy.types.NodeTree, given: bpy.types.bpy_prop_collection) -> NodeColor:
    """Return the share of the light that coat and dielectric layer leave to what is below them, as seen.

    A tinted layer takes from all channels what it reflects of one, as in Cycles.
    """
    algebra = NodeAlgebra(tree)
    away = tree.nodes.new("ShaderNodeLayerWeight").outputs["Facing"]
    tinted = tree.nodes.new("ShaderNodeSeparateColor")
    tinted.mode = "HSV"
    tree.links.new(given[TINT], tinted.inputs["Color"])
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
