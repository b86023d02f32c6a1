"""An edit on a lightmap copy of a material is an edit of the material: it shows, survives, and is baked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.apply.rebake import originals_shown
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks.bake_record import ORIGINAL, is_made
from radiosity_addon.blender.material_copies.material_digest import digest_of_material
from radiosity_addon.blender.material_edits.material_edits import carry_material_edits
from radiosity_addon.blender.material_edits.stripping import stripped_copy
from radiosity_addon.blender.materials.gloss import Gloss
from radiosity_addon.blender.materials.materials import read_material
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.edited_copies import (
    GREEN,
    Material,
    add_texture,
    base_color,
    color_node,
    constant_of,
    copy_of,
    grouped_material,
    lightmap_node,
    shader,
)
from tests.blender.hand_bake import BASE, TEXEL, add_plane, bake_by_hand, principled_material, seen_from_above
from tests.blender.scenes import add_node, with_nodes

pytestmark = pytest.mark.usefixtures("record")


@pytest.mark.parametrize("kind", ["BSDF_PRINCIPLED", "BSDF_DIFFUSE"])
def test_another_base_color_shows_at_once(kind: str, tmp_path: Path) -> None:
    material = bpy.data.materials.new("Paint")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    if kind == "BSDF_DIFFUSE":
        tree = with_nodes(material)
        node = add_node(tree, "ShaderNodeBsdfDiffuse", Color=(*BASE, 1.0))
        tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    add_plane(material=material)
    bake_by_hand()
    node = shader(copy_of(material), kind)
    socket = node.inputs["Color" if kind == "BSDF_DIFFUSE" else "Base Color"]
    constant_of(socket).default_value = GREEN
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.multiply(GREEN[:3], TEXEL), rtol=1e-4)


def test_emission_shows_at_once_also_where_there_was_none(paint: Material, tmp_path: Path) -> None:
    node = shader(copy_of(paint))
    constant_of(node.inputs["Emission Color"]).default_value = GREEN
    constant_of(node.inputs["Emission Strength"]).default_value = 2.0
    expected = np.multiply(BASE, TEXEL) + 2.0 * np.array(GREEN[:3])
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], expected, rtol=1e-4)
    restore(bpy.context)
    assert shader(paint).inputs["Emission Strength"].default_value == 2.0


def test_a_constant_inside_a_node_group_shows_at_once(tmp_path: Path) -> None:
    material, group = grouped_material()
    add_plane(material=material)
    bake_by_hand()
    inner = shader(copy_of(material), "GROUP").node_tree
    assert inner != group
    diffuse = next(node for node in inner.nodes if node.type == "BSDF_DIFFUSE")
    constant_of(diffuse.inputs["Color"]).default_value = GREEN
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.multiply(GREEN[:3], TEXEL), rtol=1e-4)
    restore(bpy.context)
    assert shader(material, "GROUP").node_tree == group
    np.testing.assert_allclose(group.nodes["Diffuse BSDF"].inputs["Color"].default_value, GREEN, rtol=1e-6)


def color_by_node(copy: Material) -> None:
    color_node(copy).default_value = GREEN


def color_by_script(copy: Material) -> None:
    shader(copy).inputs["Base Color"].default_value = GREEN


def color_in_the_lightmap_node(copy: Material) -> None:
    """What one does in the panel: disconnect Base Color of the first node, and pick a color."""
    node = lightmap_node(copy)
    copy.node_tree.links.remove(node.inputs["Base Color"].links[0])
    node.inputs["Base Color"].default_value = GREEN


def texture_behind_the_color(copy: Material) -> None:
    """What one does in the panel, too: a node in the place of the color."""
    source = add_node(copy.node_tree, "ShaderNodeBrightContrast", Color=GREEN)
    copy.node_tree.links.new(source.outputs[0], lightmap_node(copy).inputs["Base Color"])


@pytest.mark.parametrize(
    "edit", [color_by_node, color_by_script, color_in_the_lightmap_node, texture_behind_the_color]
)
def test_a_base_color_survives_restore_and_is_baked(
    paint: Material, edit: Callable[[Material], None]
) -> None:
    edit(copy_of(paint))
    with originals_shown(bpy.context) as warnings:
        assert warnings == ()
        scene = export_scene(bpy.context, BakeSettings()).bake_scene.scene
        paint = bpy.data.materials["Paint"]
        expected = read_material(paint, gloss=Gloss.of(bpy.context.scene)).reflectance
    if edit is not texture_behind_the_color:
        assert base_color(paint) == pytest.approx(GREEN)
        assert expected[1] > 0.65
        np.testing.assert_allclose(scene.reflectance[0], expected)
    restore(bpy.context)
    plane = bpy.data.objects["Plane"]
    assert [slot.material.name for slot in plane.material_slots] == ["Paint"]
    paint = plane.material_slots[0].material
    if edit is texture_behind_the_color:
        (link,) = shader(paint).inputs["Base Color"].links
        assert link.from_node.type == "BRIGHTCONTRAST"
        assert tuple(link.from_node.inputs["Color"].default_value) == pytest.approx(GREEN)
    assert not any(node.type in ("GROUP", "RGB") for node in paint.node_tree.nodes)


def test_nodes_of_the_users_own_survive(paint: Material, tmp_path: Path) -> None:
    """The original is replaced everywhere, with its name and what marks it, and the picture is baked."""
    paint.use_fake_user = True
    paint.asset_mark()
    paint.asset_data.author, paint.asset_data.description = "Someone", "Paint"
    paint.asset_data.tags.new("wall")
    elsewhere = bpy.data.meshes.new("Elsewhere")
    elsewhere.materials.append(paint)
    copy = copy_of(paint)
    add_texture(copy)
    copy["other"] = "mine"
    assert carry_material_edits() == ()
    paint = bpy.data.materials["Paint"]
    assert not is_made(paint)
    assert elsewhere.materials[0] == paint == copy[ORIGINAL]
    assert paint.use_fake_user
    assert (paint.asset_data.author, paint.asset_data.description) == ("Someone", "Paint")
    assert [tag.name for tag in paint.asset_data.tags] == ["wall"]
    assert paint["other"] == "mine"
    restore(bpy.context)
    plane = bpy.data.objects["Plane"]
    assert plane.material_slots[0].material == paint
    (link,) = shader(paint).inputs["Base Color"].links
    assert link.from_node.image.name == "Bricks"
    bake_by_hand()
    np.testing.assert_allclose(
        seen_from_above(tmp_path)[0, 0], np.multiply((0.25, 0.5, 0.125), TEXEL), rtol=1e-4
    )


def test_every_kind_of_value_is_written_in_place() -> None:
    material = principled_material()
    tree = material.node_tree
    ramp, curve = tree.nodes.new("ShaderNodeValToRGB"), tree.nodes.new("ShaderNodeRGBCurve")
    texture = add_texture(material)
    tree.links.new(curve.outputs[0], shader(material).inputs["Specular Tint"])
    material["note"] = 3
    add_plane(material=material)
    bake_by_hand()
    copy = copy_of(material)
    nodes = copy.node_tree.nodes
    nodes[ramp.name].color_ramp.elements.new(0.25).color = GREEN
    nodes[ramp.name].color_ramp.interpolation = "CONSTANT"
    mapping = nodes[curve.name].mapping
    mapping.curves[0].points.new(0.25, 0.75)
    mapping.update()
    other = bpy.data.images.new("Tiles", 2, 2)
    nodes[texture.name].image = other
    nodes[texture.name].texture_mapping.scale[0] = 3.0
    nodes[texture.name].interpolation = "Closest"
    nodes[shader(copy).name].distribution = "GGX"
    shader(copy).inputs["Roughness"].default_value = 0.125
    copy["note"], copy["other"] = 4, [1.0, 2.0]
    copy.use_backface_culling = True
    edited = stripped_copy(copy)[0]
    assert carry_material_edits() == ()
    assert bpy.data.materials["Paint"] == material
    assert digest_of_material(material) == digest_of_material(edited)
    assert len(ramp.color_ramp.elements) == 3
    assert (texture.image, texture.interpolation) == (other, "Closest")
    assert (material["note"], list(material["other"])) == (4, [1.0, 2.0])


def test_emission_sampling_that_the_user_chose_survives(paint: Material) -> None:
    copy = copy_of(paint)
    assert (copy.cycles.emission_sampling, paint.cycles.emission_sampling) == ("NONE", "AUTO")
    copy.cycles.emission_sampling = "FRONT"
    carry_material_edits()
    assert paint.cycles.emission_sampling == "FRONT"


def test_drivers_and_keyframes_move_to_the_socket_they_stand_for(paint: Material) -> None:
    copy = copy_of(paint)
    socket = color_node(copy)
    socket.driver_add("default_value", 1).driver.expression = "0.25"
    socket.keyframe_insert("default_value", index=0, frame=1)
    restore(bpy.context)
    tree = bpy.data.objects["Plane"].material_slots[0].material.node_tree
    (driver,) = tree.animation_data.drivers
    assert driver.data_path == 'nodes["Principled BSDF"].inputs[0].default_value'
    assert driver.driver.expression == "0.25"
    assert tree.animation_data.action is not None
