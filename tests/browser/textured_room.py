"""A room with what exports must get right: instances, emission, cut-outs, procedural colors, UV layers."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np


def build(path: Path) -> None:
    """Build the room and save it."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    checks, leaf = _images()
    checked, cut_out = _textured("Checked", checks, 0.4), _textured("Leaf", leaf, 0.5, cut_out=True)
    noise, panel, diffuse = _noise(), _panel(), _diffuse()
    plane, quarter = bpy.ops.mesh.primitive_plane_add, math.pi / 2
    _add("Floor", plane, checked, (0, 0, 0), (3, 3, 1))
    _add("Back", plane, noise, (0, 3, 1.5), (3, 1.5, 1), (quarter, 0, 0))
    bare = _add("Left", plane, diffuse, (-3, 0, 1.5), (1.5, 3, 1), (0, quarter, 0))
    while bare.data.uv_layers:
        bare.data.uv_layers.remove(bare.data.uv_layers[0])
    two = _add("Right", plane, checked, (3, 0, 1.5), (1.5, 3, 1), (0, -quarter, 0))
    two.data.uv_layers.new(name="Second")
    _add("Ceiling", plane, diffuse, (0, 0, 3), (3, 3, 1), (math.pi, 0, 0))
    _add("Lamp Panel", plane, panel, (0, 0, 2.8), (0.7, 0.7, 1), (math.pi, 0, 0))
    cube = _add("Cube", bpy.ops.mesh.primitive_cube_add, checked, (-1, 1, 0.5), (0.5,) * 3, (0, 0, 0.4))
    for number, (scale, place) in enumerate(
        [
            ((0.3, 0.3, 0.8), (1, 1.5, 0.8)),
            ((-0.4, 0.4, 0.4), (1.8, 0, 0.4)),
            ((0.2, 0.5, 0.3), (-2, -0.5, 0.3)),
        ]
    ):
        instance = _instance(cube, f"Instance {number}")
        instance.scale, instance.location = scale, place
    holder = bpy.data.objects.new("Holder", None)
    bpy.context.scene.collection.objects.link(holder)
    holder.location, holder.rotation_euler, holder.scale = (0.3, -0.5, 0), (0, 0, 0.7), (1, 1.6, 1)
    for number in range(2):
        nested = _instance(cube, f"Nested {number}")
        nested.parent = holder
        nested.scale, nested.rotation_euler = (0.2, 0.2, 0.4 + 0.2 * number), (0, 0, 0.3)
        nested.location = (0.5 * number, 0, 0.4 + 0.2 * number)
    _add("Leaves", plane, cut_out, (-1.8, 2, 1.2), (0.6, 0.6, 1), (quarter, 0, 0.3))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler, camera.data.lens = (0, -7.5, 1.6), (quarter - 0.03, 0, 0), 35
    scene = bpy.context.scene
    scene.camera, scene.render.resolution_x, scene.render.resolution_y = camera, 320, 240
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def _images() -> tuple[bpy.types.Image, bpy.types.Image]:
    rows, columns = np.indices((64, 64))
    checks, leaf = np.ones((64, 64, 4), np.float32), np.ones((64, 64, 4), np.float32)
    even = ((rows + columns) // 8) % 2
    checks[..., :3] = np.where(even[..., None], [0.8, 0.5, 0.3], [0.3, 0.5, 0.7])
    leaf[..., :3] = [0.3, 0.7, 0.2]
    leaf[..., 3] = (columns - 31.5) ** 2 / 200 + (rows - 31.5) ** 2 / 900 < 1
    return _image("checks", checks), _image("leaf", leaf)


def _image(name: str, pixels: np.ndarray) -> bpy.types.Image:
    image = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], alpha=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def _principled(name: str) -> tuple[bpy.types.Material, bpy.types.NodeTree, bpy.types.Node]:
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    return material, tree, next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")


def _textured(name: str, image: bpy.types.Image, roughness: float, *, cut_out: bool = False) -> Any:
    material, tree, shader = _principled(name)
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = roughness
    if cut_out:
        rounded = tree.nodes.new("ShaderNodeMath")
        rounded.operation = "ROUND"
        tree.links.new(texture.outputs["Alpha"], rounded.inputs[0])
        tree.links.new(rounded.outputs[0], shader.inputs["Alpha"])
    return material


def _noise() -> bpy.types.Material:
    material, tree, shader = _principled("Noise")
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 1.5, 0.0
    tree.links.new(noise.outputs["Color"], shader.inputs["Base Color"])
    return material


def _panel() -> bpy.types.Material:
    material, _, shader = _principled("Panel")
    shader.inputs["Emission Color"].default_value = (1.0, 0.9, 0.7, 1.0)
    shader.inputs["Emission Strength"].default_value = 6.0
    return material


def _diffuse() -> bpy.types.Material:
    material, tree, shader = _principled("Diffuse")
    tree.nodes.remove(shader)
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.7, 0.6, 0.5, 1.0)
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material


def _add(
    name: str, operator: Callable[[], Any], material: Any, place: Any, scale: Any, turn: Any = (0, 0, 0)
) -> bpy.types.Object:
    operator()
    obj = bpy.context.object
    obj.name = obj.data.name = name
    obj.location, obj.scale, obj.rotation_euler = place, scale, turn
    obj.data.materials.append(material)
    return obj


def _instance(obj: bpy.types.Object, name: str) -> bpy.types.Object:
    copy = obj.copy()
    copy.name = name
    bpy.context.scene.collection.objects.link(copy)
    return copy
