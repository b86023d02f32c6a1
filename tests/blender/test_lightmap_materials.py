"""Lightmap materials show base color × lightmap plus emission, for every quantity."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.bake.result.result import BakedObject, BakeResult
from radiosity_addon.blender.apply.apply import apply_lightmaps
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.images.images import write_pages
from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.hand_bake import (
    BASE,
    TEXEL,
    add_plane,
    add_shader,
    bake_by_hand,
    link_surface,
    principled_material,
    seen_from_above,
)

pytestmark = pytest.mark.usefixtures("record")


@pytest.mark.parametrize("file_format", ["exr", "png16"])
@pytest.mark.parametrize(
    ("quantity", "expected"),
    [
        ("irradiance_over_pi", np.multiply(BASE, TEXEL) + 0.5),
        ("irradiance", np.multiply(BASE, TEXEL) / math.pi + 0.5),
        ("radiosity", np.divide(TEXEL, math.pi)),
    ],
)
def test_radiance_is_right_for_each_quantity(
    tmp_path: Path, quantity: str, expected: np.ndarray, file_format: str
) -> None:
    add_plane(material=principled_material(Emission_Color=(0.25, 0.25, 0.25, 1.0), Emission_Strength=2.0))
    bake_by_hand(quantity=quantity, format=file_format, folder=tmp_path)
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], expected, rtol=1e-4)


@pytest.mark.parametrize(
    ("quantity", "factor"),
    [("irradiance_over_pi", 1), ("irradiance", 1 / math.pi), ("radiosity", 1 / math.pi)],
)
def test_lightmap_only_shows_what_a_white_surface_would(tmp_path: Path, quantity: str, factor: float) -> None:
    add_plane(material=principled_material(Emission_Color=(1.0, 1.0, 1.0, 1.0), Emission_Strength=2.0))
    bake_by_hand(quantity=quantity)
    assert show_lightmaps("lightmap") == 1
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.multiply(TEXEL, factor), rtol=1e-4)


@pytest.mark.parametrize(("texel", "shown"), [((0.2, 0.3, 0.1), (2, 0, 0)), ((-0.5, 0.1, -0.5), (0, 0, 3))])
def test_a_residual_is_red_where_positive_and_blue_where_negative(
    tmp_path: Path, texel: tuple[float, ...], shown: tuple[float, ...]
) -> None:
    """Ten times the channels' mean over π, whatever the material; nothing shines negatively."""
    add_plane(material=principled_material(Emission_Color=(1.0, 1.0, 1.0, 1.0), Emission_Strength=2.0))
    bake_by_hand((texel,), quantity="residual", folder=tmp_path)
    for look in ("shine", "matte", "lightmap"):
        show_lightmaps(look)
        np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.divide(shown, math.pi), atol=1e-5)


def test_the_lightmap_lies_the_right_way_up(tmp_path: Path) -> None:
    """Row 0 of a page is v = 0; the square's UVs are its x and y."""
    plane = add_plane()
    settings = BakeSettings()
    export = export_scene(bpy.context, settings)
    target = export.bake_scene.objects[0]
    corners = np.array([v.co[:2] for v in plane.data.vertices])
    vertex = np.array([loop.vertex_index for loop in plane.data.loops])
    uv = ((corners[vertex[target.loops]] + 1) / 2).astype(np.float32)
    pixels = np.zeros((2, 2, 3), np.float32)
    pixels[0, 0], pixels[0, 1], pixels[1, 0], pixels[1, 1] = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)
    page = LightmapPage(pixels, np.ones((2, 2), bool))
    result = BakeResult((page,), (BakedObject(target, uv, 0),), {}, ())
    apply_lightmaps(bpy.context, export, result, write_pages(result, settings, tmp_path), settings)
    seen = seen_from_above(tmp_path, 4)
    # The outer quarter of each half reads its texel alone; inwards it is filtered.
    for row in (0, 1):
        for column in (0, 1):
            np.testing.assert_allclose(seen[3 * row, 3 * column], 0.8 * pixels[row, column], atol=1e-4)


def test_every_way_to_say_base_color_is_read(tmp_path: Path) -> None:
    """Diffuse in a node group, mixed half and half with another, plus an emission."""
    material = principled_material()
    nodes, links = material.node_tree.nodes, material.node_tree.links
    group = bpy.data.node_groups.new("Wrapped", "ShaderNodeTree")
    group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    given, result = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    diffuse = group.nodes.new("ShaderNodeBsdfDiffuse")
    group.links.new(given.outputs["Tint"], diffuse.inputs["Color"])
    group.links.new(diffuse.outputs["BSDF"], result.inputs["Shader"])
    wrapped = nodes.new("ShaderNodeGroup")
    wrapped.node_tree = group
    wrapped.inputs["Tint"].default_value = (0.1, 0.2, 0.3, 1.0)
    mix = add_shader(material, "MixShader", Fac=0.25)
    links.new(nodes["Principled BSDF"].outputs[0], mix.inputs[1])
    links.new(wrapped.outputs["Shader"], mix.inputs[2])
    emission = add_shader(material, "Emission", Color=(1.0, 0.0, 0.5, 1.0), Strength=2.0)
    add = nodes.new("ShaderNodeAddShader")
    links.new(mix.outputs[0], add.inputs[0])
    links.new(emission.outputs[0], add.inputs[1])
    link_surface(material, add.outputs[0])
    add_plane(material=material)
    bake_by_hand()
    base = 0.75 * np.array(BASE) + 0.25 * np.array((0.1, 0.2, 0.3))
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], base * TEXEL + (2.0, 0.0, 1.0), rtol=1e-4)


def test_textures_keep_feeding_base_color_and_emission(tmp_path: Path) -> None:
    material = principled_material(Emission_Strength=0.5)
    rgb = material.node_tree.nodes.new("ShaderNodeRGB")
    rgb.outputs[0].default_value = (0.3, 0.6, 0.9, 1.0)
    reroute = material.node_tree.nodes.new("NodeReroute")
    material.node_tree.links.new(rgb.outputs[0], reroute.inputs[0])
    principled = material.node_tree.nodes["Principled BSDF"]
    for name in ("Base Color", "Emission Color"):
        material.node_tree.links.new(reroute.outputs[0], principled.inputs[name])
    add_plane(material=material)
    bake_by_hand()
    color = np.array((0.3, 0.6, 0.9))
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], color * TEXEL + 0.5 * color, rtol=1e-4)


def test_transparency_is_kept(tmp_path: Path) -> None:
    """Half of what is behind shows through: a second plane that emits."""
    add_plane(material=principled_material(Alpha=0.5))
    glow = principled_material(name="Glow", Emission_Color=(1, 1, 1, 1), Emission_Strength=1.0)
    behind = add_plane("Behind", glow)
    behind.location.z = -1.0
    bake_by_hand()
    expected = 0.5 * np.multiply(BASE, TEXEL) + 0.5 * (np.multiply(BASE, TEXEL) + 1.0)
    # Stochastic in alpha: one of two surfaces a sample, so only their mean is sharp.
    seen = seen_from_above(tmp_path, 16).mean(axis=(0, 1))
    np.testing.assert_allclose(seen, expected, rtol=0.03)


def test_a_mesh_without_material_is_gray(tmp_path: Path) -> None:
    plane = add_plane()
    bake_by_hand()
    assert [material.name for material in plane.data.materials] == ["No Material (Lightmap)"]
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], 0.8 * np.array(TEXEL), rtol=1e-4)


def test_an_object_without_uvs_keeps_its_textures_in_place(tmp_path: Path) -> None:
    """An image without a vector read (0, 0, 0) before, and does after; the group's image too."""
    build = bpy.data.images.new("Corners", 2, 2)
    build.pixels[:] = [0.25, 0.5, 1, 1, 1, 0, 0, 1, 0, 1, 0, 1, 1, 1, 1, 1]
    build.colorspace_settings.name = "Non-Color"
    build.pixels[:] = [0.25, 0.5, 1, 1, 1, 0, 0, 1, 0, 1, 0, 1, 1, 1, 1, 1]
    build.pack()
    material = principled_material()
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation, texture.extension = build, "Closest", "EXTEND"
    emission, group_user = add_shader(material, "Emission"), tree.nodes.new("ShaderNodeGroup")
    tree.links.new(texture.outputs["Color"], emission.inputs["Color"])
    link_surface(material, emission.outputs[0])
    group = bpy.data.node_groups.new("Coordinates", "ShaderNodeTree")
    group.interface.new_socket("UV", in_out="OUTPUT", socket_type="NodeSocketVector")
    coordinates, result = group.nodes.new("ShaderNodeTexCoord"), group.nodes.new("NodeGroupOutput")
    group.links.new(coordinates.outputs["UV"], result.inputs[0])
    group_user.node_tree = group
    plane = add_plane(material=material)
    before = seen_from_above(tmp_path, 4)

    for through_group in (False, True):
        if through_group:
            tree.links.new(group_user.outputs[0], texture.inputs["Vector"])
        bake_by_hand(colors=((0.0, 0.0, 0.0),))
        np.testing.assert_allclose(seen_from_above(tmp_path, 4), before, atol=1e-5)
        restore(bpy.context)
    assert np.ptp(before, axis=(0, 1)).max() == 0.0
    assert len(plane.data.uv_layers) == 0
