"""What the interiors share of Blender: meshes of shapes, and matte and glowing materials."""

from __future__ import annotations

import bpy

from .shapes import Shape

COLORS = {
    "Wall": (0.76, 0.74, 0.70),
    "Accent": (0.30, 0.42, 0.50),
    "Ceiling": (0.82, 0.82, 0.82),
    "Floor": (0.36, 0.25, 0.16),
    "Carpet": (0.42, 0.16, 0.13),
    "Oak": (0.48, 0.33, 0.19),
    "White": (0.74, 0.74, 0.73),
    "Paper": (0.68, 0.63, 0.54),
    "Steel": (0.45, 0.46, 0.48),
    "Black": (0.05, 0.05, 0.055),
    "Blue Cloth": (0.08, 0.16, 0.36),
    "Green": (0.14, 0.30, 0.17),
    "Leaf": (0.10, 0.32, 0.07),
    "Clay": (0.52, 0.27, 0.18),
    "Red": (0.55, 0.09, 0.06),
    "Yellow": (0.72, 0.50, 0.10),
}


def add_mesh(
    scene: bpy.types.Scene, name: str, shape: Shape, materials: dict[str, bpy.types.Material]
) -> None:
    used = list(dict.fromkeys(shape.paint))
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(shape.vertices.tolist(), [], shape.faces)
    for paint in used:
        mesh.materials.append(materials[paint])
    mesh.polygons.foreach_set("material_index", [used.index(paint) for paint in shape.paint])
    mesh.update()
    scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def add(
    scene: bpy.types.Scene, name: str, data: bpy.types.ID, place: tuple[float, float, float]
) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    obj.location = place
    scene.collection.objects.link(obj)
    return obj


def diffuse(name: str, color: tuple[float, float, float]) -> bpy.types.Material:
    return _material(name, "ShaderNodeBsdfDiffuse", color)


def glowing(name: str, radiance: float) -> bpy.types.Material:
    color = (0.6, 0.8, 1.0) if name == "Screen" else (1.0, 0.78, 0.5)
    material = _material(name, "ShaderNodeEmission", color)
    next(node for node in material.node_tree.nodes if node.type == "EMISSION").inputs[
        "Strength"
    ].default_value = radiance
    return material


def _material(name: str, kind: str, color: tuple[float, float, float]) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    material.diffuse_color = (*color, 1.0)
    tree = material.node_tree
    tree.nodes.clear()
    output, shader = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new(kind)
    shader.inputs["Color"].default_value = (*color, 1.0)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def even_sky(scene: bpy.types.Scene, radiance: tuple[float, float, float]) -> None:
    """Light a scene evenly [W/m²/sr]."""
    world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*radiance, 1.0)
    background.inputs["Strength"].default_value = 1.0
    scene.world = world
