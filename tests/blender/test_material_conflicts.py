"""Who wins where a material and its lightmap copies were edited: nobody loses."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks.bake_record import ORIGINAL, is_made
from radiosity_addon.blender.material_edits.material_edits import carry_material_edits
from radiosity_addon.blender.materials.materials import read_material
from tests.blender.edited_copies import (
    GREEN,
    Material,
    base_color,
    color_node,
    constant_of,
    copy_of,
    grouped_material,
    shader,
    two_copies,
)
from tests.blender.hand_bake import BASE, TEXEL, add_plane, bake_by_hand, principled_material, seen_from_above

pytestmark = pytest.mark.usefixtures("record")


def test_an_edit_of_the_original_alone_stays(paint: Material) -> None:
    shader(paint).inputs["Base Color"].default_value = GREEN
    assert carry_material_edits() == ()
    assert base_color(paint) == pytest.approx(GREEN)
    assert [m.name for m in bpy.data.materials if not is_made(m)] == ["Paint"]


def test_where_both_were_edited_nobody_loses(paint: Material) -> None:
    shader(paint).inputs["Roughness"].default_value = 0.125
    copy = copy_of(paint)
    color_node(copy).default_value = GREEN
    (warning,) = carry_material_edits()
    own = copy[ORIGINAL]
    assert own.name == "Paint.001"
    assert "'Paint'" in warning.message
    assert "'Paint.001'" in warning.message
    assert base_color(own) == pytest.approx(GREEN)
    assert base_color(paint)[:3] == pytest.approx(BASE)
    assert shader(paint).inputs["Roughness"].default_value == 0.125
    assert not is_made(own)
    assert carry_material_edits() == ()
    assert len([m for m in bpy.data.materials if not is_made(m)]) == 2


def test_an_edit_of_one_copy_reaches_the_other() -> None:
    material, one, two = two_copies()
    color_node(one).default_value = GREEN
    assert carry_material_edits() == ()
    assert base_color(material) == pytest.approx(GREEN)
    assert tuple(color_node(two).default_value) == pytest.approx(GREEN)
    shader(two).inputs["Roughness"].default_value = 0.125
    assert carry_material_edits() == ()
    assert shader(material).inputs["Roughness"].default_value == 0.125
    assert base_color(material) == pytest.approx(GREEN)


def test_two_copies_edited_alike_agree() -> None:
    material, *copies = two_copies()
    for copy in copies:
        color_node(copy).default_value = GREEN
    assert carry_material_edits() == ()
    assert all(copy[ORIGINAL] == material for copy in copies)


def test_two_copies_edited_differently_become_two_materials() -> None:
    _, one, two = two_copies()
    color_node(one).default_value = GREEN
    color_node(two).default_value = (0.5, 0.5, 0.5, 1.0)
    assert len(carry_material_edits()) == 1
    colors = {base_color(copy[ORIGINAL])[:3] for copy in (one, two)}
    assert {tuple(np.round(color, 3)) for color in colors} == {(0.1, 0.7, 0.3), (0.5, 0.5, 0.5)}
    assert carry_material_edits() == ()


def test_a_copy_that_the_user_duplicated_becomes_a_material_of_its_own(paint: Material) -> None:
    """As "Make Single User" does on a slot."""
    copy = copy_of(paint)
    single = copy.copy()
    bpy.data.objects["Plane"].material_slots[0].material = single
    color_node(single).default_value = GREEN
    assert carry_material_edits() == ()
    own = single[ORIGINAL]
    assert own.name == "Paint.001"
    assert base_color(own) == pytest.approx(GREEN)
    assert base_color(paint)[:3] == pytest.approx(BASE)
    assert copy[ORIGINAL] == paint
    assert carry_material_edits() == ()
    restore(bpy.context)
    assert "Paint.001" in bpy.data.materials


def test_an_edit_of_no_material_becomes_a_material(tmp_path: Path) -> None:
    add_plane()
    bake_by_hand()
    copy = copy_of(None)
    assert carry_material_edits() == ()
    assert copy.get(ORIGINAL) is None
    constant_of(shader(copy, "BSDF_DIFFUSE").inputs["Color"]).default_value = GREEN
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.multiply(GREEN[:3], TEXEL), rtol=1e-4)
    assert carry_material_edits() == ()
    own = copy[ORIGINAL]
    assert not is_made(own)
    np.testing.assert_allclose(read_material(own).reflectance, GREEN[:3], rtol=1e-6)
    assert carry_material_edits() == ()


def test_a_renamed_copy_renames_the_original(paint: Material) -> None:
    copy = copy_of(paint)
    copy.name = "Brick"
    assert carry_material_edits() == ()
    assert paint.name == "Brick"
    copy.name = "Tile (Lightmap)"
    assert carry_material_edits() == ()
    assert paint.name == "Tile"
    restore(bpy.context)
    assert [m.name for m in bpy.data.materials] == ["Tile"]


def test_an_original_from_a_library_gets_a_local_one_next_to_it(tmp_path: Path) -> None:
    principled_material().use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.materials = ["Paint"]
    linked = bpy.data.materials["Paint"]
    add_plane(material=linked)
    bake_by_hand()
    copy = copy_of(linked)
    assert carry_material_edits() == ()
    color_node(copy).default_value = GREEN
    assert len(carry_material_edits()) == 1
    own = copy[ORIGINAL]
    assert own.library is None
    assert base_color(own) == pytest.approx(GREEN)
    assert carry_material_edits() == ()


def test_a_node_group_edited_in_two_materials_becomes_two() -> None:
    first, group = grouped_material()
    second = first.copy()
    for name, material in (("One", first), ("Two", second)):
        add_plane(name, material)
    bake_by_hand()
    for material, value in ((first, 0.25), (second, 0.5)):
        inner = shader(copy_of(material), "GROUP").node_tree
        assert inner != group
        constant_of(inner.nodes["Diffuse BSDF"].inputs["Color"]).default_value = (value,) * 4
    (warning,) = carry_material_edits()
    assert warning.name.startswith("Wrapped.")
    assert "node group 'Wrapped'" in warning.message
    trees = [shader(material, "GROUP").node_tree for material in (first, second)]
    values = [tree.nodes["Diffuse BSDF"].inputs["Color"].default_value[0] for tree in trees]
    assert sorted(values) == [0.25, 0.5]
    assert not any(map(is_made, trees))
    assert carry_material_edits() == ()


def test_new_nodes_in_a_node_group_come_to_the_group() -> None:
    material, _ = grouped_material()
    add_plane(material=material)
    bake_by_hand()
    inner = shader(copy_of(material), "GROUP").node_tree
    contrast = inner.nodes.new("ShaderNodeBrightContrast")
    inner.links.new(contrast.outputs[0], inner.nodes["Diffuse BSDF"].inputs["Color"])
    assert carry_material_edits() == ()
    restore(bpy.context)
    group = bpy.data.node_groups["Wrapped"]
    assert shader(bpy.data.materials["Grouped"], "GROUP").node_tree == group
    assert [item.name for item in group.interface.items_tree] == ["Shader", "Rough"]
    (link,) = group.nodes["Diffuse BSDF"].inputs["Color"].links
    assert link.from_node.type == "BRIGHTCONTRAST"
