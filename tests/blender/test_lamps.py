"""Lamps arrive in the solver as Cycles renders them: its bake is the measure."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import SceneError
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.lights.sun_and_sky import AreaLight, Lamp
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.scenes import add_lamp, add_mesh, add_node, add_object, measure_irradiance, with_nodes
from tests.wording import says

# A quad so small that the light hardly changes over it, tilted so that the cosine matters.
_METER = [(x * 0.0005, y * 0.0005, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
_TILT = (0.3, -0.2, 0.0)
_NORMALIZE = pytest.mark.skipif(
    "normalize" not in bpy.types.PointLight.bl_rna.properties,
    reason="this Blender's lamps have no such setting",
)

_ASIDE = {"location": (0.6, 0.3, 1.5)}
_AIMED = {"location": (0.6, 0.3, 1.5), "rotation_euler": (-0.2, 0.38, 0.5)}
_STRETCHED = {**_AIMED, "scale": (2.0, 0.5, 1.0)}
_WIDENED = {**_AIMED, "scale": (2.0, 2.0, 1.0)}
_MIRRORED = {**_AIMED, "scale": (-1.5, 1.0, 1.0)}
_TURNED_OVER = {**_AIMED, "scale": (1.0, 1.0, -1.0)}

_CASES: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "point": ("POINT", _ASIDE, {"shadow_soft_size": 0.0}),
    "point, soft falloff": ("POINT", _ASIDE, {"shadow_soft_size": 0.4}),
    "point, sphere": ("POINT", _ASIDE, {"shadow_soft_size": 0.4, "use_soft_falloff": False}),
    "point, scaled": ("POINT", {**_ASIDE, "scale": (2, 2, 2)}, {"shadow_soft_size": 0.4}),
    "spot, inside": ("SPOT", _AIMED, {"spot_size": 1.2, "spot_blend": 0.0, "shadow_soft_size": 0.0}),
    "spot, in the blend": ("SPOT", {"location": (0.6, 0, 1.5)}, {"spot_size": 0.9, "spot_blend": 0.8}),
    "spot, wide": ("SPOT", _AIMED, {"spot_size": 3.0, "spot_blend": 0.3, "shadow_soft_size": 0.3}),
    "spot, scaled": ("SPOT", {**_AIMED, "scale": (2, 2, 2)}, {"spot_size": 1.0, "shadow_soft_size": 0.0}),
    "spot, mirrored": ("SPOT", {**_AIMED, "scale": (-1, 1, 1)}, {"spot_size": 1.0, "shadow_soft_size": 0.0}),
    "spot, stretched": ("SPOT", _WIDENED, {"spot_size": 0.6, "spot_blend": 0.1, "shadow_soft_size": 0.0}),
    "spot, stretched unevenly": ("SPOT", _STRETCHED, {"spot_size": 1.4, "spot_blend": 0.9}),
    "sun": ("SUN", _AIMED, {"angle": 0.0}),
    "sun, wide": ("SUN", _AIMED, {"angle": 0.6}),
    "sun, scaled": ("SUN", {**_AIMED, "scale": (2, 2, 2)}, {"angle": 0.1}),
    "square": ("AREA", _AIMED, {"shape": "SQUARE", "size": 0.8}),
    "rectangle": ("AREA", _AIMED, {"shape": "RECTANGLE", "size": 0.8, "size_y": 0.3}),
    "disk": ("AREA", _AIMED, {"shape": "DISK", "size": 0.8}),
    "ellipse": ("AREA", _AIMED, {"shape": "ELLIPSE", "size": 0.8, "size_y": 0.3}),
    "square, stretched": ("AREA", _STRETCHED, {"shape": "SQUARE", "size": 0.8}),
    "rectangle, stretched": ("AREA", _STRETCHED, {"shape": "RECTANGLE", "size": 0.8, "size_y": 0.3}),
    "disk, stretched": ("AREA", _STRETCHED, {"shape": "DISK", "size": 0.8}),
    "ellipse, mirrored": ("AREA", _MIRRORED, {"shape": "ELLIPSE", "size": 0.8, "size_y": 0.3}),
    "rectangle, narrow": ("AREA", _AIMED, {"shape": "RECTANGLE", "size": 0.8, "size_y": 0.3, "spread": 1.0}),
    "square, facing away": ("AREA", _TURNED_OVER, {"shape": "SQUARE", "size": 0.8}),
}
_LATER_CASES: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "exposure": ("POINT", _ASIDE, {"shadow_soft_size": 0.0, "exposure": 1.5}),
    "temperature": ("AREA", _AIMED, {"use_temperature": True, "temperature": 3000.0}),
    "point as radiance": ("POINT", _ASIDE, {"shadow_soft_size": 0.2, "normalize": False}),
    "spot as radiance": ("SPOT", _AIMED, {"shadow_soft_size": 0.2, "spot_size": 1.2, "normalize": False}),
    "sun as radiance": ("SUN", _AIMED, {"angle": 0.3, "normalize": False}),
    "area as radiance": ("AREA", _STRETCHED, {"shape": "DISK", "size": 0.8, "normalize": False}),
}


@pytest.fixture
def meter() -> bpy.types.Object:
    return add_mesh("Meter", _METER, rotation_euler=_TILT)


def _exported() -> tuple[list[Lamp], tuple]:
    scene = export_scene(bpy.context, BakeSettings()).bake_scene
    return list(scene.scene.lights), scene.warnings


def _irradiance(meter: bpy.types.Object) -> np.ndarray:
    """What the exported lamps shine on the meter, (3,) [W/m²]."""
    lamps, _ = _exported()
    normal = np.array(meter.matrix_world.to_3x3().col[2])[None]
    return sum(
        (lamp.unit_irradiance(np.zeros((1, 3)), normal) * lamp.strength for lamp in lamps), np.zeros(3)
    )


@pytest.mark.parametrize("case", _CASES)
def test_lamps_shine_as_in_cycles(meter: bpy.types.Object, case: str) -> None:
    kind, transform, values = _CASES[case]
    add_lamp(kind, transform=transform, energy=7.0, color=(1.0, 0.5, 0.25), **values)
    measured = measure_irradiance(meter)
    np.testing.assert_allclose(_irradiance(meter), measured, rtol=2e-3, atol=1e-7)
    assert (measured.sum() > 0) == ("away" not in case)


@_NORMALIZE
@pytest.mark.parametrize("case", _LATER_CASES)
def test_later_settings_act_as_in_cycles(meter: bpy.types.Object, case: str) -> None:
    kind, transform, values = _LATER_CASES[case]
    add_lamp(kind, transform=transform, energy=7.0, color=(1.0, 0.5, 0.25), **values)
    np.testing.assert_allclose(_irradiance(meter), measure_irradiance(meter), rtol=2e-3)


def test_a_lamps_own_nodes_scale_it_as_in_cycles(meter: bpy.types.Object) -> None:
    lamp = add_lamp("POINT", transform=_ASIDE, energy=7.0, shadow_soft_size=0.0)
    if bpy.app.version < (5, 1):
        lamp.data.use_nodes = True
    tree = with_nodes(lamp.data)
    emission = add_node(tree, "ShaderNodeEmission", Color=(0.2, 0.4, 0.8, 1.0), Strength=3.0)
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    np.testing.assert_allclose(_irradiance(meter), measure_irradiance(meter), rtol=2e-3)


def test_instances_of_a_lamp_light_too(meter: bpy.types.Object) -> None:
    group = bpy.data.collections.new("Lamps")
    add_object("Bulb", bpy.data.lights.new("Bulb", "POINT"), group, location=(0, 0, 1)).data.energy = 10.0
    for x in (-0.5, 0.5):
        empty = add_object("Two", None, None, location=(x, 0.2, 0.5))
        empty.instance_type, empty.instance_collection = "COLLECTION", group
    lamps, _ = _exported()
    np.testing.assert_allclose(
        [lamp.position for lamp in lamps], [(-0.5, 0.2, 1.5), (0.5, 0.2, 1.5)], rtol=1e-6
    )
    np.testing.assert_allclose(_irradiance(meter), measure_irradiance(meter), rtol=2e-3)


def test_a_lamp_hidden_from_renders_does_not_light(meter: bpy.types.Object) -> None:
    add_lamp("POINT", energy=7.0).hide_render = True
    lamps, warnings = _exported()
    assert lamps == []
    assert "no light" in warnings[0].message


def test_a_lamp_hidden_in_the_viewport_only_lights(meter: bpy.types.Object) -> None:
    add_lamp("POINT", energy=7.0, transform=_ASIDE).hide_viewport = True
    assert len(_exported()[0]) == 1


def test_a_lamp_hidden_from_diffuse_rays_does_not_light(meter: bpy.types.Object) -> None:
    add_lamp("POINT", energy=7.0, transform=_ASIDE).visible_diffuse = False
    assert _exported()[0] == []
    assert not measure_irradiance(meter).any()


def test_nodes_that_shine_unevenly_warn(meter: bpy.types.Object) -> None:
    lamp = add_lamp("POINT", "Gobo", transform=_ASIDE, energy=7.0, shadow_soft_size=0.0)
    if bpy.app.version < (5, 1):
        lamp.data.use_nodes = True
    tree = with_nodes(lamp.data)
    emission, place = add_node(tree, "ShaderNodeEmission"), tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(place.outputs["Normal"], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    (warning,) = _exported()[1]
    assert warning.name == "Gobo"
    assert "depend on direction" in warning.message
    assert len(bpy.data.scenes) == 1


def test_negative_power_counts_as_none(meter: bpy.types.Object) -> None:
    add_lamp("POINT", "Thief", energy=-7.0)
    lamps, warnings = _exported()
    assert lamps == []
    assert warnings[0].name == "Thief"
    assert "negative power" in warnings[0].message


def test_a_lamp_at_an_infinite_place_is_an_error(meter: bpy.types.Object) -> None:
    add_lamp("POINT", "Far", energy=7.0, transform={"location": (math.inf, 0, 0)})
    with pytest.raises(SceneError, match=r"lamp 'Far'"):
        _exported()


def test_an_area_lamp_without_area_is_an_error(meter: bpy.types.Object) -> None:
    add_lamp("AREA", "Flat", energy=7.0, transform={"scale": (0, 1, 1)})
    with pytest.raises(SceneError, match=r"'Flat'.*area"):
        _exported()


def test_a_portal_is_no_lamp(meter: bpy.types.Object) -> None:
    add_lamp("AREA", energy=7.0).data.cycles.is_portal = True
    assert _exported()[0] == []


@pytest.mark.parametrize(
    ("kind", "attribute", "value", "words"),
    [
        ("SPOT", "use_square", True, "square cone"),
    ],
)
def test_what_is_not_understood_warns(
    meter: bpy.types.Object, kind: str, attribute: str, value: Any, words: str
) -> None:
    add_lamp(kind, "Odd", energy=7.0, **{attribute: value})
    (warning,) = _exported()[1]
    assert warning.name == "Odd"
    assert words in warning.message


def test_a_lamps_own_limit_of_bounces_warns(meter: bpy.types.Object) -> None:
    lamp = add_lamp("POINT", "Short", energy=7.0)
    assert not _exported()[1]
    lamp.data.cycles.max_bounces = 2
    (warning,) = _exported()[1]
    assert says(warning.message, "Short", "bounces")


def test_an_area_lamp_keeps_its_power_when_scaled() -> None:
    add_mesh("Floor")
    add_lamp("AREA", energy=5.0, shape="ELLIPSE", size=2.0, size_y=1.0, transform={"scale": (3.0, 2.0, 1.0)})
    (light,) = _exported()[0]
    assert isinstance(light, AreaLight)
    assert light.area == pytest.approx(math.pi / 4 * 6.0 * 2.0, rel=1e-6)
    np.testing.assert_allclose(light.power, 5.0)


@pytest.mark.parametrize("output", ["Quadratic", "Linear", "Constant"])
def test_nodes_that_change_light_with_distance_warn(meter: bpy.types.Object, output: str) -> None:
    lamp = add_lamp("POINT", energy=1.0)
    if bpy.app.version < (5, 1):
        lamp.data.use_nodes = True
    tree = with_nodes(lamp.data)
    emission, falloff = (add_node(tree, f"ShaderNode{kind}") for kind in ("Emission", "LightFalloff"))
    falloff.inputs["Strength"].default_value = 1.0
    tree.links.new(falloff.outputs[output], emission.inputs["Strength"])
    tree.links.new(emission.outputs[0], tree.nodes.new("ShaderNodeOutputLight").inputs["Surface"])
    said = [warning.message for warning in _exported()[1]]
    assert len(said) == (output != "Quadratic")
    assert all(says(message, "Lamp", "nodes", "distance") for message in said)


def test_a_spot_sends_what_its_cone_holds_wherever_it_is() -> None:
    """Intensity power/4π, times the solid angle 2π(1 − cos(angle/2)), times 1 − blend/2 for the edge."""
    add_mesh("Floor")
    power, angle, blend = 5.0, 0.9, 0.5
    turned = {"location": (3.0, -2.0, 7.0), "rotation_euler": (0.4, 0.2, 0.1), "scale": (2.0, 2.0, 2.0)}
    add_lamp("SPOT", energy=power, spot_size=angle, spot_blend=blend, transform=turned)
    (light,) = _exported()[0]
    flux = power / (4 * math.pi) * 2 * math.pi * (1 - math.cos(angle / 2)) * (1 - blend / 2)
    np.testing.assert_allclose(light.flux, flux, rtol=1e-6)
