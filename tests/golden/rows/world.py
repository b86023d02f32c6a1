"""Skies: plain ones, images, and the Sky Texture."""

from __future__ import annotations

import math

import bpy
import numpy as np

from . import row
from .stage import add_node, emptied_nodes, stage


@row("world-color", samples=48)
def world_color() -> None:
    """World of one color."""
    _open_stage()
    _, background = _world()
    background.inputs["Color"].default_value = (0.3, 0.5, 1.0, 1.0)


@row("world-hdri", samples=48)
def world_hdri() -> None:
    """Image with a small sun and a window, strength 0.7."""
    _open_stage()
    _hdri(0.0, 0.7)


@row("world-hdri-turned", samples=48)
def world_hdri_turned() -> None:
    """The same image, turned by 70° through a Mapping."""
    _open_stage()
    _hdri(math.radians(70), 0.7)


@row("world-gradient", samples=48)
def world_gradient() -> None:
    """Procedural sky of a Gradient Texture and a Color Ramp, plain white to the camera."""
    _open_stage()
    tree, background = _world()
    place = tree.nodes.new("ShaderNodeTexCoord")
    turn = add_node(tree, "ShaderNodeMapping", Rotation=(0.0, math.pi / 2, 0.3))
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color = (0.9, 0.2, 0.05, 1.0)
    ramp.color_ramp.elements[1].color = (0.05, 0.2, 0.9, 1.0)
    gradient = tree.nodes.new("ShaderNodeTexGradient")
    tree.links.new(place.outputs["Generated"], turn.inputs["Vector"])
    tree.links.new(turn.outputs[0], gradient.inputs["Vector"])
    tree.links.new(gradient.outputs["Fac"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs[0], background.inputs["Color"])
    plain = add_node(tree, "ShaderNodeBackground", Strength=5.0)
    mix, path = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(background.outputs[0], mix.inputs[1])
    tree.links.new(plain.outputs[0], mix.inputs[2])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


@row("sky-preetham", samples=48)
def sky_preetham() -> None:
    """Sky Texture, Preetham."""
    _open_stage()
    _sky("PREETHAM", sun_direction=(0.5, -0.6, 0.6), turbidity=3.0)


@row("sky-hosek-wilkie", samples=48)
def sky_hosek_wilkie() -> None:
    """Sky Texture, Hosek and Wilkie."""
    _open_stage()
    _sky("HOSEK_WILKIE", sun_direction=(0.5, -0.6, 0.6), turbidity=3.0, ground_albedo=0.4)


@row("sky-scattering", samples=48, needs=(5, 0))
def sky_scattering() -> None:
    """Sky Texture, single scattering, without a sun disc; Nishita before 5.0 is another sky, 2 % apart."""
    _open_stage()
    _sky("SINGLE_SCATTERING", sun_disc=False, sun_elevation=0.5, sun_rotation=2.4)


@row("sky-sun", samples=48, needs=(5, 0))
def sky_sun() -> None:
    """Sky Texture, single scattering, with its sun disc."""
    _open_stage()
    _sky("SINGLE_SCATTERING", sun_disc=True, sun_elevation=0.6, sun_rotation=2.4, strength=0.03)


@row("sky-multiple", samples=48, needs=(5, 0))
def sky_multiple() -> None:
    """Sky Texture, multiple scattering, with a sun disc of 4°."""
    _open_stage()
    _sky(
        "MULTIPLE_SCATTERING",
        sun_disc=True,
        sun_size=math.radians(4),
        sun_elevation=0.6,
        sun_rotation=2.4,
        strength=0.03,
    )


def _open_stage() -> None:
    """Build the stage; its box stands a little below the floor, lest rays from its bottom start in it."""
    stage()
    bpy.data.objects["Box"].location.z -= 0.01


def _sky(kind: str, strength: float = 0.3, **values: object) -> None:
    tree, background = _world()
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = kind
    for name, value in values.items():
        setattr(sky, name, value)
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = strength


def _world() -> tuple[bpy.types.NodeTree, bpy.types.Node]:
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    tree = emptied_nodes(world)
    background = add_node(tree, "ShaderNodeBackground")
    tree.links.new(background.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    return tree, background


def _hdri(turn: float, strength: float) -> None:
    """Light with an image of a blue sky, brown ground, a sun of 6° and a red window."""
    height, width = 64, 128
    latitude = (np.arange(height) + 0.5) / height - 0.5
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = np.where((latitude < 0)[:, None, None], (0.2, 0.15, 0.1), (0.3, 0.5, 0.9))
    pixels[46:48, 20:22, :3] = (900.0, 800.0, 600.0)
    pixels[36:44, 100:104, :3] = (20.0, 5.0, 3.0)
    image = bpy.data.images.new("Sky", width, height, float_buffer=True, is_data=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    tree, background = _world()
    place = tree.nodes.new("ShaderNodeTexCoord")
    mapping = add_node(tree, "ShaderNodeMapping", Rotation=(0.0, 0.0, turn))
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = strength
