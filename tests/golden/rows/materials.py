"""Materials: reflection, transparency and emission."""

from __future__ import annotations

import bpy
import numpy as np

from . import row
from .stage import add_lamp, add_node, add_quad, diffuse, emptied_nodes, shader_material, stage

SIDE = ((2, -2, 0), (2, 2, 0), (2, 2, 2.2), (2, -2, 2.2))
"""The corners of a wall that closes the stage on the right."""

NOWHERE = (127.55, 127.55, 127.95, 127.95)
"""A place in the lightmap without a texel's center: what has it is not compared, but bounces or blocks."""


@row("image-texture")
def image_texture() -> None:
    """Image texture on floor and wall, whose colors bounce."""
    _lit_stage()
    material = diffuse("Tiles", 0.8)
    _paint("Floor", material, image_node(material))
    _paint("Left", material)


@row("uv-mapping")
def uv_mapping() -> None:
    """Image texture through a UV map, a Mapping node and repetition."""
    _lit_stage()
    material = diffuse("Tiles", 0.8)
    tree = material.node_tree
    image = image_node(material)
    uv_map = tree.nodes.new("ShaderNodeUVMap")
    uv_map.uv_map = "Tiling"
    mapping = add_node(tree, "ShaderNodeMapping", Rotation=(0.0, 0.0, 0.5), Scale=(1.7, 2.3, 1.0))
    tree.links.new(uv_map.outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], image.inputs["Vector"])
    _paint("Floor", material, image)
    _paint("Left", material)


@row("vertex-colors")
def vertex_colors() -> None:
    """Color attribute of the floor's and the wall's corners."""
    _lit_stage()
    material = diffuse("Painted", 0.8)
    node = material.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Paint"
    for name in ("Floor", "Left"):
        _paint(name, material, node)
        paint = bpy.data.objects[name].data.attributes.new("Paint", "FLOAT_COLOR", "CORNER")
        colors = [(0.9, 0.1, 0.1, 1), (0.1, 0.9, 0.1, 1), (0.1, 0.1, 0.9, 1), (0.9, 0.9, 0.1, 1)]
        paint.data.foreach_set("color", np.array(colors, dtype=np.float32).ravel())


@row("procedural")
def procedural() -> None:
    """Checker and noise in object coordinates, through a color ramp and a mix."""
    _lit_stage()
    material = diffuse("Procedural", 0.8)
    tree = material.node_tree
    coordinates = _object_coordinates(tree)
    checker = add_node(tree, "ShaderNodeTexChecker", Scale=1.5)
    checker.inputs["Color1"].default_value = (0.9, 0.6, 0.1, 1)
    checker.inputs["Color2"].default_value = (0.05, 0.1, 0.3, 1)
    noise = add_node(tree, "ShaderNodeTexNoise", Scale=3.0)
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    mix = tree.nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    sockets = {socket.identifier: socket for socket in mix.inputs}
    sockets["Factor_Float"].default_value = 0.4
    for node in (checker, noise):
        tree.links.new(coordinates, node.inputs["Vector"])
    tree.links.new(noise.outputs[0], ramp.inputs[0])
    tree.links.new(checker.outputs["Color"], sockets["A_Color"])
    tree.links.new(ramp.outputs["Color"], sockets["B_Color"])
    mixed = next(socket for socket in mix.outputs if socket.identifier == "Result_Color")
    tree.links.new(mixed, tree.nodes["Diffuse BSDF"].inputs["Color"])
    _paint("Floor", material)
    _paint("Left", material)


@row("metal", limit=0.045)
def metal() -> None:
    """Rough metal wall next to matte ones; here it reflects light evenly, not in the mirror direction."""
    _lit_stage()
    color = (0.9, 0.6, 0.2, 1)
    gold = shader_material("Gold", "ShaderNodeBsdfPrincipled", Base_Color=color, Metallic=1, Roughness=0.6)
    add_quad("Gold", SIDE, NOWHERE, gold)


@row("metal-matte")
def metal_matte() -> None:
    """Matte wall with the total reflectance of the rough metal."""
    _lit_stage()
    add_quad("Gold", SIDE, NOWHERE, diffuse("Gold", 0.881, 0.554, 0.179))


@row("principled")
def principled() -> None:
    """Principled wall with its default gloss next to matte ones."""
    _lit_stage()
    red = shader_material("Lacquer", "ShaderNodeBsdfPrincipled", Base_Color=(0.8, 0.1, 0.05, 1))
    add_quad("Lacquer", SIDE, NOWHERE, red)


@row("mix-and-add")
def mix_and_add() -> None:
    """Mix Shader by a texture of two diffuse ones, and Add Shader of diffuse and emission."""
    _lit_stage()
    material = bpy.data.materials.new("Mixed")
    tree = emptied_nodes(material)
    checker = add_node(tree, "ShaderNodeTexChecker", Scale=1.5)
    tree.links.new(_object_coordinates(tree), checker.inputs["Vector"])
    mix, add = (tree.nodes.new(f"ShaderNode{kind}Shader") for kind in ("Mix", "Add"))
    red = add_node(tree, "ShaderNodeBsdfDiffuse", Color=(0.8, 0.1, 0.1, 1))
    blue = add_node(tree, "ShaderNodeBsdfDiffuse", Color=(0.1, 0.3, 0.8, 1))
    glow = add_node(tree, "ShaderNodeEmission", Color=(0.2, 1, 0.3, 1), Strength=0.2)
    tree.links.new(checker.outputs["Fac"], mix.inputs[0])
    tree.links.new(red.outputs[0], mix.inputs[1])
    tree.links.new(blue.outputs[0], add.inputs[0])
    tree.links.new(glow.outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    _paint("Left", material)


@row("textured-emission")
def textured_emission() -> None:
    """Panel that emits an image, through Principled's emission."""
    stage()
    screen = shader_material("Screen", "ShaderNodeBsdfPrincipled", Emission_Strength=6.0)
    shader = next(node for node in screen.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0, 0, 0, 1)
    shader.inputs["Specular IOR Level"].default_value = 0
    image = image_node(screen)
    screen.node_tree.links.new(image.outputs["Color"], shader.inputs["Emission Color"])
    corners = ((1.6, -1.2, 0.5), (1.6, 0.8, 0.5), (1.6, 0.8, 1.7), (1.6, -1.2, 1.7))
    panel = add_quad("Screen", corners, NOWHERE, screen)
    tile_uvs(panel)


@row("cut-out")
def cut_out() -> None:
    """Fence cut out of a plane by an image's alpha."""
    stage(blockers=False)
    fence = shader_material("Fence", "ShaderNodeMixShader")
    tree = fence.node_tree
    mix = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    image = image_node(fence)
    tree.links.new(image.outputs["Alpha"], mix.inputs[0])
    tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
    paint = add_node(tree, "ShaderNodeBsdfDiffuse", Color=(0.7, 0.4, 0.1, 1))
    tree.links.new(paint.outputs[0], mix.inputs[2])
    corners = ((-1.2, -0.6, 0), (1.4, -0.6, 0), (1.4, -0.6, 1.4), (-1.2, -0.6, 1.4))
    plane = add_quad("Fence", corners, NOWHERE, fence)
    tile_uvs(plane)
    add_lamp("POINT", location=(0.5, -1.7, 1.2), energy=100, shadow_soft_size=0.02)


def _lit_stage() -> None:
    """The stage under a lamp that makes the floor and the left wall bright."""
    stage()
    add_lamp("AREA", energy=60, size=0.6)


def _object_coordinates(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    """Add object coordinates, moved a little: no surface may lie where the squares of a checker end."""
    mapping = add_node(tree, "ShaderNodeMapping", Location=(0.1, 0.2, 0.3))
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], mapping.inputs["Vector"])
    return mapping.outputs["Vector"]


def image_node(material: bpy.types.Material) -> bpy.types.Node:
    """Add an image of eight by eight colored squares, some of them cut out, to a material's nodes."""
    image = bpy.data.images.new("Squares", 8, 8)
    pixels = np.ones((8, 8, 4), dtype=np.float32)
    pixels[..., :3] = np.random.default_rng(7).uniform(0.0, 1.0, (8, 8, 3)) ** 0.5
    pixels[..., 3] = np.random.default_rng(8).uniform(size=(8, 8)) < 0.6
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = image, "Closest"
    return node


def _paint(name: str, material: bpy.types.Material, color: bpy.types.Node | None = None) -> None:
    """Give an object a UV map of its own and a material, whose color is a node's."""
    obj = bpy.data.objects[name]
    tile_uvs(obj)
    obj.data.materials[0] = material
    if color is not None:
        shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_DIFFUSE")
        material.node_tree.links.new(color.outputs[0], shader.inputs["Color"])


def tile_uvs(obj: bpy.types.Object) -> None:
    """Add a UV map in which every face is the unit square, and make it the rendered one."""
    layer = obj.data.uv_layers.new(name="Tiling")
    layer.data.foreach_set("uv", [0, 0, 1, 0, 1, 1, 0, 1] * len(obj.data.polygons))
    layer.active_render = True
