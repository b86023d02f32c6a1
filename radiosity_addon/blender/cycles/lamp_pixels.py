"""Evaluate a lamp's nodes: Cycles renders the inside of a sphere around it."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np

from ...numerics import brdf_of_reflectance, intensity_of_flux
from .world_pixels import look_around, only_for_now, panorama_scene

PICTURE_SIZE = (16, 32)
"""Rows and columns of the picture: directions in which the lamp is evaluated."""

_SUBDIVISIONS = 5
_REFLECTANCE = 0.5


def lamp_factor(lamp: bpy.types.Light) -> tuple[np.ndarray, float]:
    """Return the factor of a lamp's nodes on its light, and its variation with direction.

    lamp: With a node tree, not evaluated. Inputs of its nodes that depend on its shape or position are lost.
    Returns factor (3,): The mean over directions.
    Returns variation: The standard deviation over directions, relative to the mean.
    Raises BakeError if Cycles could not render it.
    """
    with only_for_now():
        scene = panorama_scene(None)
        bulb = lamp.copy()
        bulb.type, bulb.energy, bulb.color = "POINT", 1.0, (1.0, 1.0, 1.0)
        bulb = bpy.data.lights[bulb.name]  # its type has changed
        bulb.shadow_soft_size = 0.0
        for name, value in {"use_temperature": False, "exposure": 0.0, "normalize": True}.items():
            if hasattr(bulb, name):
                setattr(bulb, name, value)
        scene.collection.objects.link(bpy.data.objects.new("Radiosity Lamp", bulb))
        scene.collection.objects.link(_sphere())
        scene.cycles.max_bounces = 0
        scene.cycles.light_sampling_threshold = 0.0
        pixels = look_around(scene, PICTURE_SIZE, f"lamp '{lamp.name}'").reshape(-1, 3)
    factors = pixels / (brdf_of_reflectance(_REFLECTANCE) * intensity_of_flux(1.0))
    mean = factors.mean(axis=0)
    return mean, float(factors.std(axis=0).max() / max(float(mean.max()), 1e-12))


def _sphere() -> bpy.types.Object:
    """Return a matte sphere of radius 1."""
    mesh = bpy.data.meshes.new("Radiosity Lamp")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=_SUBDIVISIONS, radius=1.0)
    shape.to_mesh(mesh)
    shape.free()
    material = bpy.data.materials.new("Radiosity Lamp")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (_REFLECTANCE,) * 3 + (1.0,)
    tree.links.new(diffuse.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    mesh.materials.append(material)
    return bpy.data.objects.new("Radiosity Lamp", mesh)
