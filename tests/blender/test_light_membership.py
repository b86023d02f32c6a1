"""Which light group lamps, emissive surfaces and the world are exported in."""

from __future__ import annotations

import bpy
import pytest

from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from tests.blender.scenes import add_lamp, add_mesh, add_object, set_world, shader_material
from tests.wording import says


@pytest.fixture(autouse=True)
def floor(registered: None) -> None:
    add_mesh("Floor")


def collection(
    name: str, group: str = "", inside: bpy.types.Collection | None = None
) -> bpy.types.Collection:
    made = bpy.data.collections.new(name)
    (inside or bpy.context.scene.collection).children.link(made)
    made.radiosity_light_group = group
    return made


def move(obj: bpy.types.Object, *collections: bpy.types.Collection) -> bpy.types.Object:
    for each in list(obj.users_collection):
        each.objects.unlink(obj)
    for each in collections:
        each.objects.link(obj)
    return obj


def lamp(name: str, group: str = "", *collections: bpy.types.Collection) -> bpy.types.Object:
    obj = add_lamp("POINT", name, energy=10.0)
    obj.radiosity_light_group = group
    return move(obj, *collections) if collections else obj


def exported(**settings: object) -> BakeScene:
    return export_scene(bpy.context, BakeSettings(**settings)).bake_scene


def of_lamps() -> dict[str, str]:
    found = exported()
    return dict(zip([light.name for light in found.scene.lights], found.light_groups, strict=True))


def of_emitters() -> set[tuple[str, str]]:
    found = exported()
    return set(zip(found.emitter_names, found.emitter_groups, strict=True))


def test_a_lamp_s_own_name_wins_then_the_innermost_collection_s() -> None:
    outer = collection("Outer", "house")
    inner = collection("Inner", "kitchen", outer)
    plain = collection("Plain", "", inner)
    lamp("own", "hall", inner)
    lamp("inner", "", inner)
    lamp("deep", "", plain)
    lamp("outer", "", outer)
    lamp("free")
    assert of_lamps() == {"own": "hall", "inner": "kitchen", "deep": "kitchen", "outer": "house", "free": ""}


def test_of_two_collections_the_nearer_name_wins_and_other_scenes_do_not_count() -> None:
    outer = collection("Outer", "house")
    plain = collection("Plain", "", outer)
    near = collection("Near", "garden")
    lamp("both", "", plain, near)
    other = bpy.data.scenes.new("Other")
    theirs = bpy.data.collections.new("Theirs")
    theirs.radiosity_light_group = "elsewhere"
    other.collection.children.link(theirs)
    lamp("shared", "", plain, theirs)
    assert of_lamps() == {"both": "garden", "shared": "house"}


def test_the_instance_wins_over_what_it_shows() -> None:
    asset = bpy.data.collections.new("Asset")
    asset.radiosity_light_group = "asset"
    lamp("bulb", "", asset)
    around = collection("Around", "around")
    for name, group in (("one", "left"), ("two", "")):
        instance = add_object(name, None, around)
        instance.instance_type, instance.instance_collection = "COLLECTION", asset
        instance.radiosity_light_group = group
    assert sorted(exported().light_groups) == ["asset", "left"]
    bpy.data.objects["bulb"].radiosity_light_group = "bulb"
    assert sorted(exported().light_groups) == ["bulb", "left"]
    asset.radiosity_light_group = bpy.data.objects["bulb"].radiosity_light_group = ""
    assert sorted(exported().light_groups) == ["around", "left"]


def test_a_material_is_a_source_for_each_group_that_it_emits_in() -> None:
    glow = shader_material("glow", "ShaderNodeEmission", Strength=2.0)
    signs = collection("Signs", "signs")
    add_mesh("Plain", material=glow, location=(0, 0, 1))
    add_mesh("Own", material=glow, location=(0, 0, 2)).radiosity_light_group = "own"
    add_mesh("Own too", material=glow, location=(0, 0, 3)).radiosity_light_group = "own"
    add_mesh("Sign", material=glow, location=(0, 0, 4), collection=signs)
    assert of_emitters() == {("glow", ""), ("glow", "own"), ("glow", "signs")}
    assert len(exported().emitter_names) == 3
    glow.radiosity_light_group = "glow"
    assert of_emitters() == {("glow", "glow"), ("glow", "own")}


def test_emitters_number_the_triangles() -> None:
    glow = shader_material("glow", "ShaderNodeEmission", Strength=2.0)
    add_mesh("A", material=glow, location=(0, 0, 1)).radiosity_light_group = "a"
    add_mesh("B", material=glow, location=(0, 0, 2)).radiosity_light_group = "b"
    found = exported()
    groups = {
        item.name: {found.emitter_groups[number] for number in found.emitter[item.rows]}
        for item in found.objects
        if item.name != "Floor"
    }
    assert groups == {"A": {"a"}, "B": {"b"}}


def test_the_world_is_in_its_group() -> None:
    set_world(1.0, 1.0, 1.0).radiosity_light_group = " outside "
    assert of_lamps() == {"World": "outside"}


def test_groups_that_are_wanted_and_not_there_are_warned_of() -> None:
    lamp("free")
    assert not any("light group" in warning.message for warning in exported().warnings)
    (warning,) = exported(light_groups=True).warnings
    assert says(warning.message, "Scene", "light group")


def test_blenders_own_groups_count_where_a_view_layer_lists_them() -> None:
    bpy.context.view_layer.lightgroups.add(name="hall")
    one, other = lamp("one"), lamp("other")
    one.lightgroup, other.lightgroup = "hall", "removed"
    world = set_world(1.0, 1.0, 1.0)
    world.lightgroup = "hall"
    assert of_lamps() == {"one": "hall", "other": "", world.name: "hall"}


def test_blenders_own_group_comes_before_the_field_of_earlier_versions() -> None:
    bpy.context.view_layer.lightgroups.add(name="hall")
    lamp("earlier", "before")
    lamp("own", "before").lightgroup = "hall"
    assert of_lamps() == {"own": "hall", "earlier": "before"}


def test_an_objects_blender_group_wins_over_its_materials() -> None:
    bpy.context.view_layer.lightgroups.add(name="hall")
    glow = shader_material("glow", "ShaderNodeEmission")
    glow.radiosity_light_group = "signs"
    add_mesh("Sign", material=glow)
    add_mesh("Own", material=glow).lightgroup = "hall"
    assert of_emitters() == {("glow", "signs"), ("glow", "hall")}
