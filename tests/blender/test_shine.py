"""Baked materials keep their shine; what is diffuse comes from the lightmap, and from nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.files.files import empty_scene
from radiosity_addon.blender.material_copies.copy_marks import behind_ours
from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps
from radiosity_addon.blender.material_edits.material_edits import carry_material_edits
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options import BakeSettings
from tests.blender.edited_copies import (
    EVERY,
    GREEN,
    Material,
    color_node,
    constant_of,
    copy_of,
    shader,
)
from tests.blender.hand_bake import (
    BASE,
    SMALL,
    TEXEL,
    add_plane,
    bake_by_hand,
    principled_material,
    seen_from_above,
)
from tests.blender.scenes import add_lamp, add_mesh, add_node, set_world, shader_material

pytestmark = pytest.mark.usefixtures("record")

WHITE = (1.0, 1.0, 1.0)


def painted(**inputs: object) -> Callable[[], Material]:
    return lambda: principled_material(**inputs)


LAYERED = {
    "rough": painted(Roughness=0.9),
    "smooth": painted(Roughness=0.1),
    "dense": painted(IOR=2.0, Roughness=0.2),
    "coat": painted(Coat_Weight=1.0),
    "colored coat": painted(Coat_Weight=1.0, Coat_Tint=(1.0, 0.5, 0.2, 1.0)),
    "metal": painted(Metallic=1.0, Roughness=0.3),
    "subsurface metal": painted(Subsurface_Weight=1.0, Metallic=1.0),
}
NOT_PARTED = {"grouped", "muted link", "no output", "glass"}
"""Those that stay matte, and that are black."""

DIFFUSE = {
    "no specular": painted(Specular_IOR_Level=0.0),
    "nor alpha": painted(Specular_IOR_Level=0.0, Alpha=0.5),
    "nor darkness": painted(Specular_IOR_Level=0.0, Emission_Strength=2.0, Subsurface_Weight=0.5),
    "translucent": lambda: shader_material("M", "ShaderNodeBsdfTranslucent", Color=GREEN),
    "subsurface": lambda: shader_material("M", "ShaderNodeSubsurfaceScattering", Color=GREEN),
    "toon": lambda: shader_material("M", "ShaderNodeBsdfToon", Color=GREEN),
    **{kind: EVERY[kind] for kind in ("diffuse", "emission", "mixed", "added", "cut out", "bare color")},
    **{kind: EVERY[kind] for kind in ("grouped", "group", "one group twice", "color at the output")},
}


def lit(folder: Path) -> np.ndarray:
    """What is seen in the light of a lamp and nothing else."""
    bpy.context.scene.world = None
    lamp = add_lamp("POINT", energy=5000.0, transform={"location": (0.3, 0.2, 2.0)})
    seen = seen_from_above(folder)
    bpy.data.objects.remove(lamp)
    return seen


@pytest.mark.one_blender
@pytest.mark.parametrize("kind", [kind for kind in {**EVERY, **LAYERED} if kind not in NOT_PARTED])
def test_in_even_light_a_baked_material_looks_as_it_does_unbaked(kind: str, tmp_path: Path) -> None:
    """All light is 1, so that Cycles' own render is the albedo seen from above plus emission."""
    add_plane(material={**EVERY, **LAYERED}[kind]())
    set_world(*WHITE)
    expected = seen_from_above(tmp_path, 8, samples=256).mean(axis=(0, 1))
    bake_by_hand((WHITE,), show="shine")
    np.testing.assert_allclose(
        seen_from_above(tmp_path, 8, samples=256).mean(axis=(0, 1)), expected, rtol=0.02
    )


@pytest.mark.one_blender
@pytest.mark.parametrize("degrees", [45, 60, 75])
@pytest.mark.parametrize("kind", ["rough", "smooth", "principled", "coat", "metal"])
def test_in_even_light_it_looks_so_from_the_side(kind: str, degrees: int, tmp_path: Path) -> None:
    plane = add_plane(material={**EVERY, **LAYERED}[kind]())
    plane.rotation_euler.x, plane.scale = np.radians(degrees), (9.0, 9.0, 9.0)
    set_world(*WHITE)
    expected = seen_from_above(tmp_path, 8, samples=256).mean(axis=(0, 1))
    bake_by_hand((WHITE,), show="shine")
    np.testing.assert_allclose(
        seen_from_above(tmp_path, 8, samples=256).mean(axis=(0, 1)), expected, rtol=0.02
    )


def assert_looks_as_unbaked(folder: Path, light: tuple[float, ...], *, samples: int, within: float) -> None:
    """Bake a light by hand, and compare the mean of what is seen with that of before."""
    expected = seen_from_above(folder, 8, samples=samples).mean(axis=(0, 1))
    bake_by_hand((light,), show="shine")
    shown = seen_from_above(folder, 8, samples=samples).mean(axis=(0, 1))
    np.testing.assert_allclose(shown, expected, rtol=within)


@pytest.mark.one_blender
@pytest.mark.parametrize("degrees", [0, 60])
@pytest.mark.parametrize("level", [0.0, 0.5])
@pytest.mark.parametrize("metallic", [0.0, 0.25, 0.5, 0.75, 1.0])
def test_what_is_a_metal_in_part_looks_as_unbaked(
    metallic: float, level: float, degrees: int, tmp_path: Path
) -> None:
    """In the light of the sky, and in that of a lamp with little of it; lamps add nothing that is diffuse."""
    paint = principled_material(Metallic=metallic, Specular_IOR_Level=level, Roughness=0.4)
    plane = add_plane(material=paint)
    plane.rotation_euler.x, plane.scale = np.radians(degrees), (9.0, 9.0, 9.0)
    set_world(*WHITE)
    assert_looks_as_unbaked(tmp_path, WHITE, samples=128, within=0.04)
    restore(bpy.context)
    set_world(0.25, 0.25, 0.25)
    add_lamp("SUN", energy=3.0, transform={"rotation_euler": (np.radians(degrees - 40.0), 0.0, 0.0)})
    received = 0.25 + 3.0 * np.cos(np.radians(40.0)) / np.pi
    assert_looks_as_unbaked(tmp_path, (received,) * 3, samples=128, within=0.015)


@pytest.mark.parametrize("kind", DIFFUSE)
def test_lamps_add_nothing_to_what_is_diffuse(kind: str, tmp_path: Path) -> None:
    add_plane(material=DIFFUSE[kind]())
    bake_by_hand(show="shine")
    np.testing.assert_array_equal(lit(tmp_path), seen_from_above(tmp_path))


def test_a_lamp_makes_a_highlight_unless_shown_matte(tmp_path: Path) -> None:
    add_plane(material=principled_material(Roughness=0.1))
    bake_by_hand(show="shine")
    assert (lit(tmp_path) > seen_from_above(tmp_path)).all()
    for look in ("matte", "lightmap"):
        show_lightmaps(look)
        np.testing.assert_array_equal(lit(tmp_path), seen_from_above(tmp_path))


@pytest.mark.parametrize("quantity", ["radiosity", "residual"])
def test_what_holds_reflected_light_stays_matte(quantity: str, tmp_path: Path) -> None:
    add_plane(material=principled_material(Roughness=0.1))
    bake_by_hand(quantity=quantity)
    matte = seen_from_above(tmp_path)
    show_lightmaps("shine")
    np.testing.assert_array_equal(lit(tmp_path), matte)


def test_a_mirror_shows_its_baked_surroundings(tmp_path: Path) -> None:
    """The ceiling's base color × lightmap, in the mirror's color."""
    add_plane(material=principled_material(name="Mirror", Metallic=1.0, Roughness=0.0))
    ceiling = [(-9, -9, 9), (-9, 9, 9), (9, 9, 9), (9, -9, 9)]
    add_mesh("Ceiling", ceiling, material=shader_material("M", "ShaderNodeBsdfDiffuse", Color=GREEN))
    bake_by_hand(show="shine")
    expected = np.multiply(BASE, np.multiply(GREEN[:3], TEXEL))
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], expected, rtol=2e-3)


def test_a_normal_map_turns_the_highlight(tmp_path: Path) -> None:
    """It shows what the turned surface mirrors, at 45°."""
    material = principled_material(Metallic=1.0, Roughness=0.0)
    add_plane(material=material)
    turned = add_mesh("Wall", [(1e3, -1e3, -1e3), (1e3, 1e3, -1e3), (1e3, 1e3, 1e3), (1e3, -1e3, 1e3)])
    turned.data.materials.append(shader_material("W", "ShaderNodeBsdfDiffuse", Color=(*WHITE, 1.0)))
    bake_by_hand(show="shine")
    assert seen_from_above(tmp_path).max() == 0.0
    tree = material.node_tree
    normal = tree.nodes.new("ShaderNodeCombineXYZ")
    normal.inputs["X"].default_value = normal.inputs["Z"].default_value = 0.5**0.5
    tree.links.new(normal.outputs[0], shader(material).inputs["Normal"])
    bake_by_hand(show="shine")
    mirrored = np.add(BASE, np.subtract(1.0, BASE) * (1.0 - 0.5**0.5) ** 5)
    np.testing.assert_allclose(seen_from_above(tmp_path)[0, 0], np.multiply(mirrored, TEXEL), rtol=1e-3)


def added(kind: str, place: str, mix: str = "Add") -> Material:
    """A Diffuse BSDF and one that shines, through a shader that joins them.

    place: "flat"; "shared", of one color node; "group", in a node group; "below", with a second Add Shader.
    """
    material = principled_material()
    tree = material.node_tree
    output = shader(material, "OUTPUT_MATERIAL").inputs["Surface"]
    tree.nodes.remove(shader(material))
    if place == "group":
        tree = bpy.data.node_groups.new("Inside", "ShaderNodeTree")
        tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        node = material.node_tree.nodes.new("ShaderNodeGroup")
        node.node_tree = tree
        material.node_tree.links.new(node.outputs[0], output)
        output = tree.nodes.new("NodeGroupOutput").inputs[0]
    diffuse = add_node(tree, "ShaderNodeBsdfDiffuse", Color=(*BASE, 1.0))
    gloss = add_node(tree, f"ShaderNodeBsdf{kind}", Color=(0.3, 0.6, 0.2, 1.0), Roughness=0.3)
    if place == "shared":
        color = tree.nodes.new("ShaderNodeRGB")
        color.outputs[0].default_value = GREEN
        for reader in (diffuse, gloss):
            tree.links.new(color.outputs[0], reader.inputs["Color"])
    join = tree.nodes.new(f"ShaderNode{mix}Shader")
    first = 1 if mix == "Mix" else 0
    tree.links.new(diffuse.outputs[0], join.inputs[first])
    tree.links.new(gloss.outputs[0], join.inputs[first + 1])
    if place == "below":
        outer = tree.nodes.new("ShaderNodeAddShader")
        tree.links.new(join.outputs[0], outer.inputs[0])
        tree.links.new(
            add_node(tree, "ShaderNodeBsdfTransparent", Color=(0.0,) * 4).outputs[0], outer.inputs[1]
        )
        join = outer
    tree.links.new(join.outputs[0], output)
    return material


@pytest.mark.one_blender
@pytest.mark.parametrize(
    ("kind", "place", "mix"),
    [
        ("Sheen", "flat", "Add"),
        ("Sheen", "group", "Add"),
        ("Sheen", "flat", "Mix"),
        ("Glossy", "flat", "Add"),
        ("Glossy", "shared", "Add"),
        ("Glossy", "below", "Add"),
        ("Glossy", "group", "Mix"),
    ],
)
def test_what_shines_next_to_a_diffuse_shader_stays(kind: str, place: str, mix: str, tmp_path: Path) -> None:
    """In a light that comes from all sides, and in that of a lamp, seen from the side."""
    plane = add_plane(material=added(kind, place, mix))
    plane.rotation_euler.x, plane.scale = np.radians(50), (9.0, 9.0, 9.0)
    received = 3.0 * np.cos(np.radians(50.0)) / np.pi
    set_world(*WHITE)
    assert_looks_as_unbaked(tmp_path, WHITE, samples=256, within=0.01)
    restore(bpy.context)
    bpy.context.scene.world = None
    add_lamp("SUN", energy=3.0, transform={"rotation_euler": (np.radians(100.0), 0.0, 0.0)})
    expected = seen_from_above(tmp_path, 2, samples=256)
    bake_by_hand(((received,) * 3,), show="shine")
    np.testing.assert_allclose(seen_from_above(tmp_path, 2, samples=256), expected, rtol=0.01)


def other_color(copy: Material) -> None:
    color_node(copy).default_value = GREEN


def other_texture(copy: Material) -> None:
    """Where the panel shows the color: a node in its place."""
    source = add_node(copy.node_tree, "ShaderNodeBrightContrast", Color=GREEN)
    copy.node_tree.links.new(source.outputs[0], behind_ours(shader(copy).inputs["Base Color"]))


def turn_to_metal(copy: Material) -> None:
    constant_of(shader(copy).inputs["Metallic"]).default_value = 1.0


def glow(copy: Material) -> None:
    constant_of(shader(copy).inputs["Emission Strength"]).default_value = 2.0


def bump(copy: Material) -> None:
    normal = copy.node_tree.nodes.new("ShaderNodeBump")
    copy.node_tree.links.new(normal.outputs[0], shader(copy).inputs["Normal"])


def set_layer(name: str, value: object) -> Callable[[Material], None]:
    """Where the panel shows it."""

    def edit(copy: Material) -> None:
        constant_of(shader(copy).inputs[name]).default_value = value

    edit.__name__ = name
    return edit


LAYERS = [
    set_layer("Roughness", 0.0),
    set_layer("IOR", 3.0),
    set_layer("Specular IOR Level", 1.0),
    set_layer("Specular Tint", (0.5, 0.25, 0.0, 1.0)),
    set_layer("Coat Weight", 1.0),
    set_layer("Coat Roughness", 1.0),
    set_layer("Coat IOR", 4.0),
    set_layer("Coat Tint", (1.0, 0.0, 0.0, 1.0)),
]


@pytest.mark.parametrize("edit", [other_color, other_texture, turn_to_metal, glow, bump, *LAYERS])
def test_an_edit_shows_at_once_as_after_another_bake(
    edit: Callable[[Material], None], tmp_path: Path
) -> None:
    paint = principled_material(Coat_Weight=0.25, Specular_IOR_Level=0.75)
    plane = add_plane(material=paint)
    plane.rotation_euler.x, plane.scale = np.radians(60), (9.0, 9.0, 9.0)
    bake_by_hand(show="shine")

    def seen() -> np.ndarray:
        return seen_from_above(tmp_path, samples=64)

    # Without a world all that is seen is the lightmap, by what the layers leave of it.
    before = seen()
    set_world(*WHITE)
    edit(copy_of(paint))
    lit_at_once = seen()
    bpy.context.scene.world = None
    at_once = seen()
    assert edit is bump or not np.allclose(at_once, before, rtol=2e-3)
    assert carry_material_edits() == ()
    bake_by_hand(show="shine")
    np.testing.assert_allclose(seen(), at_once, rtol=1e-5, atol=1e-7)
    set_world(*WHITE)
    np.testing.assert_allclose(seen(), lit_at_once, rtol=2e-3)


def test_materials_of_an_earlier_version_stay_matte(tmp_path: Path) -> None:
    if bpy.app.version < (5, 0):
        pytest.skip("the file is one of Blender 5.0")
    earlier = Path(__file__).parent / "files" / "lightmaps_without_records.blend"
    bpy.ops.wm.open_mainfile(filepath=str(earlier))
    matte = lit(tmp_path)
    assert matte.any()
    show_lightmaps("shine")
    np.testing.assert_array_equal(lit(tmp_path), matte)
    show_lightmaps("lightmap")
    assert not np.array_equal(lit(tmp_path), matte)


def test_objects_linked_from_a_baked_file_are_exported_as_they_were(tmp_path: Path) -> None:
    """Their copies of materials are another file's, and cannot be taken off; nor are they lamps."""
    add_plane(material=principled_material())
    plain = export_scene(bpy.context, BakeSettings(resolution=SMALL)).bake_scene.scene
    bake_by_hand()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    empty_scene()
    with bpy.data.libraries.load(str(tmp_path / "baked.blend"), link=True) as (_, wanted):
        wanted.objects = ["Plane"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    add_plane("Local", shader_material("Other", "ShaderNodeBsdfDiffuse"))
    both = export_scene(bpy.context, BakeSettings(resolution=SMALL)).bake_scene
    linked = next(item for item in both.objects if not item.bake)
    np.testing.assert_array_equal(both.scene.reflectance[linked.rows], plain.reflectance)
    assert not both.scene.emission.any()
