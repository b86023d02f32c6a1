"""Edits on lightmap copies that an earlier version made, which noted nothing on them."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks.bake_record import ORIGINAL, is_made
from radiosity_addon.blender.material_copies.material_digest import digest_of_material, links_of
from radiosity_addon.blender.material_edits.material_edits import carry_material_edits
from radiosity_addon.blender.materials.materials import read_material
from tests.blender.edited_copies import GREEN, base_color, copy_of, shader
from tests.blender.hand_bake import BASE, bake_by_hand

pytestmark = pytest.mark.usefixtures("record")


EARLIER = Path(__file__).parent / "files" / "lightmaps_without_records.blend"
"""Baked by a version that noted nothing on copies."""


@pytest.fixture
def earlier() -> None:
    if bpy.app.version < (5, 0):
        pytest.skip("the file is one of Blender 5.0")
    bpy.ops.wm.open_mainfile(filepath=str(EARLIER))


def users_materials() -> set[str]:
    return {material.name for material in bpy.data.materials if not is_made(material)}


@pytest.mark.usefixtures("earlier")
def test_unedited_copies_of_an_earlier_version_are_known() -> None:
    before = users_materials()
    assert carry_material_edits() == ()
    assert users_materials() == before
    assert restore(bpy.context) > 0
    assert {m.name for m in bpy.data.materials} == before
    bake_by_hand()
    assert carry_material_edits() == ()


@pytest.mark.usefixtures("earlier")
@pytest.mark.parametrize("name", ["Plain", "Glow", "Glass", "Textured", "Pinned", "Grouped"])
def test_edits_on_copies_of_an_earlier_version_are_kept(name: str) -> None:
    original = bpy.data.materials[name]
    copy = copy_of(original)
    links = links_of(original.node_tree)
    shader(copy).inputs["Sheen Weight"].default_value = 0.125
    (warning,) = carry_material_edits()
    own = copy[ORIGINAL]
    assert warning.name == own.name == f"{name}.001"
    assert not is_made(own)
    assert links_of(own.node_tree) == links
    assert {n.name for n in own.node_tree.nodes} == {n.name for n in original.node_tree.nodes}
    assert not any(n.type == "GROUP" and is_made(n.node_tree) for n in own.node_tree.nodes)
    assert shader(own).inputs["Sheen Weight"].default_value == 0.125
    shader(own).inputs["Sheen Weight"].default_value = 0.0
    assert digest_of_material(own) == digest_of_material(original)
    assert carry_material_edits() == ()


@pytest.mark.usefixtures("earlier")
@pytest.mark.parametrize("name", ["Plain", "Glow"])
@pytest.mark.parametrize("where", ["lightmap", "shader"])
def test_a_base_color_edited_on_a_copy_of_an_earlier_version_is_kept(name: str, where: str) -> None:
    copy = copy_of(bpy.data.materials[name])
    node = next(n for n in copy.node_tree.nodes if n.type == "GROUP") if where == "lightmap" else shader(copy)
    node.inputs["Base Color"].default_value = GREEN
    assert len(carry_material_edits()) == 1
    assert base_color(copy[ORIGINAL]) == pytest.approx(GREEN)
    assert base_color(bpy.data.materials[name])[:3] == pytest.approx(BASE)


@pytest.mark.usefixtures("earlier")
def test_an_original_edited_next_to_a_copy_of_an_earlier_version_stays_alone() -> None:
    shader(bpy.data.materials["Plain"]).inputs["Base Color"].default_value = GREEN
    shader(bpy.data.materials["Glow"]).inputs["Emission Strength"].default_value = 5.0
    before = users_materials()
    assert carry_material_edits() == ()
    assert users_materials() == before


@pytest.mark.usefixtures("earlier")
def test_a_copy_of_no_material_of_an_earlier_version_becomes_one_when_edited() -> None:
    copy = next(m for m in bpy.data.materials if m.name.startswith("No Material"))
    node = next(n for n in copy.node_tree.nodes if n.type == "GROUP")
    node.inputs["Base Color"].default_value = GREEN
    assert carry_material_edits() == ()
    np.testing.assert_allclose(read_material(copy[ORIGINAL]).reflectance, GREEN[:3], rtol=1e-6)
    assert carry_material_edits() == ()
