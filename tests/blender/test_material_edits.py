"""An edit on a lightmap copy of a material is an edit of the material: it shows, survives, and is baked."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.bake_record import is_made
from radiosity_addon.blender.copy_marks import ORIGINAL
from radiosity_addon.blender.export import export_scene
from radiosity_addon.blender.lightmap_materials import LightmapMaterials, set_lightmap_only
from radiosity_addon.blender.material_digest import digest, links_of
from radiosity_addon.blender.material_edits import carry_edits
from radiosity_addon.blender.materials import read_material
from radiosity_addon.blender.rebake import originals_shown
from radiosity_addon.blender.restore import restore
from radiosity_addon.blender.stripping import stripped_copy
from radiosity_addon.settings import BakeSettings
from tests.blender.file_dump import differences_since, dump_file
from tests.blender.hand_bake import (
    BASE,
    TEXEL,
    add_plane,
    add_shader,
    bake_by_hand,
    principled_material,
    seen_from_above,
)
from tests.blender.material_zoo import ZOO
from tests.blender.scenes import add_node, with_nodes

pytestmark = pytest.mark.usefixtures("record")

GREEN = (0.1, 0.7, 0.3, 1.0)
Material = bpy.types.Material


@pytest.fixture
def paint() -> Material:
    """The material of a plane that shows a lightmap."""
    material = principled_material()
    add_plane(material=material)
    bake_by_hand()
    return material


def copy_of(material: Material | None) -> Material:
    (copy,) = (m for m in bpy.data.materials if is_made(m) and m.get(ORIGINAL) == material)
    return copy


def shader(material: Material, kind: str = "BSDF_PRINCIPLED") -> bpy.types.Node:
    return next(node for node in material.node_tree.nodes if node.type == kind)


def color_node(copy: Material) -> bpy.types.NodeSocket:
    """The node that the panel and the node editor show as Base Color."""
    return shader(copy).inputs["Base Color"].links[0].from_node.outputs[0]


def base_color(material: Material) -> tuple[float, ...]:
    return tuple(shader(material).inputs["Base Color"].default_value)


def add_texture(material: Material) -> bpy.types.Node:
    """Feed the base color with a picture of one color."""
    image = bpy.data.images.new("Bricks", 2, 2, float_buffer=True, is_data=True)
    image.pixels[:] = [0.25, 0.5, 0.125, 1.0] * 4
    image.pack()
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs["Color"], shader(material).inputs["Base Color"])
    return node


# What is shown -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["BSDF_PRINCIPLED", "BSDF_DIFFUSE"])
def test_another_base_color_shows_at_once(kind: str, tmp_path: Path) -> None:
    material = bpy.data.materials.new("Paint")
    if kind == "BSDF_DIFFUSE":
        tree = with_nodes(material)
        node = add_node(tree, "ShaderNodeBsdfDiffuse", Color=(*BASE, 1.0))
        tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    add_plane(material=material)
    bake_by_hand()
    node = shader(copy_of(material), kind)
    socket = node.inputs["Color" if kind == "BSDF_DIFFUSE" else "Base Color"]
    socket.links[0].from_node.outputs[0].default_value = GREEN
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.multiply(GREEN[:3], TEXEL), rtol=1e-4)


def test_emission_shows_at_once_also_where_there_was_none(paint: Material, tmp_path: Path) -> None:
    node = shader(copy_of(paint))
    node.inputs["Emission Color"].links[0].from_node.outputs[0].default_value = GREEN
    node.inputs["Emission Strength"].links[0].from_node.outputs[0].default_value = 2.0
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
    diffuse.inputs["Color"].links[0].from_node.outputs[0].default_value = GREEN
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.multiply(GREEN[:3], TEXEL), rtol=1e-4)
    restore(bpy.context)
    assert shader(material, "GROUP").node_tree == group
    np.testing.assert_allclose(group.nodes["Diffuse BSDF"].inputs["Color"].default_value, GREEN, rtol=1e-6)


def grouped_material() -> tuple[Material, bpy.types.NodeTree]:
    group = bpy.data.node_groups.new("Wrapped", "ShaderNodeTree")
    group.interface.new_socket("Rough", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    diffuse = add_node(group, "ShaderNodeBsdfDiffuse", Color=(*BASE, 1.0))
    group.links.new(entry.outputs["Rough"], diffuse.inputs["Roughness"])
    group.links.new(diffuse.outputs[0], leave.inputs["Shader"])
    material = bpy.data.materials.new("Grouped")
    tree = with_nodes(material)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(node.outputs["Shader"], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material, group


# What is stripped ----------------------------------------------------------------------------------------


def odd_materials() -> dict[str, Callable[[], Material]]:
    """Materials on which the lightmap's nodes are wired in unusual ways."""

    def two_outputs() -> Material:
        material = principled_material()
        tree = material.node_tree
        other = tree.nodes.new("ShaderNodeOutputMaterial")
        other.target = "EEVEE"
        tree.links.new(add_shader(material, "Emission", Strength=3.0).outputs[0], other.inputs["Surface"])
        return material

    def muted_link() -> Material:
        material = principled_material()
        shader(material).outputs[0].links[0].is_muted = True
        return material

    def coordinates() -> Material:
        material = principled_material()
        texture, source = add_texture(material), material.node_tree.nodes.new("ShaderNodeTexCoord")
        material.node_tree.links.new(source.outputs["UV"], texture.inputs["Vector"]).is_muted = True
        add_texture(material)
        return material

    def keyed() -> Material:
        material = principled_material(Emission_Strength=2.0)
        node = shader(material)
        node.inputs["Emission Strength"].keyframe_insert("default_value", frame=1)
        node.inputs["Base Color"].driver_add("default_value", 0).driver.expression = "0.5"
        return material

    def no_output() -> Material:
        material = bpy.data.materials.new("Empty")
        with_nodes(material)
        return material

    def see_through() -> Material:
        return principled_material(Alpha=0.25, Emission_Strength=3.0)

    def shared_color() -> Material:
        material = principled_material()
        tree = material.node_tree
        color = tree.nodes.new("ShaderNodeRGB")
        for name in ("Base Color", "Emission Color", "Specular Tint"):
            tree.links.new(color.outputs[0], shader(material).inputs[name])
        return material

    return {
        "two outputs": two_outputs,
        "muted link": muted_link,
        "coordinates": coordinates,
        "keyed": keyed,
        "no output": no_output,
        "see-through": see_through,
        "shared color": shared_color,
        "group": lambda: grouped_material()[0],
    }


EVERY = {**ZOO, **odd_materials()}


@pytest.mark.parametrize("kind", EVERY)
@pytest.mark.parametrize("pinned", [False, True])
def test_an_unedited_copy_comes_apart_into_the_original(kind: str, pinned: bool) -> None:
    material = EVERY[kind]()
    plane = add_plane(material=material)
    if not pinned:
        plane.data.uv_layers.new(name="UVMap")
    content, links, before = digest(material), links_of(material.node_tree), dump_file()
    bake_by_hand()
    copy = copy_of(material)
    stripped, complete = stripped_copy(copy)
    assert complete
    assert links_of(stripped.node_tree) == links
    assert digest(stripped) == content == digest(material)
    bpy.data.materials.remove(stripped)
    assert carry_edits() == ()
    restore(bpy.context)
    assert differences_since(before) == []


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
    assert carry_edits() == ()
    assert bpy.data.materials.get(material.name) == material
    np.testing.assert_allclose(material.diffuse_color, GREEN, rtol=1e-6)
    if node is not None:
        assert material.node_tree.nodes[node.name].label == "edited"
    content = digest(material)
    assert carry_edits() == ()
    assert digest(material) == content


# What is carried -----------------------------------------------------------------------------------------


def color_by_node(copy: Material) -> None:
    color_node(copy).default_value = GREEN


def color_by_script(copy: Material) -> None:
    shader(copy).inputs["Base Color"].default_value = GREEN


def color_in_the_lightmap_node(copy: Material) -> None:
    """What one does in the panel: disconnect Base Color of the first node, and pick a color."""
    node = shader(copy, "GROUP")
    copy.node_tree.links.remove(node.inputs["Base Color"].links[0])
    node.inputs["Base Color"].default_value = GREEN


def texture_behind_the_color(copy: Material) -> None:
    """What one does in the panel, too: a node in the place of the color."""
    source = add_node(copy.node_tree, "ShaderNodeBrightContrast", Color=GREEN)
    copy.node_tree.links.new(source.outputs[0], shader(copy, "GROUP").inputs["Base Color"])


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
        expected = read_material(paint).reflectance
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
    assert carry_edits() == ()
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
    assert carry_edits() == ()
    assert bpy.data.materials["Paint"] == material
    assert digest(material) == digest(edited)
    assert len(ramp.color_ramp.elements) == 3
    assert (texture.image, texture.interpolation) == (other, "Closest")
    assert (material["note"], list(material["other"])) == (4, [1.0, 2.0])


def test_emission_sampling_and_light_groups_of_the_users_choice_survive(paint: Material) -> None:
    copy = copy_of(paint)
    assert (copy.cycles.emission_sampling, paint.cycles.emission_sampling) == ("NONE", "AUTO")
    copy.cycles.emission_sampling = "FRONT"
    carry_edits()
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


# Who wins ------------------------------------------------------------------------------------------------


def test_an_edit_of_the_original_alone_stays(paint: Material) -> None:
    shader(paint).inputs["Base Color"].default_value = GREEN
    assert carry_edits() == ()
    assert base_color(paint) == pytest.approx(GREEN)
    assert [m.name for m in bpy.data.materials if not is_made(m)] == ["Paint"]


def test_where_both_were_edited_nobody_loses(paint: Material) -> None:
    shader(paint).inputs["Roughness"].default_value = 0.125
    copy = copy_of(paint)
    color_node(copy).default_value = GREEN
    (warning,) = carry_edits()
    own = copy[ORIGINAL]
    assert own.name == "Paint.001"
    assert "'Paint'" in warning.message
    assert "'Paint.001'" in warning.message
    assert base_color(own) == pytest.approx(GREEN)
    assert base_color(paint)[:3] == pytest.approx(BASE)
    assert shader(paint).inputs["Roughness"].default_value == 0.125
    assert not is_made(own)
    assert carry_edits() == ()
    assert len([m for m in bpy.data.materials if not is_made(m)]) == 2


def two_copies() -> tuple[Material, Material, Material]:
    """One material on two pages."""
    material = principled_material()
    for name in ("One", "Two"):
        add_plane(name, material)
    bake_by_hand(((0.1, 0.1, 0.1), (0.2, 0.2, 0.2)))
    copies = [bpy.data.objects[name].material_slots[0].material for name in ("One", "Two")]
    assert copies[0] != copies[1]
    return (material, *copies)


def test_an_edit_of_one_copy_reaches_the_other() -> None:
    material, one, two = two_copies()
    color_node(one).default_value = GREEN
    assert carry_edits() == ()
    assert base_color(material) == pytest.approx(GREEN)
    assert tuple(color_node(two).default_value) == pytest.approx(GREEN)
    shader(two).inputs["Roughness"].default_value = 0.125
    assert carry_edits() == ()
    assert shader(material).inputs["Roughness"].default_value == 0.125
    assert base_color(material) == pytest.approx(GREEN)


def test_two_copies_edited_alike_agree() -> None:
    material, *copies = two_copies()
    for copy in copies:
        color_node(copy).default_value = GREEN
    assert carry_edits() == ()
    assert all(copy[ORIGINAL] == material for copy in copies)


def test_two_copies_edited_differently_become_two_materials() -> None:
    _, one, two = two_copies()
    color_node(one).default_value = GREEN
    color_node(two).default_value = (0.5, 0.5, 0.5, 1.0)
    assert len(carry_edits()) == 1
    colors = {base_color(copy[ORIGINAL])[:3] for copy in (one, two)}
    assert {tuple(np.round(color, 3)) for color in colors} == {(0.1, 0.7, 0.3), (0.5, 0.5, 0.5)}
    assert carry_edits() == ()


def test_a_copy_that_the_user_duplicated_becomes_a_material_of_its_own(paint: Material) -> None:
    """As "Make Single User" does on a slot."""
    copy = copy_of(paint)
    single = copy.copy()
    bpy.data.objects["Plane"].material_slots[0].material = single
    color_node(single).default_value = GREEN
    assert carry_edits() == ()
    own = single[ORIGINAL]
    assert own.name == "Paint.001"
    assert base_color(own) == pytest.approx(GREEN)
    assert base_color(paint)[:3] == pytest.approx(BASE)
    assert copy[ORIGINAL] == paint
    assert carry_edits() == ()
    restore(bpy.context)
    assert "Paint.001" in bpy.data.materials


def test_an_edit_of_no_material_becomes_a_material(tmp_path: Path) -> None:
    add_plane()
    bake_by_hand()
    copy = copy_of(None)
    assert carry_edits() == ()
    assert copy.get(ORIGINAL) is None
    shader(copy, "BSDF_DIFFUSE").inputs["Color"].links[0].from_node.outputs[0].default_value = GREEN
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.multiply(GREEN[:3], TEXEL), rtol=1e-4)
    assert carry_edits() == ()
    own = copy[ORIGINAL]
    assert not is_made(own)
    np.testing.assert_allclose(read_material(own).reflectance, GREEN[:3], rtol=1e-6)
    assert carry_edits() == ()


def test_a_renamed_copy_renames_the_original(paint: Material) -> None:
    copy = copy_of(paint)
    copy.name = "Brick"
    assert carry_edits() == ()
    assert paint.name == "Brick"
    copy.name = "Tile (Lightmap)"
    assert carry_edits() == ()
    assert paint.name == "Tile"
    restore(bpy.context)
    assert [m.name for m in bpy.data.materials] == ["Tile"]


def test_an_original_from_a_library_gets_a_local_one_beside_it(tmp_path: Path) -> None:
    principled_material().use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.materials = ["Paint"]
    linked = bpy.data.materials["Paint"]
    add_plane(material=linked)
    bake_by_hand()
    copy = copy_of(linked)
    assert carry_edits() == ()
    color_node(copy).default_value = GREEN
    assert len(carry_edits()) == 1
    own = copy[ORIGINAL]
    assert own.library is None
    assert base_color(own) == pytest.approx(GREEN)
    assert carry_edits() == ()


def test_a_node_group_edited_in_two_materials_becomes_two() -> None:
    first, group = grouped_material()
    second = first.copy()
    for name, material in (("One", first), ("Two", second)):
        add_plane(name, material)
    bake_by_hand()
    for material, value in ((first, 0.25), (second, 0.5)):
        inner = shader(copy_of(material), "GROUP").node_tree
        assert inner != group
        inner.nodes["Diffuse BSDF"].inputs["Color"].links[0].from_node.outputs[0].default_value = (value,) * 4
    (warning,) = carry_edits()
    assert warning.name.startswith("Wrapped.")
    assert "node group 'Wrapped'" in warning.message
    trees = [shader(material, "GROUP").node_tree for material in (first, second)]
    values = [tree.nodes["Diffuse BSDF"].inputs["Color"].default_value[0] for tree in trees]
    assert sorted(values) == [0.25, 0.5]
    assert not any(map(is_made, trees))
    assert carry_edits() == ()


def test_new_nodes_in_a_node_group_come_to_the_group() -> None:
    material, _ = grouped_material()
    add_plane(material=material)
    bake_by_hand()
    inner = shader(copy_of(material), "GROUP").node_tree
    contrast = inner.nodes.new("ShaderNodeBrightContrast")
    inner.links.new(contrast.outputs[0], inner.nodes["Diffuse BSDF"].inputs["Color"])
    assert carry_edits() == ()
    restore(bpy.context)
    group = bpy.data.node_groups["Wrapped"]
    assert shader(bpy.data.materials["Grouped"], "GROUP").node_tree == group
    assert [item.name for item in group.interface.items_tree] == ["Shader", "Rough"]
    (link,) = group.nodes["Diffuse BSDF"].inputs["Color"].links
    assert link.from_node.type == "BRIGHTCONTRAST"


# Records -------------------------------------------------------------------------------------------------


def test_records_hold_after_saving_and_loading(tmp_path: Path) -> None:
    for number, kind in enumerate(EVERY):
        add_plane(f"Plane {number}", EVERY[kind]())
    add_plane("Bare")
    bake_by_hand(folder=tmp_path)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    before = {m.name: digest(m) for m in bpy.data.materials}
    assert carry_edits() == ()
    assert {m.name: digest(m) for m in bpy.data.materials} == before
    shader(bpy.data.materials["Empty (Lightmap)"], "GROUP")
    copy = next(m for m in bpy.data.materials if m.name.startswith("Grouped (Lightmap)"))
    copy.use_backface_culling = True
    assert carry_edits() == ()
    assert copy[ORIGINAL].use_backface_culling


def test_what_lightmaps_change_themselves_is_no_edit(paint: Material) -> None:
    content = digest(paint)
    set_lightmap_only(True)
    bpy.data.images[0].name = "other"
    assert carry_edits() == ()
    assert digest(paint) == content


def test_undo_brings_edit_and_original_back(paint: Material) -> None:
    bpy.ops.ed.undo_push(message="baked")
    color_node(copy_of(paint)).default_value = GREEN
    bpy.ops.ed.undo_push(message="edited")
    carry_edits()
    bpy.ops.ed.undo_push(message="carried")
    bpy.ops.ed.undo()
    paint = bpy.data.materials["Paint"]
    assert base_color(paint)[:3] == pytest.approx(BASE)
    assert tuple(color_node(copy_of(paint)).default_value) == pytest.approx(GREEN)
    assert carry_edits() == ()
    assert base_color(paint) == pytest.approx(GREEN)


def test_three_hundred_unedited_copies_are_known_in_a_tenth_of_a_second() -> None:
    image = bpy.data.images.new("Page", 4, 4, float_buffer=True)
    maker = LightmapMaterials("irradiance_over_pi")
    for _ in range(300):
        maker.copy_of(principled_material(), image, False)
    carry_edits()
    started = time.process_time()
    assert carry_edits() == ()
    assert time.process_time() - started < 0.1


# Copies of earlier versions ------------------------------------------------------------------------------

EARLIER = Path(__file__).parent / "files" / "lightmaps_without_records.blend"
"""Baked at d331b48, which noted nothing on copies."""


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
    assert carry_edits() == ()
    assert users_materials() == before
    assert restore(bpy.context) > 0
    assert {m.name for m in bpy.data.materials} == before
    bake_by_hand()
    assert carry_edits() == ()


@pytest.mark.usefixtures("earlier")
@pytest.mark.parametrize("name", ["Plain", "Glow", "Glass", "Textured", "Pinned", "Grouped"])
def test_edits_on_copies_of_an_earlier_version_are_kept(name: str) -> None:
    original = bpy.data.materials[name]
    copy = copy_of(original)
    links = links_of(original.node_tree)
    shader(copy).inputs["Sheen Weight"].default_value = 0.125
    (warning,) = carry_edits()
    own = copy[ORIGINAL]
    assert warning.name == own.name == f"{name}.001"
    assert not is_made(own)
    assert links_of(own.node_tree) == links
    assert {n.name for n in own.node_tree.nodes} == {n.name for n in original.node_tree.nodes}
    assert not any(n.type == "GROUP" and is_made(n.node_tree) for n in own.node_tree.nodes)
    assert shader(own).inputs["Sheen Weight"].default_value == 0.125
    shader(own).inputs["Sheen Weight"].default_value = 0.0
    assert digest(own) == digest(original)
    assert carry_edits() == ()


@pytest.mark.usefixtures("earlier")
@pytest.mark.parametrize("name", ["Plain", "Glow"])
@pytest.mark.parametrize("where", ["lightmap", "shader"])
def test_a_base_color_edited_on_a_copy_of_an_earlier_version_is_kept(name: str, where: str) -> None:
    copy = copy_of(bpy.data.materials[name])
    node = next(n for n in copy.node_tree.nodes if n.type == "GROUP") if where == "lightmap" else shader(copy)
    node.inputs["Base Color"].default_value = GREEN
    assert len(carry_edits()) == 1
    assert base_color(copy[ORIGINAL]) == pytest.approx(GREEN)
    assert base_color(bpy.data.materials[name])[:3] == pytest.approx(BASE)


@pytest.mark.usefixtures("earlier")
def test_an_original_edited_beside_a_copy_of_an_earlier_version_stays_alone() -> None:
    shader(bpy.data.materials["Plain"]).inputs["Base Color"].default_value = GREEN
    shader(bpy.data.materials["Glow"]).inputs["Emission Strength"].default_value = 5.0
    before = users_materials()
    assert carry_edits() == ()
    assert users_materials() == before


@pytest.mark.usefixtures("earlier")
def test_a_copy_of_no_material_of_an_earlier_version_becomes_one_when_edited() -> None:
    copy = next(m for m in bpy.data.materials if m.name.startswith("No Material"))
    node = next(n for n in copy.node_tree.nodes if n.type == "GROUP")
    node.inputs["Base Color"].default_value = GREEN
    assert carry_edits() == ()
    np.testing.assert_allclose(read_material(copy[ORIGINAL]).reflectance, GREEN[:3], rtol=1e-6)
    assert carry_edits() == ()
