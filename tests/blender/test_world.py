"""The world, and surfaces that emit, light as much as they do in Cycles."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
import pytest
from mathutils import Vector

from radiosity_addon.blender.cycles import world_pixels
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.form_factors.formulas import point_to_polygon
from radiosity_addon.lights.environment import (
    BRIGHT,
    SKY_CELLS,
    SkyPatch,
    cell_directions,
    pixel_bounds,
    solid_angles,
)
from radiosity_addon.lights.sun_and_sky import EnvironmentLight
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from tests.blender.scenes import QUAD, add_mesh, add_node, measure_irradiance, set_world, shader_material
from tests.wording import says

_METER = [(x * 0.0005, y * 0.0005, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]


def _exported(**settings: bool) -> BakeScene:
    return export_scene(bpy.context, BakeSettings(**settings)).bake_scene


def test_the_world_shines_as_in_cycles() -> None:
    meter = add_mesh("Meter", _METER, rotation_euler=(0.7, 0.2, 0))
    set_world(0.3, 0.5, 0.7, strength=2.0)
    (light,) = _exported().scene.lights
    assert isinstance(light, EnvironmentLight)
    np.testing.assert_allclose(math.pi * np.asarray(light.radiance), measure_irradiance(meter), rtol=1e-4)


def test_no_world_and_a_black_world_are_dark() -> None:
    add_mesh("Floor")
    assert _exported().scene.lights == ()
    set_world(0.0, 0.0, 0.0)
    assert _exported().scene.lights == ()
    set_world(1.0, 1.0, 1.0, strength=0.0)
    assert _exported().scene.lights == ()


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="worlds always have nodes here")
def test_a_world_without_nodes_has_its_color() -> None:
    meter = add_mesh("Meter", _METER)
    world = bpy.data.worlds.new("Plain")
    world.color = (0.1, 0.2, 0.4)
    bpy.context.scene.world = world
    (light,) = _exported().scene.lights
    np.testing.assert_allclose(math.pi * np.asarray(light.radiance), measure_irradiance(meter), rtol=1e-4)


@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_a_world_image_lights_as_in_cycles(turn: float) -> None:
    meter = add_mesh("Meter", _METER, rotation_euler=(0.7, 0.2, 0))
    image = bpy.data.images.new("Sky", 16, 8, float_buffer=True, is_data=True)
    pixels = np.random.default_rng(1).random((8, 16, 4), dtype=np.float32)
    pixels[6, 5] = 60.0  # a sun
    image.pixels.foreach_set(pixels.ravel())
    tree = set_world(0, 0, 0, strength=0.5).node_tree
    texture, place = add_node(tree, "ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeTexCoord")
    texture.image, texture.interpolation = image, "Closest"
    mapping = add_node(tree, "ShaderNodeMapping", Rotation=(0, 0, turn))
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs[0], next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Color"])
    scene = _exported()
    assert scene.warnings == ()
    assert len(bpy.data.scenes) == len(bpy.data.worlds) == 1
    normal = np.array(meter.matrix_world.to_3x3().col[2])
    np.testing.assert_allclose(_irradiance(scene, normal), measure_irradiance(meter, samples=256), rtol=5e-3)


SUN, GLOW, SPOT = (1e5, 0.27), (20.0, 9.0), (12.0, 0.8)
"""Radiance [W/m²/sr], and half angle [degrees]."""


def _set_discs(discs: Sequence[tuple[tuple[float, float], Vector]]) -> None:
    """Set a sky of radiance 1 with brighter discs: each a radiance and half angle, and a direction."""
    tree = set_world(1, 1, 1).node_tree
    toward = tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    strength = next(node for node in tree.nodes if node.type == "BACKGROUND").inputs["Strength"]
    total = tree.nodes.new("ShaderNodeValue").outputs[0]
    total.default_value = 1.0

    def calculated(kind: str, operation: str, *values: object, output: str = "Value") -> bpy.types.NodeSocket:
        node = tree.nodes.new(kind)
        node.operation = operation
        for socket, value in zip(node.inputs, values, strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node.outputs[output]

    for (radiance, degrees), direction in discs:
        # The sine of a small angle is exact to float32, unlike its cosine.
        across = calculated("ShaderNodeVectorMath", "CROSS_PRODUCT", toward, direction, output="Vector")
        sine = calculated("ShaderNodeVectorMath", "LENGTH", across)
        ahead = calculated("ShaderNodeVectorMath", "DOT_PRODUCT", toward, direction)
        near = calculated("ShaderNodeMath", "LESS_THAN", sine, math.sin(math.radians(degrees)))
        there = calculated(
            "ShaderNodeMath", "MULTIPLY", near, calculated("ShaderNodeMath", "GREATER_THAN", ahead, 0.0)
        )
        total = calculated("ShaderNodeMath", "MULTIPLY_ADD", there, radiance, total)
    tree.links.new(total, strength)


@pytest.mark.parametrize("degrees", [(15.0, 0.0), (40.2, 77.0), (3.1, -179.9), (88.0, 30.0)])
def test_a_sun_in_a_wide_glow_has_its_power_and_size(degrees: tuple[float, float]) -> None:
    """The first look at the sky, with pixels of 0.7°, hits it with a handful of samples."""
    add_mesh("Floor")
    latitude, azimuth = np.radians(degrees)
    sun = Vector(
        (math.cos(latitude) * math.cos(azimuth), math.cos(latitude) * math.sin(azimuth), math.sin(latitude))
    )
    _set_discs([(SUN, sun), (GLOW, sun)])
    scene = _exported()
    discs = sum(radiance * math.sin(math.radians(angle)) ** 2 for radiance, angle in (SUN, GLOW))
    np.testing.assert_allclose(_irradiance(scene, np.array(sun)), math.pi * (1.0 + discs), rtol=5e-3)
    brightest = max(
        (light for light in scene.scene.lights if isinstance(light, SkyPatch)),
        key=lambda light: light.strength.sum(),
    )
    rays, _, _ = brightest.shadow_rays(
        np.zeros((1, 3)), np.array(sun)[None], np.random.default_rng(0).random((1, 4096, 2))
    )
    angles = np.degrees(np.arccos(np.clip(rays[0] @ np.array(sun), -1.0, 1.0)))
    mean = 1.0 + sum(
        0.5 * radiance * (1.0 - math.cos(math.radians(angle))) for radiance, angle in (SUN, GLOW)
    )
    of_sun, of_glow = (
        above * math.sin(math.radians(angle)) ** 2
        for above, angle in ((SUN[0], SUN[1]), (1.0 + GLOW[0] - BRIGHT * mean, GLOW[1]))
    )
    # Next to the sun there is nothing but glow, little of it.
    share = (angles < 1.1 * SUN[1]).mean()
    np.testing.assert_allclose(share, of_sun / (of_sun + of_glow), atol=0.02)


def test_a_sky_is_looked_at_again_only_for_a_sun(monkeypatch: pytest.MonkeyPatch) -> None:
    add_mesh("Floor")
    spots = [(SPOT, Vector((math.cos(angle), math.sin(angle), 0.3)).normalized()) for angle in range(1, 6)]
    sun = Vector((0, 0.6, 0.8))
    _set_discs([(SUN, sun), *spots])
    looks = []
    render = world_pixels.look_around

    def noted(*args: object) -> np.ndarray:
        looks.append(args)
        return render(*args)

    monkeypatch.setattr(world_pixels, "look_around", noted)
    scene = _exported()
    assert len([light for light in scene.scene.lights if isinstance(light, SkyPatch)]) == 6
    assert len(looks) == 2


def test_what_only_the_camera_sees_does_not_light() -> None:
    add_mesh("Floor")
    tree = set_world(0.2, 0.3, 0.4).node_tree
    plain = add_node(tree, "ShaderNodeBackground", Strength=9.0)
    mix, path = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(next(n for n in tree.nodes if n.type == "BACKGROUND").outputs[0], mix.inputs[1])
    tree.links.new(plain.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs["Surface"])
    (light,) = _exported().scene.lights
    np.testing.assert_allclose(light.radiance, (0.2, 0.3, 0.4), rtol=1e-5)


def _irradiance(scene: BakeScene, normal: np.ndarray) -> np.ndarray:
    """What an open plane receives of the exported sky, (3,) [W/m²]."""
    total = np.zeros(3)
    toward, angle = cell_directions(SKY_CELLS), solid_angles(pixel_bounds(SKY_CELLS))
    for light in scene.scene.lights:
        if isinstance(light, EnvironmentLight):
            share = light.relative(toward) * np.maximum(toward @ normal, 0.0)
            total += light.strength * float(share @ angle)
        else:
            total += light.unit_irradiance(np.zeros((1, 3)), normal[None])[0] * light.strength
    return total


def test_the_plain_sky_comes_only_where_there_is_no_light() -> None:
    add_mesh("Floor")
    (light,) = _exported(sky=True).scene.lights
    np.testing.assert_array_equal(light.radiance, (1.0, 1.0, 1.0))
    assert not _exported(sky=True).warnings
    add_mesh("Glow", material=shader_material("Glow", "ShaderNodeEmission"), location=(0, 0, 1))
    assert _exported(sky=True).scene.lights == ()


@pytest.mark.parametrize("turned", [False, True], ids=["front", "back"])
@pytest.mark.parametrize("shader", ["ShaderNodeEmission", "ShaderNodeBsdfPrincipled"])
def test_a_surface_emits_from_both_sides_as_in_cycles(shader: str, turned: bool) -> None:
    meter = add_mesh("Meter", _METER, rotation_euler=(0.3, -0.2, 0))
    if shader == "ShaderNodeEmission":
        glow = shader_material("Glow", shader, Color=(1.0, 0.5, 0.25, 1.0), Strength=3.0)
    else:
        black = (0.0, 0.0, 0.0, 1.0)
        glow = shader_material(
            "Glow", shader, Base_Color=black, Emission_Color=(1.0, 0.5, 0.25, 1.0), Emission_Strength=3.0
        )
    add_mesh(
        "Panel", QUAD, material=glow, location=(0.5, 0.2, 1.3), rotation_euler=(math.pi * turned, 0, 0.4)
    )
    scene = _exported()
    panel = scene.scene.triangles[scene.objects[1].rows]
    normal = np.array(meter.matrix_world.to_3x3().col[2])
    faces_meter = scene.scene.face_normals[2] @ panel[0, 0] < 0
    assert faces_meter == turned
    factors = [
        np.abs(point_to_polygon(np.zeros((1, 3)), normal[None], corners[None])).sum()
        + np.abs(point_to_polygon(np.zeros((1, 3)), normal[None], corners[None, ::-1])).sum()
        for corners in panel
    ]
    expected = sum(factors) * scene.scene.emission[2]
    np.testing.assert_allclose(expected, measure_irradiance(meter, samples=64), rtol=3e-3)


def test_a_world_s_limit_of_bounces_warns() -> None:
    add_mesh("Floor")
    world = set_world(1.0, 1.0, 1.0)
    assert not _exported().warnings
    world.cycles.max_bounces = 2
    (warning,) = _exported().warnings
    assert says(warning.message, "World", "bounces")
