"""Glass of materials: what passes by color, the usual trick, the options, and the material it keeps."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import SceneError
from radiosity_addon.blender.jobs.inspection import inspect
from radiosity_addon.blender.materials.materials import Surface, read_material
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.textures import SurfaceImages
from tests.blender.hand_bake import bake_by_hand
from tests.blender.scenes import add_mesh, add_node, shader_material
from tests.golden.usual_trick import let_light_through
from tests.wording import one_says

TINT = (0.8, 0.4, 0.1, 1.0)

SQUARE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))


def read(material: bpy.types.Material) -> Surface:
    return read_material(material, lets_through=True)


def passed(surface: Surface) -> np.ndarray:
    """What goes through by channel."""
    return np.full(3, 1.0 - surface.opacity) if surface.passed is None else surface.passed


def messages(surface: Surface) -> list[str]:
    return [warning.message for warning in surface.warnings]


@pytest.mark.parametrize("shader", ["ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction"])
def test_glass_passes_its_color_and_reflects_nothing(shader: str) -> None:
    surface = read(shader_material("Pane", shader, Color=TINT, Roughness=0.0))
    np.testing.assert_allclose(passed(surface), TINT[:3], rtol=1e-6)
    assert surface.opacity == pytest.approx(1 - np.mean(TINT[:3]))
    assert not surface.reflectance.any()
    assert surface.is_clear
    assert messages(surface) == []


def test_a_solid_of_principled_glass_passes_its_base_color() -> None:
    """Each of its two walls passes the root, as in Cycles."""
    inputs = {"Base_Color": TINT, "Transmission_Weight": 1.0, "Roughness": 0.0}
    surface = read(shader_material("Pane", "ShaderNodeBsdfPrincipled", **inputs))
    np.testing.assert_allclose(passed(surface) ** 2, TINT[:3], rtol=1e-6)
    assert surface.is_clear


def test_partial_transmission_leaves_the_rest_of_the_surface() -> None:
    inputs = {"Base_Color": TINT, "Roughness": 0.3}
    opaque = read(shader_material("Paint", "ShaderNodeBsdfPrincipled", **inputs))
    half = read(shader_material("Half", "ShaderNodeBsdfPrincipled", Transmission_Weight=0.5, **inputs))
    np.testing.assert_allclose(passed(half), 0.5 * np.sqrt(TINT[:3]), rtol=1e-6)
    np.testing.assert_allclose(half.reflectance * half.opacity, 0.5 * opaque.reflectance, rtol=1e-6)
    assert not half.is_clear


def test_paint_added_to_glass_reflects_what_does_not_pass() -> None:
    material = shader_material("Sum", "ShaderNodeAddShader")
    tree = material.node_tree
    add = next(node for node in tree.nodes if node.type == "ADD_SHADER")
    for socket, (shader, color) in zip(
        add.inputs, {"Transparent": TINT, "Diffuse": (0.1, 0.5, 0.5, 1)}.items(), strict=True
    ):
        made = add_node(tree, f"ShaderNodeBsdf{shader}", Color=color)
        tree.links.new(made.outputs[0], socket)
    surface = read(material)
    np.testing.assert_allclose(passed(surface), TINT[:3], rtol=1e-6)
    # Red has 0.2 left of which it uses half, green 0.6 of which it uses 0.5.
    np.testing.assert_allclose(surface.reflectance * surface.opacity, (0.1, 0.5, 0.5), rtol=1e-6)
    assert surface.warnings == ()
    tree.nodes["Diffuse BSDF"].inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    surface = read(material)
    np.testing.assert_allclose(surface.reflectance * surface.opacity, (0.99 * 0.2, 0.5, 0.5), rtol=1e-6)
    assert one_says(messages(surface), "Sum", "clamped", "passes (0.8, 0.4, 0.1)")


def test_glass_mixed_with_transparent_passes_the_mean() -> None:
    material = shader_material("Pane", "ShaderNodeMixShader")
    tree = material.node_tree
    mix = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    mix.inputs[0].default_value = 0.25
    tree.links.new(add_node(tree, "ShaderNodeBsdfGlass", Color=TINT, Roughness=0.0).outputs[0], mix.inputs[1])
    tree.links.new(add_node(tree, "ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
    np.testing.assert_allclose(passed(read(material)), 0.75 * np.array(TINT[:3]) + 0.25, rtol=1e-6)


@pytest.mark.parametrize(
    "shader", ["ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction", "ShaderNodeBsdfPrincipled"]
)
def test_the_usual_trick_is_read_as_the_glass_alone(shader: str) -> None:
    """As artists set it up: transparent to shadow and diffuse rays."""
    principled = shader == "ShaderNodeBsdfPrincipled"
    color = {"Base_Color": TINT, "Transmission_Weight": 1.0} if principled else {"Color": TINT}
    material = shader_material("Pane", shader, Roughness=0.0, **color)
    alone = read(material)
    add_mesh("Window", material=material)
    assert let_light_through(bpy.context.scene) == ["Pane"]
    mixed = read(material)
    np.testing.assert_allclose(passed(mixed), passed(alone), rtol=1e-6)
    assert mixed.is_clear
    assert not mixed.varies


def test_frosted_glass_says_that_light_goes_straight_through() -> None:
    surface = read(shader_material("Frosted", "ShaderNodeBsdfGlass", Color=TINT, Roughness=0.4))
    np.testing.assert_allclose(passed(surface), TINT[:3], rtol=1e-6)
    assert one_says(messages(surface), "Frosted", "rough", "straight")


def test_without_the_option_glass_is_opaque() -> None:
    surface = read_material(shader_material("Pane", "ShaderNodeBsdfGlass", Color=TINT))
    assert surface.opacity == 1.0
    assert not surface.glass


def images_of(materials: dict[str, bpy.types.Material], **settings: Any) -> tuple[SurfaceImages | None, Any]:
    """Export a square of each material, by the name of its object; a matte floor is among them."""
    for name, material in {"Floor": shader_material("Floor", "ShaderNodeBsdfDiffuse"), **materials}.items():
        add_mesh(name, SQUARE, material=material, location=(0, 0, len(bpy.data.objects)))
    export = export_scene(bpy.context, BakeSettings(resolution=16, **settings))
    return export.bake_scene.scene.images, export


def test_glass_is_exported_by_color_and_gets_no_lightmap() -> None:
    images, export = images_of({"Pane": shader_material("Pane", "ShaderNodeBsdfGlass", Color=TINT)})
    assert images is not None
    triangle = np.flatnonzero(images.clear)
    found = images.passes_at(triangle, np.full((2, 2), 1 / 3))
    np.testing.assert_allclose(found, np.tile(TINT[:3], (2, 1)), rtol=1e-6)
    baked = {item.name: item.bake for item in export.bake_scene.objects}
    assert baked == {"Floor": True, "Pane": False}


def test_white_glass_is_met_by_no_ray() -> None:
    white = shader_material("Pane", "ShaderNodeBsdfGlass", Color=(1, 1, 1, 1))
    images, export = images_of({"Pane": white})
    scene = export.bake_scene.scene
    assert images is not None
    np.testing.assert_array_equal(scene.in_bounces, ~images.clear)
    np.testing.assert_array_equal(scene.in_shadows, ~images.clear)


@pytest.mark.parametrize("option", [True, False])
@pytest.mark.parametrize("own", ["AS_SET", "CLEAR", "OPAQUE"])
@pytest.mark.usefixtures("registered")
def test_a_material_overrides_the_option(option: bool, own: str) -> None:
    pane = shader_material("Pane", "ShaderNodeBsdfGlass", Color=TINT)
    pane.radiosity_glass = own
    images, _ = images_of({"Pane": pane}, light_through_glass=option)
    clear = images is not None and bool(images.clear.any())
    assert clear == {"AS_SET": option, "CLEAR": True, "OPAQUE": False}[own]


def test_glass_colored_by_an_image_is_evaluated_by_channel() -> None:
    pane = shader_material("Pane", "ShaderNodeBsdfGlass")
    image = bpy.data.images.new("Halves", 2, 1, float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.array([1, 0.5, 0.25, 1, 0.2, 0.4, 0.8, 1], dtype=np.float32))
    node = pane.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = image, "Closest"
    shader = next(node for node in pane.node_tree.nodes if node.type == "BSDF_GLASS")
    pane.node_tree.links.new(node.outputs["Color"], shader.inputs["Color"])
    obj = add_mesh("Pane", SQUARE, material=pane)
    obj.data.uv_layers.new(name="UVMap").data.foreach_set("uv", (0, 0, 1, 0, 1, 1, 0, 1))
    images, _ = images_of({})
    assert images is not None
    (first, second) = np.flatnonzero(images.clear)
    # The square's corners are (0, 0), (1, 0), (1, 1) and (0, 0), (1, 1), (0, 1).
    right = images.passes_at(np.array([first]), np.array([[0.8, 0.1]]))
    left = images.passes_at(np.array([second]), np.array([[0.1, 0.8]]))
    np.testing.assert_allclose(right[0], (0.2, 0.4, 0.8), atol=1e-3)
    np.testing.assert_allclose(left[0], (1, 0.5, 0.25), atol=1e-3)


@pytest.mark.usefixtures("registered")
def test_nothing_but_glass_is_refused_by_name() -> None:
    add_mesh("Pane", SQUARE, material=shader_material("Pane", "ShaderNodeBsdfGlass"))
    with pytest.raises(SceneError, match=r"Pane.*glass") as raised:
        export_scene(bpy.context, BakeSettings(resolution=16))
    found = inspect(bpy.context, BakeSettings(resolution=16), None)
    assert [each.message for each in found.findings if each.level == "ERROR"] == [str(raised.value)]


@pytest.mark.usefixtures("registered")
def test_the_pane_of_a_window_keeps_its_material_and_the_frame_is_dressed() -> None:
    corners = (*SQUARE, (2, 0, 0), (2, 1, 0))
    window = add_mesh("Window", corners, ((0, 1, 2, 3), (1, 4, 5, 2)))
    frame, pane = (
        shader_material("Frame", "ShaderNodeBsdfDiffuse"),
        shader_material("Pane", "ShaderNodeBsdfGlass"),
    )
    window.data.materials.append(frame)
    window.data.materials.append(pane)
    window.data.polygons[1].material_index = 1
    bake_by_hand()
    assert window.data.materials[0] != frame
    assert window.data.materials[1] == pane
    assert bpy.ops.radiosity.restore("EXEC_DEFAULT", True) == {"FINISHED"}
    assert list(window.data.materials) == [frame, pane]


@pytest.mark.usefixtures("registered")
def test_check_names_the_glass() -> None:
    images_of({"Pane": shader_material("Tinted", "ShaderNodeBsdfGlass", Color=TINT)})
    found = inspect(bpy.context, BakeSettings(resolution=16), None)
    assert found.objects == 1
    assert one_says([finding.message for finding in found.findings], "Tinted", "straight")
