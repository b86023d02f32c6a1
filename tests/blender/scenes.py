"""Small things to build scenes of, alike in Blender 4.2 to 5.2, and a light meter: Cycles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

QUAD = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))


def add_mesh(
    name: str,
    vertices: Sequence[Sequence[float]] = QUAD,
    faces: Sequence[Sequence[int]] = ((0, 1, 2, 3),),
    *,
    material: bpy.types.Material | None = None,
    collection: bpy.types.Collection | None = None,
    **transform: Any,
) -> bpy.types.Object:
    """Add a mesh object, a 2 m square facing up by default."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    if material is not None:
        mesh.materials.append(material)
    return add_object(name, mesh, collection, **transform)


def add_lamp(
    kind: str, name: str = "Lamp", transform: dict[str, Any] | None = None, **values: Any
) -> bpy.types.Object:
    """Add a lamp with the given settings."""
    lamp = bpy.data.lights.new(name, kind)
    for attribute, value in values.items():
        setattr(lamp, attribute, value)
    return add_object(name, lamp, None, **(transform or {}))


def add_object(
    name: str, data: bpy.types.ID | None, collection: bpy.types.Collection | None = None, **transform: Any
) -> bpy.types.Object:
    """Link a new object to a collection, the scene's own by default."""
    obj = bpy.data.objects.new(name, data)
    for attribute, value in transform.items():
        setattr(obj, attribute, value)
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def with_nodes(owner: Any) -> bpy.types.NodeTree:
    """Return the node tree of a material, world or lamp, made where it is missing, emptied."""
    if owner.node_tree is None:
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def shader_material(name: str, shader: str, **inputs: Any) -> bpy.types.Material:
    """Make a material of one shader node; inputs are sockets by name, spaces as underscores."""
    material = bpy.data.materials.new(name)
    tree = with_nodes(material)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(add_node(tree, shader, **inputs).outputs[0], output.inputs["Surface"])
    return material


def add_node(tree: bpy.types.NodeTree, kind: str, **inputs: Any) -> bpy.types.Node:
    """Add a node with the given socket values."""
    node = tree.nodes.new(kind)
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    return node


def set_world(*radiance: float, strength: float = 1.0) -> bpy.types.World:
    """Give the scene a world of one color."""
    world = bpy.data.worlds.new("World")
    tree = with_nodes(world)
    background = add_node(tree, "ShaderNodeBackground", Color=(*radiance, 1.0), Strength=strength)
    tree.links.new(background.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    bpy.context.scene.world = world
    return world


def measure_irradiance(meter: bpy.types.Object, samples: int = 16, size: int = 16) -> np.ndarray:
    """Bake the light that falls on a mesh in Cycles.

    Parameters
    ----------
    meter : bpy.types.Object
        A mesh whose first face is a quad, which is measured; its material is replaced.
    samples, size : int
        A texel's samples, and the texels along each side.

    Returns
    -------
    (3,) float64
        Mean irradiance over the quad [W/m²].
    """
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.light_sampling_threshold = 0.0
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0.0
    image = bpy.data.images.new("Meter", size, size, float_buffer=True, is_data=True)
    material = shader_material("Meter", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1.0))
    target = material.node_tree.nodes.new("ShaderNodeTexImage")
    target.image = image
    material.node_tree.nodes.active = target
    meter.data.materials.clear()
    meter.data.materials.append(material)
    layer = meter.data.uv_layers.new(name="Meter")
    quad = [0, 0, 1, 0, 1, 1, 0, 1]
    layer.data.foreach_set("uv", quad + [0] * (2 * len(layer.data) - len(quad)))
    bpy.context.view_layer.objects.active = meter
    meter.select_set(True)
    status = bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, margin=0)
    assert status == {"FINISHED"}
    pixels = np.empty(size * size * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return math.pi * pixels.reshape(-1, 4)[:, :3].astype(np.float64).mean(axis=0)
