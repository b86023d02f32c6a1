"""Materials come to reflectance, emission and opacity; what is not understood is told."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.datablocks.image_values import image_mean, linear_from_srgb
from radiosity_addon.blender.materials.materials import Surface, read_material
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.scenes import add_mesh, add_node, measure_irradiance, shader_material, with_nodes
from tests.wording import one_says, says

RED = (0.6, 0.2, 0.1, 1.0)
BLUE = (0.1, 0.2, 0.8, 1.0)


def messages_of(surface: Surface) -> str:
    return "\n".join(warning.message for warning in surface.warnings)


def _output(tree: bpy.types.NodeTree) -> bpy.types.Node:
    return tree.nodes.new("ShaderNodeOutputMaterial")


def _fallbacks(surface: Surface) -> str:
    return "\n".join(warning.message for warning in surface.fallbacks)


def assert_surface(surface: Surface, reflectance: Any, emission: Any = (0, 0, 0)) -> None:
    np.testing.assert_allclose(surface.reflectance, reflectance, rtol=1e-6)
    np.testing.assert_allclose(surface.emission, emission, rtol=1e-6)


def test_no_material_is_cycles_gray() -> None:
    surface = read_material(None)
    assert_surface(surface, (0.8, 0.8, 0.8))
    assert surface.warnings == ()


def test_diffuse() -> None:
    surface = read_material(shader_material("M", "ShaderNodeBsdfDiffuse", Color=RED))
    assert_surface(surface, RED[:3])
    assert surface.warnings == ()


def test_emission_is_radiance_times_pi_and_black() -> None:
    assert_surface(
        read_material(shader_material("M", "ShaderNodeEmission", Color=BLUE, Strength=3.0)),
        (0, 0, 0),
        3 * math.pi * np.array(BLUE[:3]),
    )


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_mixed_shaders(share: float) -> None:
    material = shader_material("M", "ShaderNodeMixShader", Fac=share)
    tree = material.node_tree
    mix = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    tree.links.new(add_node(tree, "ShaderNodeBsdfDiffuse", Color=RED).outputs[0], mix.inputs[1])
    tree.links.new(add_node(tree, "ShaderNodeEmission", Color=BLUE, Strength=2.0).outputs[0], mix.inputs[2])
    surface = read_material(material)
    assert_surface(surface, (1 - share) * np.array(RED[:3]), share * 2 * math.pi * np.array(BLUE[:3]))
    assert surface.warnings == ()


def test_added_shaders() -> None:
    material = shader_material("M", "ShaderNodeAddShader")
    tree = material.node_tree
    add = next(node for node in tree.nodes if node.type == "ADD_SHADER")
    tree.links.new(add_node(tree, "ShaderNodeBsdfDiffuse", Color=RED).outputs[0], add.inputs[0])
    tree.links.new(add_node(tree, "ShaderNodeEmission", Color=BLUE).outputs[0], add.inputs[1])
    assert_surface(read_material(material), RED[:3], math.pi * np.array(BLUE[:3]))


def test_reroutes_and_muted_nodes_are_seen_through() -> None:
    material = bpy.data.materials.new("M")
    tree = with_nodes(material)
    diffuse = add_node(tree, "ShaderNodeBsdfDiffuse", Color=RED)
    other = add_node(tree, "ShaderNodeEmission", Strength=9.0)
    muted = tree.nodes.new("ShaderNodeMixShader")
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(diffuse.outputs[0], muted.inputs[1])
    tree.links.new(other.outputs[0], muted.inputs[2])
    tree.links.new(muted.outputs[0], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], _output(tree).inputs["Surface"])
    muted.mute = True
    assert_surface(read_material(material), RED[:3])


def test_muted_links_do_not_count() -> None:
    material = shader_material("M", "ShaderNodeBsdfDiffuse", Color=RED)
    tree = material.node_tree
    link = tree.links.new(
        add_node(tree, "ShaderNodeRGB").outputs[0], tree.nodes["Diffuse BSDF"].inputs["Color"]
    )
    link.is_muted = True
    assert_surface(read_material(material), RED[:3])


def _color_group() -> bpy.types.NodeTree:
    """A group: Diffuse of its input `Tint` times blue."""
    group = bpy.data.node_groups.new("Tinted", "ShaderNodeTree")
    group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    mix = group.nodes.new("ShaderNodeMix")
    mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
    sockets = {socket.identifier: socket for socket in mix.inputs}
    sockets["Factor_Float"].default_value = 1.0
    sockets["B_Color"].default_value = BLUE
    group.links.new(entry.outputs["Tint"], sockets["A_Color"])
    diffuse = group.nodes.new("ShaderNodeBsdfDiffuse")
    result = next(socket for socket in mix.outputs if socket.identifier == "Result_Color")
    group.links.new(result, diffuse.inputs["Color"])
    group.links.new(diffuse.outputs[0], leave.inputs["Shader"])
    return group


@pytest.mark.parametrize("linked", [False, True])
def test_node_groups_are_entered_with_their_inputs(linked: bool) -> None:
    material = bpy.data.materials.new("M")
    tree = with_nodes(material)
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = _color_group()
    if linked:
        color = tree.nodes.new("ShaderNodeRGB")
        color.outputs[0].default_value = RED
        tree.links.new(color.outputs[0], group.inputs["Tint"])
    else:
        group.inputs["Tint"].default_value = RED
    tree.links.new(group.outputs[0], _output(tree).inputs["Surface"])
    surface = read_material(material)
    assert_surface(surface, np.array(RED[:3]) * BLUE[:3])
    assert surface.warnings == ()


def test_cycles_own_output_wins_and_eevees_does_not_count() -> None:
    material = bpy.data.materials.new("M")
    tree = with_nodes(material)
    for target, color in (("EEVEE", BLUE), ("CYCLES", RED)):
        output = _output(tree)
        output.target = target
        tree.links.new(add_node(tree, "ShaderNodeBsdfDiffuse", Color=color).outputs[0], output.inputs[0])
    assert_surface(read_material(material), RED[:3])


def test_a_material_without_surface_is_black_and_warns() -> None:
    material = bpy.data.materials.new("Hollow")
    _output(with_nodes(material))
    surface = read_material(material)
    assert_surface(surface, (0, 0, 0))
    assert says(messages_of(surface), "Hollow", "no surface shader")


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="materials always have nodes here")
def test_a_material_without_nodes_has_its_viewport_color() -> None:
    material = bpy.data.materials.new("M")
    material.diffuse_color = RED
    assert_surface(read_material(material), RED[:3])


def _image(name: str, color_space: str, *, is_float: bool) -> tuple[bpy.types.Image, np.ndarray]:
    image = bpy.data.images.new(name, 4, 2, float_buffer=is_float)
    image.colorspace_settings.name = color_space
    pixels = np.ones((8, 4), dtype=np.float32)
    pixels[:, :3] = np.linspace(0, 1, 24, dtype=np.float32).reshape(8, 3)
    pixels[:, 3] = np.linspace(0, 1, 8, dtype=np.float32)
    pixels = np.round(pixels * 255) / 255
    image.pixels.foreach_set(pixels.ravel())
    return image, pixels[:, :3].astype(np.float64)


@pytest.mark.parametrize(
    ("color_space", "is_float"), [("sRGB", False), ("Non-Color", False), ("Linear Rec.709", True)]
)
def test_an_image_that_cannot_be_evaluated_counts_with_its_linear_mean(
    color_space: str, is_float: bool
) -> None:
    image, pixels = _image("Bricks", color_space, is_float=is_float)
    mean = (linear_from_srgb(pixels) if color_space == "sRGB" else pixels).mean(axis=0)
    np.testing.assert_allclose(image_mean(image)[:3], mean, rtol=1e-5)
    material = shader_material("Wall", "ShaderNodeBsdfPrincipled", Specular_IOR_Level=0)
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.links.new(texture.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    surface = read_material(material)
    assert_surface(surface, mean)
    assert surface.varies
    assert surface.warnings == ()
    (warning,) = surface.fallbacks
    assert warning.name == "Wall"
    assert says(warning.message, "Wall", "Base Color", "Bricks", "mean")


def test_a_checker_that_cannot_be_evaluated_is_half_and_half() -> None:
    material = shader_material("Floor", "ShaderNodeBsdfDiffuse", Color=(1, 1, 1, 1))
    tree = material.node_tree
    checker = tree.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = RED, BLUE
    tree.links.new(checker.outputs["Color"], tree.nodes["Diffuse BSDF"].inputs["Color"])
    surface = read_material(material)
    assert_surface(surface, (0.35, 0.2, 0.45))
    assert surface.varies
    assert says(_fallbacks(surface), "Color", "Checker Texture", "mean")


def test_srgb_decodes_as_the_standard_says() -> None:
    np.testing.assert_allclose(
        linear_from_srgb(np.array([0.0, 0.04045, 0.5, 1.0])), [0, 0.0031308, 0.2140411, 1], rtol=1e-5
    )


@pytest.mark.parametrize("kind", ["ShaderNodeTexNoise", "ShaderNodeVertexColor", "ShaderNodeTexImage"])
def test_what_varies_in_unknown_ways_falls_back_on_the_sockets_value(kind: str) -> None:
    """Procedural textures and vertex colors, if not evaluated; images that are missing, always."""
    material = shader_material("Odd", "ShaderNodeBsdfDiffuse", Color=RED)
    tree = material.node_tree
    node = tree.nodes.new(kind)
    tree.links.new(node.outputs["Color"], tree.nodes["Diffuse BSDF"].inputs["Color"])
    surface = read_material(material)
    assert_surface(surface, RED[:3])
    missing = kind == "ShaderNodeTexImage"
    (warning,) = surface.warnings if missing else surface.fallbacks
    assert surface.varies == (not missing)
    assert warning.name == "Odd"
    assert "(0.6, 0.2, 0.1)" in warning.message


def test_reflectance_of_one_is_clamped_and_named() -> None:
    surface = read_material(shader_material("White", "ShaderNodeBsdfDiffuse", Color=(1, 1, 0.5, 1)))
    assert_surface(surface, (0.99, 0.99, 0.5))
    assert says(messages_of(surface), "White", "(1, 1, 0.5)", "clamped", "(0.99, 0.99, 0.5)")


def test_negative_emission_is_none() -> None:
    surface = read_material(shader_material("Thief", "ShaderNodeEmission", Strength=-1.0))
    assert_surface(surface, (0, 0, 0))
    assert says(messages_of(surface), "Thief", "emission (-1, -1, -1)")


def test_a_mix_with_transparent_is_its_solid_shader_where_it_is_there() -> None:
    material = shader_material("Leaf", "ShaderNodeMixShader", Fac=0.3)
    tree = material.node_tree
    mix = next(node for node in tree.nodes if node.type == "MIX_SHADER")
    tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
    tree.links.new(add_node(tree, "ShaderNodeBsdfDiffuse", Color=RED).outputs[0], mix.inputs[2])
    surface = read_material(material)
    assert_surface(surface, RED[:3])
    assert surface.opacity == pytest.approx(0.3)
    assert surface.warnings == ()


def test_transparent_passes_its_color_and_reflects_nothing() -> None:
    surface = read_material(shader_material("Gone", "ShaderNodeBsdfTransparent", Color=(0.9, 0.6, 0.3, 1)))
    assert_surface(surface, (0, 0, 0))
    assert surface.opacity == pytest.approx(0.4)
    assert surface.warnings == ()


def test_what_glows_but_hides_nothing_keeps_its_light() -> None:
    """Emission added to Transparent: only what is there emits, so a little of it is."""
    material = shader_material("Flame", "ShaderNodeAddShader")
    tree = material.node_tree
    add = next(node for node in tree.nodes if node.type == "ADD_SHADER")
    clear = add_node(tree, "ShaderNodeBsdfTransparent", Color=(1, 1, 1, 1))
    tree.links.new(clear.outputs[0], add.inputs[0])
    tree.links.new(add_node(tree, "ShaderNodeEmission", Color=BLUE).outputs[0], add.inputs[1])
    surface = read_material(material)
    assert 0 < surface.opacity < 0.02
    np.testing.assert_allclose(surface.emission * surface.opacity, math.pi * np.array(BLUE[:3]), rtol=1e-6)


@pytest.mark.parametrize(
    ("shader", "reflectance"),
    [
        ("ShaderNodeBsdfAnisotropic", RED[:3]),
        ("ShaderNodeBsdfTranslucent", RED[:3]),
        ("ShaderNodeBsdfGlass", (0, 0, 0)),
    ],
)
def test_other_shaders_warn_with_the_value_used(shader: str, reflectance: Any) -> None:
    surface = read_material(shader_material("Odd", shader, Color=RED))
    assert_surface(surface, reflectance)
    (warning,) = surface.warnings
    assert warning.name == "Odd"
    assert "is used" in warning.message


def test_each_triangle_has_its_slots_material_object_slots_before_mesh_slots() -> None:
    obj = add_mesh(
        "Two",
        ((0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 0, 0)),
        ((0, 1, 2), (1, 3, 2)),
        material=shader_material("Red", "ShaderNodeBsdfDiffuse", Color=RED),
    )
    obj.data.materials.append(shader_material("Blue", "ShaderNodeBsdfDiffuse", Color=BLUE))
    obj.data.polygons.foreach_set("material_index", [1, 0])
    obj.material_slots[0].link = "OBJECT"
    obj.material_slots[0].material = shader_material("Own", "ShaderNodeEmission", Strength=1 / math.pi)
    scene = export_scene(bpy.context, BakeSettings()).bake_scene.scene
    np.testing.assert_allclose(scene.reflectance, [BLUE[:3], (0, 0, 0)], rtol=1e-6)
    np.testing.assert_allclose(scene.emission, [(0, 0, 0), (1, 1, 1)], rtol=1e-6)


def test_an_empty_slot_is_gray_and_warns_and_a_missing_slot_is_the_last() -> None:
    obj = add_mesh("Bare", ((0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 0, 0)), ((0, 1, 2), (1, 3, 2)))
    obj.data.materials.append(shader_material("Red", "ShaderNodeBsdfDiffuse", Color=RED))
    obj.data.materials.append(None)
    obj.data.polygons.foreach_set("material_index", [0, 7])
    baked = export_scene(bpy.context, BakeSettings(sky=True)).bake_scene
    np.testing.assert_allclose(baked.scene.reflectance, [RED[:3], (0.8, 0.8, 0.8)], rtol=1e-6)
    (warning,) = baked.warnings
    assert (warning.name, "empty" in warning.message) == ("Bare", True)


@pytest.mark.parametrize("kind", ["ShaderNodeRGB", "ShaderNodeValue"])
def test_a_color_in_a_shader_s_place_glows_as_in_cycles(kind: str) -> None:
    """Blender makes an emission of strength 1 of it."""
    material = bpy.data.materials.new("Glow")
    tree = with_nodes(material)
    node = tree.nodes.new(kind)
    node.outputs[0].default_value = 2.0 if kind == "ShaderNodeValue" else (1.0, 0.5, 0.25, 1.0)
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    read = read_material(material)
    radiance = np.full(3, 2.0) if kind == "ShaderNodeValue" else np.array([1.0, 0.5, 0.25])
    np.testing.assert_allclose(read.emission, np.pi * radiance, rtol=1e-6)
    assert not read.warnings
    assert not read.reflectance.any()
    # Two squares 2 m wide and 1 m apart.
    floor = add_mesh("Floor")
    add_mesh("Glow", material=material, location=(0, 0, 1))
    measured = measure_irradiance(floor, samples=64)
    np.testing.assert_allclose(measured, np.pi * 0.4153 * radiance, rtol=0.02)


def _through_shader_to_rgb(target: str) -> bpy.types.Material:
    """A red diffuse shader as a color: of a green emission, or where a shader belongs."""
    material = bpy.data.materials.new("Toon")
    tree = with_nodes(material)
    color = tree.nodes.new("ShaderNodeShaderToRGB")
    tree.links.new(add_node(tree, "ShaderNodeBsdfDiffuse", Color=RED).outputs[0], color.inputs[0])
    glow = add_node(tree, "ShaderNodeEmission", Color=(0.0, 1.0, 0.0, 1.0), Strength=2.0)
    surface = _output(tree).inputs["Surface"]
    if target == "Color":
        tree.links.new(glow.outputs[0], surface)
    tree.links.new(color.outputs["Color"], surface if target == "Surface" else glow.inputs["Color"])
    return material


@pytest.mark.parametrize("target", ["Color", "Surface"])
def test_shader_to_rgb_is_unknown_to_cycles_and_reported(target: str) -> None:
    material = _through_shader_to_rgb(target)
    floor = add_mesh("Floor")
    add_mesh("Toon", material=material, location=(0, 0, 1))
    export = export_scene(bpy.context, BakeSettings(sky=True)).bake_scene
    assert one_says((warning.message for warning in export.warnings), "Toon", "Shader to RGB", "EEVEE")
    ours = export.scene.emission.max(axis=0)
    np.testing.assert_allclose(ours, [0.0, 2 * np.pi if target == "Color" else 0.0, 0.0], rtol=1e-6)
    np.testing.assert_allclose(measure_irradiance(floor, samples=64), 0.4153 * ours, rtol=0.02)


def test_transparent_shadows_that_are_off_are_reported() -> None:
    material = shader_material("Pane", "ShaderNodeBsdfTransparent", Color=(0.5, 0.5, 0.5, 1.0))
    add_mesh("Pane", material=material)

    def said() -> str:
        export = export_scene(bpy.context, BakeSettings(sky=True))
        return "\n".join(warning.message for warning in export.bake_scene.warnings)

    assert "Transparent Shadows" not in said()
    material.use_transparent_shadow = False
    assert says(said(), "Pane", "Transparent Shadows")


def test_emission_for_diffuse_rays_is_reported() -> None:
    material = shader_material("Glow", "ShaderNodeEmission")
    tree = material.node_tree
    glow = next(node for node in tree.nodes if node.type == "EMISSION")
    path = tree.nodes.new("ShaderNodeLightPath")
    for name, told in (("Is Camera Ray", False), ("Is Diffuse Ray", True), ("Is Reflection Ray", True)):
        tree.links.new(path.outputs[name], glow.inputs["Strength"])
        add_mesh("Glow", material=material)
        export = export_scene(bpy.context, BakeSettings(sky=True)).bake_scene
        assert export.scene.emission.any() == told
        assert any("Is Diffuse Ray" in warning.message for warning in export.warnings) == told
