"""A lightmap copy comes apart into its original, whatever the original is, and its record holds."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks.bake_record import ORIGINAL
from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps
from radiosity_addon.blender.material_copies.material_digest import digest_of_material, links_of
from radiosity_addon.blender.material_edits.material_edits import carry_material_edits
from radiosity_addon.blender.material_edits.stripping import stripped_copy
from tests.blender.edited_copies import EVERY, GREEN, Material, base_color, color_node, copy_of, shader
from tests.blender.file_dump import differences_since, dump_file
from tests.blender.hand_bake import BASE, add_plane, bake_by_hand

pytestmark = pytest.mark.usefixtures("record")


@pytest.mark.parametrize("kind", EVERY)
@pytest.mark.parametrize("pinned", [False, True])
def test_an_unedited_copy_comes_apart_into_the_original(kind: str, pinned: bool) -> None:
    material = EVERY[kind]()
    plane = add_plane(material=material)
    if not pinned:
        plane.data.uv_layers.new(name="UVMap")
    bpy.context.view_layer.update()
    content, links, before = digest_of_material(material), links_of(material.node_tree), dump_file()
    bake_by_hand()
    copy = copy_of(material)
    stripped, complete = stripped_copy(copy)
    assert complete
    assert links_of(stripped.node_tree) == links
    assert digest_of_material(stripped) == content == digest_of_material(material)
    bpy.data.materials.remove(stripped)
    assert carry_material_edits() == ()
    restore(bpy.context)
    # Before Blender 5.0, a copy counts what it uses twice until the file is loaded again.
    counts = "/users:" if bpy.app.version < (5, 0) else None
    assert [each for each in differences_since(before) if counts is None or counts not in each] == []


@pytest.mark.parametrize("kind", EVERY)
def test_a_value_edited_on_the_copy_comes_to_the_original(kind: str) -> None:
    """Whatever the tree around it: one value of a node that is the user's, and one of the material."""
    material = EVERY[kind]()
    add_plane(material=material)
    bake_by_hand()
    copy = copy_of(material)
    copy.diffuse_color = GREEN
    node = next((n for n in copy.node_tree.nodes if n.name in material.node_tree.nodes), None)
    if node is not None:
        node.label = "edited"
    assert carry_material_edits() == ()
    assert bpy.data.materials.get(material.name) == material
    np.testing.assert_allclose(material.diffuse_color, GREEN, rtol=1e-6)
    if node is not None:
        assert material.node_tree.nodes[node.name].label == "edited"
    content = digest_of_material(material)
    assert carry_material_edits() == ()
    assert digest_of_material(material) == content


def test_records_hold_after_saving_and_loading(tmp_path: Path) -> None:
    for number, kind in enumerate(EVERY):
        add_plane(f"Plane {number}", EVERY[kind]())
    add_plane("Bare")
    bake_by_hand(folder=tmp_path)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    before = {m.name: digest_of_material(m) for m in bpy.data.materials}
    assert carry_material_edits() == ()
    assert {m.name: digest_of_material(m) for m in bpy.data.materials} == before
    shader(bpy.data.materials["Empty (Lightmap)"], "GROUP")
    copy = next(m for m in bpy.data.materials if m.name.startswith("Grouped (Lightmap)"))
    copy.use_backface_culling = True
    assert carry_material_edits() == ()
    assert copy[ORIGINAL].use_backface_culling


def test_what_lightmaps_change_themselves_is_no_edit(paint: Material) -> None:
    content = digest_of_material(paint)
    show_lightmaps("lightmap")
    bpy.data.images[0].name = "other"
    assert carry_material_edits() == ()
    assert digest_of_material(paint) == content


def test_undo_brings_edit_and_original_back(paint: Material) -> None:
    bpy.ops.ed.undo_push(message="baked")
    color_node(copy_of(paint)).default_value = GREEN
    bpy.ops.ed.undo_push(message="edited")
    carry_material_edits()
    bpy.ops.ed.undo_push(message="carried")
    bpy.ops.ed.undo()
    paint = bpy.data.materials["Paint"]
    assert base_color(paint)[:3] == pytest.approx(BASE)
    assert tuple(color_node(copy_of(paint)).default_value) == pytest.approx(GREEN)
    assert carry_material_edits() == ()
    assert base_color(paint) == pytest.approx(GREEN)
