"""The open scene as a bake sees it: plain triangles with one diffuse color a material, lamps, the sky.

What is approximated on export (images by their means, gloss as matte) would count as our error against Cycles
although no solver could help it. So both programs bake the scene after this: modifiers applied, instances
real, every surface a Diffuse BSDF of the exported reflectance, with an emission where it glows.
"""

from __future__ import annotations

import bpy
import numpy as np

from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeObject
from radiosity_addon.scene.scene import Scene

from .interior.blender_parts import even_sky

MOST_MATERIALS = 1000
"""If a scene has more colors, reflectances are rounded: Cycles needs minutes for each pass with so many."""


def flatten(sky: tuple[float, float, float] | None) -> None:
    """Replace the open scene's meshes and materials; `sky` lights it instead of the world it has."""
    scene = bpy.context.scene
    bake_scene = export_scene(bpy.context, BakeSettings()).bake_scene
    solved = bake_scene.scene
    if sky is not None:
        even_sky(scene, sky)
    lamps = [obj for obj in scene.objects if obj.type == "LIGHT" and not obj.hide_render]
    places = [obj.matrix_world.copy() for obj in lamps]
    for obj in list(bpy.data.objects):
        if obj not in lamps:
            bpy.data.objects.remove(obj)
    for lamp, place in zip(lamps, places, strict=True):
        lamp.parent = None
        lamp.matrix_world = place
    colors = _colors(solved)
    materials: dict[tuple[float, ...], bpy.types.Material] = {}
    for item in bake_scene.objects:
        if item.count:
            _add(scene, item, solved, colors, materials)


def _add(
    scene: bpy.types.Scene,
    item: BakeObject,
    solved: Scene,
    colors: np.ndarray,
    materials: dict[tuple[float, ...], bpy.types.Material],
) -> None:
    triangles = solved.triangles[item.rows]
    mesh = bpy.data.meshes.new(item.name)
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    mesh.from_pydata(triangles.reshape(-1, 3).tolist(), [], faces.tolist())
    kinds, which = np.unique(colors[item.rows], axis=0, return_inverse=True)
    for kind in kinds:
        mesh.materials.append(_material(tuple(float(v) for v in kind), materials))
    mesh.polygons.foreach_set("material_index", which.ravel().astype(np.int32))
    normals, flat = solved.normals[item.rows], solved.face_normals[item.rows, None]
    if np.abs(normals - flat).max() > 1e-4:
        mesh.polygons.foreach_set("use_smooth", np.ones(len(triangles), dtype=bool))
        mesh.normals_split_custom_set(normals.reshape(-1, 3).tolist())
    mesh.update()
    scene.collection.objects.link(bpy.data.objects.new(item.name, mesh))


def _colors(solved: Scene) -> np.ndarray:
    """Return (t, 6) the reflectances and emissions [W/m²] of triangles."""
    colors = np.round(np.concatenate([solved.reflectance, solved.emission], axis=1), 6)
    if len(np.unique(colors, axis=0)) > MOST_MATERIALS:
        # Textures: every triangle has a mean of its own.
        colors[:, :3] = np.round(32.0 * colors[:, :3]) / 32.0
    return colors


def _material(
    surface: tuple[float, ...], materials: dict[tuple[float, ...], bpy.types.Material]
) -> bpy.types.Material:
    """Return the material of a reflectance and an emission [W/m²]."""
    if surface in materials:
        return materials[surface]
    material = bpy.data.materials.new("Surface")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output, diffuse = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*surface[:3], 1.0)
    shader = diffuse
    strength = max(surface[3:]) / np.pi
    if strength > 0:
        glow, shader = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeAddShader")
        glow.inputs["Color"].default_value = (*(value / max(surface[3:]) for value in surface[3:]), 1.0)
        glow.inputs["Strength"].default_value = strength
        tree.links.new(diffuse.outputs[0], shader.inputs[0])
        tree.links.new(glow.outputs[0], shader.inputs[1])
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    materials[surface] = material
    return material
