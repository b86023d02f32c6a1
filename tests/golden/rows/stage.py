"""What the rows build their scenes of: quads and boxes with a fixed lightmap layout, lamps, materials."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from radiosity_addon.scene.bake_scene import LIGHTMAP_UV_LAYER

TEXELS = 128
"""Rectangles of the layout are given in texels of a lightmap of this size, whatever is baked."""

Rect = tuple[float, float, float, float]
"""Left, bottom, right and top [texels]."""


def stage(albedo: float = 0.5, blockers: bool = True) -> None:
    """Build a corner: a floor of 4 × 4 m, two walls 2.2 m high, and a box and a floating slab before them.

    The floor is the lower left of the lightmap, 20 texels a meter. The lamp belongs to the
    front right, where x > 0 and y < 0.
    """
    paint = diffuse("Paint", albedo)
    floor = ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0))
    back = ((-2, 2, 0), (2, 2, 0), (2, 2, 2.2), (-2, 2, 2.2))
    left = ((-2, -2, 0), (-2, 2, 0), (-2, 2, 2.2), (-2, -2, 2.2))
    add_quad("Floor", floor, (1, 1, 81, 81), paint)
    add_quad("Back", back, (1, 83, 81, 127), paint)
    add_quad("Left", left, (83, 1, 127, 81), paint, turned=True)
    if blockers:
        add_box("Box", (0.7, 0.7, 1.0), (83, 105, 127, 127), paint, location=(-0.5, 0.4, 0.5), turn=0.4)
        slab = {"location": (0.7, 0.9, 1.1), "turn": -0.3}
        add_box("Slab", (0.9, 0.25, 0.3), (83, 83, 127, 105), paint, **slab)


def add_quad(
    name: str,
    corners: Sequence[Sequence[float]],
    rect: Rect,
    material: bpy.types.Material | None,
    turned: bool = False,
) -> bpy.types.Object:
    """Add a quad whose lightmap fills a rectangle: its first edge along u, or along v if `turned`."""
    left, bottom, right, top = rect
    uv = [(left, bottom), (right, bottom), (right, top), (left, top)]
    if turned:
        uv = [(left, top), (left, bottom), (right, bottom), (right, top)]
    return add_mesh(name, corners, ((0, 1, 2, 3),), uv, material)


def add_box(
    name: str,
    size: Sequence[float],
    rect: Rect,
    material: bpy.types.Material | None,
    location: Sequence[float],
    turn: float = 0.0,
) -> bpy.types.Object:
    """Add a box, turned about z; its six faces share out the rectangle, three by two."""
    corners = [[s * e / 2 for s, e in zip(sign, size, strict=True)] for sign in _signs()]
    faces = ((0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6), (4, 5, 7, 6), (2, 3, 1, 0))
    left, bottom, right, top = rect
    wide, high = (right - left) / 3, (top - bottom) / 2
    uv = []
    for number in range(6):
        u, v = left + wide * (number % 3), bottom + high * (number // 3)
        uv += [(u, v), (u + wide - 1, v), (u + wide - 1, v + high - 1), (u, v + high - 1)]
    box = add_mesh(name, corners, faces, uv, material)
    box.location, box.rotation_euler = location, (0, 0, turn)
    return box


def _signs() -> list[tuple[int, int, int]]:
    return [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]


def add_mesh(
    name: str,
    vertices: Sequence[Sequence[float]],
    faces: Sequence[Sequence[int]],
    texels: Sequence[Sequence[float]],
    material: bpy.types.Material | None,
) -> bpy.types.Object:
    """Add a mesh object; `texels` are its lightmap's UVs by mesh corner, in texels."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    layer = mesh.uv_layers.new(name=LIGHTMAP_UV_LAYER)
    layer.data.foreach_set("uv", (np.asarray(texels, dtype=np.float32) / TEXELS).ravel())
    if material is not None:
        mesh.materials.append(material)
    return add_object(name, mesh)


def add_object(
    name: str, data: bpy.types.ID | None, collection: bpy.types.Collection | None = None, **transform: Any
) -> bpy.types.Object:
    """Link a new object to a collection, the scene's own by default."""
    obj = bpy.data.objects.new(name, data)
    for attribute, value in transform.items():
        setattr(obj, attribute, value)
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def add_lamp(
    kind: str,
    location: Sequence[float] = (1.2, -1.0, 2.0),
    target: Sequence[float] = (-0.2, 0.5, 0.3),
    **values: Any,
) -> bpy.types.Object:
    """Add a lamp that points at a target, with the given settings."""
    lamp = bpy.data.lights.new("Lamp", kind)
    for attribute, value in values.items():
        setattr(lamp, attribute, value)
    x, y, z = np.asarray(target, dtype=float) - location
    aim = (math.atan2(math.hypot(x, y), -z), 0.0, math.atan2(-x, y))
    return add_object("Lamp", lamp, location=location, rotation_euler=aim)


def diffuse(name: str, *albedo: float) -> bpy.types.Material:
    """Make a matte material, of one reflectance or three."""
    color = albedo if len(albedo) == 3 else albedo * 3
    return shader_material(name, "ShaderNodeBsdfDiffuse", Color=(*color, 1.0))


def shader_material(name: str, shader: str, **inputs: Any) -> bpy.types.Material:
    """Make a material of one shader node; inputs are sockets by name, spaces as underscores."""
    material = bpy.data.materials.new(name)
    tree = emptied_nodes(material)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(add_node(tree, shader, **inputs).outputs[0], output.inputs["Surface"])
    return material


def add_node(tree: bpy.types.NodeTree, kind: str, **inputs: Any) -> bpy.types.Node:
    """Add a node with the given socket values, spaces as underscores."""
    node = tree.nodes.new(kind)
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    return node


def emptied_nodes(owner: Any) -> bpy.types.NodeTree:
    """Return the node tree of a material, world or lamp, made where it is missing, emptied."""
    if bpy.app.version < (5, 0) or owner.node_tree is None:
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree
