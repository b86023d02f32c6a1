"""Lamps: shapes, softness, colors, and which objects they light."""

from __future__ import annotations

import math

import bpy

from . import row
from .stage import add_lamp, add_node, add_object, emptied_nodes, stage

LATER = (4, 5)
"""Lamps have a temperature, an exposure and `normalize` from here on."""


@row("point-hard")
def point_hard() -> None:
    """Point lamp of radius 0."""
    stage()
    add_lamp("POINT", energy=100, shadow_soft_size=0.0)


@row("point-soft")
def point_soft() -> None:
    """Point lamp of radius 0.2."""
    stage()
    add_lamp("POINT", energy=100, shadow_soft_size=0.2)


@row("point-sphere")
def point_sphere() -> None:
    """Point lamp of radius 0.4, soft falloff off."""
    stage()
    add_lamp("POINT", energy=100, shadow_soft_size=0.4, use_soft_falloff=False)


@row("point-falloff")
def point_falloff() -> None:
    """Point lamp of radius 0.3 just above the floor, soft falloff on."""
    stage()
    add_lamp("POINT", location=(0.9, -0.9, 0.4), energy=30, shadow_soft_size=0.3)


@row("spot-hard")
def spot_hard() -> None:
    """Spot of 50° without blend."""
    stage()
    add_lamp("SPOT", energy=300, spot_size=math.radians(50), spot_blend=0.0, shadow_soft_size=0.0)


@row("spot-blend")
def spot_blend() -> None:
    """Spot of 60°, blend 0.7."""
    stage()
    add_lamp("SPOT", energy=300, spot_size=math.radians(60), spot_blend=0.7, shadow_soft_size=0.0)


@row("spot-soft")
def spot_soft() -> None:
    """Spot of 45° and radius 0.2, blend 0.1."""
    stage()
    add_lamp("SPOT", energy=300, spot_size=math.radians(45), spot_blend=0.1, shadow_soft_size=0.2)


@row("spot-square")
def spot_square() -> None:
    """Spot with a square cone, which Cycles renders round."""
    stage()
    add_lamp("SPOT", energy=300, spot_size=math.radians(50), spot_blend=0.3, use_square=True)


@row("spot-stretched")
def spot_stretched() -> None:
    """Spot whose object is scaled unevenly: the cone becomes an ellipse."""
    stage()
    wide = add_lamp("SPOT", energy=300, spot_size=math.radians(50), spot_blend=0.2, shadow_soft_size=0.02)
    wide.scale = (1.6, 0.7, 1.0)


@row("sun-hard")
def sun_hard() -> None:
    """Sun of angle 0."""
    stage()
    add_lamp("SUN", energy=3, angle=0.0)


@row("sun-angle")
def sun_angle() -> None:
    """Sun of 12°."""
    stage()
    add_lamp("SUN", energy=3, angle=math.radians(12))


@row("area-square")
def area_square() -> None:
    """Square area lamp."""
    stage()
    add_lamp("AREA", energy=60, shape="SQUARE", size=0.6)


@row("area-rectangle")
def area_rectangle() -> None:
    """Area lamp of 1.6 × 0.1 m."""
    stage()
    add_lamp("AREA", energy=60, shape="RECTANGLE", size=1.6, size_y=0.1)


@row("area-disk")
def area_disk() -> None:
    """Round area lamp."""
    stage()
    add_lamp("AREA", energy=60, shape="DISK", size=0.8)


@row("area-ellipse")
def area_ellipse() -> None:
    """Elliptic area lamp, stretched further by its object."""
    stage()
    add_lamp("AREA", energy=60, shape="ELLIPSE", size=1.0, size_y=0.3).scale = (1.5, 1.0, 1.0)


@row("area-spread")
def area_spread() -> None:
    """Rectangular area lamp with a spread of 60°."""
    stage()
    add_lamp("AREA", energy=60, shape="RECTANGLE", size=0.8, size_y=0.5, spread=math.radians(60))


@row("area-spread-narrow")
def area_spread_narrow() -> None:
    """Round area lamp with a spread of 30°."""
    stage()
    narrow = {"shape": "DISK", "size": 0.8, "spread": math.radians(30)}
    add_lamp("AREA", (1.2, -1.0, 2.0), (0.9, -0.4, 0.0), energy=20, **narrow)


@row("area-spread-beam")
def area_spread_beam() -> None:
    """Square area lamp with a spread of 15°."""
    stage()
    narrow = {"shape": "SQUARE", "size": 0.8, "spread": math.radians(15)}
    add_lamp("AREA", (1.2, -1.0, 2.0), (0.9, -0.4, 0.0), energy=20, **narrow)


@row("area-spread-none")
def area_spread_none() -> None:
    """Square area lamp with a spread of 0: a beam whose rays are parallel."""
    stage()
    add_lamp("AREA", (1.2, -1.0, 3.0), (-0.2, 0.5, 0.3), energy=60, shape="SQUARE", size=2.2, spread=0.0)


@row("area-near")
def area_near() -> None:
    """Area lamp that reaches through the wall it stands at."""
    stage()
    add_lamp("AREA", location=(0.6, 1.9, 1.0), target=(0.6, 1.0, 0.0), energy=30, shape="SQUARE", size=0.7)


@row("lamp-color")
def lamp_color() -> None:
    """Three colored point lamps side by side."""
    stage()
    for number in range(3):
        color = [1.0 if number == channel else 0.05 for channel in range(3)]
        add_lamp("POINT", (1.6 - 0.5 * number, -1.0, 1.6), energy=40, shadow_soft_size=0.03, color=color)


@row("lamp-temperature", needs=LATER)
def lamp_temperature() -> None:
    """Point lamp of 2700 K and area lamp of 9000 K."""
    stage()
    warm = {"use_temperature": True, "temperature": 2700.0}
    add_lamp("POINT", (1.5, -0.4, 1.6), energy=60, shadow_soft_size=0.05, **warm)
    cold = {"use_temperature": True, "temperature": 9000.0}
    add_lamp("AREA", (0.2, -1.5, 1.6), energy=40, size=0.4, **cold)


@row("lamp-exposure", needs=LATER)
def lamp_exposure() -> None:
    """Lamps with exposures of +1.5 and −2."""
    stage()
    add_lamp("POINT", (1.5, -0.4, 1.6), energy=20, shadow_soft_size=0.05, exposure=1.5)
    add_lamp("SUN", energy=5, angle=0.02, exposure=-2.0)


@row("lamp-radiance", needs=LATER)
def lamp_radiance() -> None:
    """Point, spot and area lamps with Normalize off."""
    stage()
    add_lamp("POINT", (1.5, -0.4, 1.6), energy=150, shadow_soft_size=0.1, normalize=False)
    add_lamp("SPOT", energy=500, spot_size=0.8, shadow_soft_size=0.1, normalize=False)
    add_lamp("AREA", (0.2, -1.5, 1.6), energy=100, size=0.4, normalize=False)


@row("lamp-no-shadow")
def lamp_no_shadow() -> None:
    """Lamp that casts no shadow, next to one that does."""
    stage()
    # Where a bottom lies in the floor, Cycles lights it with what the floor has above.
    bpy.data.objects["Box"].location.z -= 0.01
    _cast_no_shadow(add_lamp("POINT", energy=60, shadow_soft_size=0.1))
    add_lamp("SUN", energy=0.5, angle=0.0, target=(-0.6, -0.2, 0.3))


def _cast_no_shadow(lamp: bpy.types.Object) -> None:
    if hasattr(lamp.data.cycles, "cast_shadow"):
        lamp.data.cycles.cast_shadow = False
    lamp.data.use_shadow = False


@row("lamp-blackbody")
def lamp_blackbody() -> None:
    """Lamps with nodes: blackbodies of 2000 K and 12,000 K."""
    stage()
    for place, kelvin in (((1.5, -0.4, 1.6), 2000.0), ((0.2, -1.5, 1.6), 12000.0)):
        tree, emission = _nodes_of(add_lamp("POINT", place, energy=60, shadow_soft_size=0.05))
        body = add_node(tree, "ShaderNodeBlackbody", Temperature=kelvin)
        tree.links.new(body.outputs[0], emission.inputs["Color"])


@row("lamp-nodes")
def lamp_nodes() -> None:
    """Lamp with nodes: a color from math nodes, and a Light Falloff that does not change it."""
    stage()
    tree, emission = _nodes_of(add_lamp("POINT", energy=60, shadow_soft_size=0.05))
    mix = add_node(tree, "ShaderNodeHueSaturation", Hue=0.3, Saturation=0.8, Color=(0.9, 0.3, 0.1, 1.0))
    tree.links.new(mix.outputs[0], emission.inputs["Color"])
    falloff = add_node(tree, "ShaderNodeLightFalloff", Strength=1.7)
    tree.links.new(falloff.outputs["Quadratic"], emission.inputs["Strength"])


def _nodes_of(lamp: bpy.types.Object) -> tuple[bpy.types.NodeTree, bpy.types.Node]:
    tree = emptied_nodes(lamp.data)
    emission = add_node(tree, "ShaderNodeEmission")
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    return tree, emission


@row("lamp-hidden")
def lamp_hidden() -> None:
    """Lamps hidden from renders or from diffuse rays, next to a visible one."""
    stage()
    add_lamp("POINT", energy=60, shadow_soft_size=0.05)
    add_lamp("POINT", (1.5, -0.4, 1.6), energy=60).hide_render = True
    add_lamp("AREA", (0.2, -1.5, 1.6), energy=60).visible_diffuse = False


@row("lamp-instances")
def lamp_instances() -> None:
    """Lamps of a collection that is instanced twice."""
    stage()
    group = bpy.data.collections.new("Lamps")
    lamp = add_lamp("SPOT", (0.0, 0.0, 0.0), (0.3, 0.5, -1.0), energy=150, spot_size=1.2)
    lamp.data.shadow_soft_size = 0.05
    bpy.context.scene.collection.objects.unlink(lamp)
    group.objects.link(lamp)
    for place, turn in (((0.8, -0.9, 1.8), 0.0), ((-0.6, -0.8, 1.6), -0.5)):
        empty = add_object("Both", None, location=place, rotation_euler=(0, 0, turn))
        empty.instance_type, empty.instance_collection = "COLLECTION", group
