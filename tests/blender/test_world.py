"""The world, and surfaces that emit, light as much as they do in Cycles."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from radiosity_addon.bake_scene import BakeScene
from radiosity_addon.blender.export import export_scene
from radiosity_addon.settings import BakeSettings
from radiosity_addon.solver.form_factor import point_to_polygon
from radiosity_addon.solver.lights import EnvironmentLight
from tests.blender.scenes import QUAD, add_mesh, add_node, measure_irradiance, set_world, shader_material

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
def test_a_world_without_nodes_has_its_colour() -> None:
    meter = add_mesh("Meter", _METER)
    world = bpy.data.worlds.new("Plain")
    world.color = (0.1, 0.2, 0.4)
    bpy.context.scene.world = world
    (light,) = _exported().scene.lights
    np.testing.assert_allclose(math.pi * np.asarray(light.radiance), measure_irradiance(meter), rtol=1e-4)


def test_a_world_texture_counts_with_its_mean_over_the_sphere() -> None:
    meter = add_mesh("Meter", _METER)
    image = bpy.data.images.new("Sky", 8, 4, float_buffer=True, is_data=True)
    rows = np.array([0.0, 1.0, 2.0, 6.0], dtype=np.float32)  # from below upwards
    pixels = np.ones((4, 8, 4), dtype=np.float32)
    pixels[..., :3] = rows[:, None, None]
    image.pixels.foreach_set(pixels.ravel())
    world = set_world(0, 0, 0)
    tree = world.node_tree
    texture = add_node(tree, "ShaderNodeTexEnvironment")
    texture.image = image
    tree.links.new(texture.outputs[0], next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Color"])
    scene = _exported()
    weights = np.sin((np.arange(4) + 0.5) / 4 * math.pi)
    (light,) = scene.scene.lights
    np.testing.assert_allclose(light.radiance, np.full(3, rows @ weights / weights.sum()), rtol=1e-6)
    (warning,) = scene.warnings
    assert warning.name == "World"
    assert "image 'Sky'; the mean" in warning.message
    assert meter.name == "Meter"


def test_a_sky_texture_warns_with_the_value_used() -> None:
    add_mesh("Floor")
    tree = set_world(0.2, 0.3, 0.4).node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    tree.links.new(sky.outputs[0], next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Color"])
    scene = _exported()
    (light,) = scene.scene.lights
    np.testing.assert_allclose(light.radiance, (0.2, 0.3, 0.4), rtol=1e-6)
    assert "Sky Texture" in scene.warnings[0].message
    assert "(0.2, 0.3, 0.4) is used" in scene.warnings[0].message


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
