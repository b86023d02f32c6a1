"""The panel's light groups: what it lists, and its buttons."""

from __future__ import annotations

import bpy
import pytest

from radiosity_addon.blender.images.light_mixer import mixers, sliders_of
from radiosity_addon.blender.panels import light_group_panels
from radiosity_addon.blender.scene_records.light_membership import NAME
from radiosity_addon.blender.settings.light_group_properties import list_groups
from radiosity_addon.blender.settings.properties import settings_of
from tests.blender.group_bake import bake_groups, lit_plane, slide
from tests.blender.note_layout import NoteLayout, Notes, labels
from tests.blender.scenes import add_lamp, add_mesh, set_world, shader_material


@pytest.fixture(autouse=True)
def lamps(registered: None) -> dict[str, bpy.types.Object]:
    return {name: add_lamp("POINT", name) for name in ("one", "two", "three")}


def select(*objects: bpy.types.Object) -> None:
    bpy.context.view_layer.update()
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)


def selected() -> set[str]:
    return {obj.name for obj in bpy.context.view_layer.objects.selected}


def listed() -> list[tuple[str, int, int, int, int, int]]:
    return [
        (group.name, group.lamps, group.objects, group.materials, group.collections, group.worlds)
        for group in list_groups(bpy.context.scene)
    ]


def test_selected_lamps_are_assigned_listed_and_selected_again(lamps: dict) -> None:
    select(lamps["one"], lamps["two"])
    assert bpy.ops.radiosity.light_group_assign(group=" Kitchen ") == {"FINISHED"}
    assert listed() == [("Kitchen", 2, 0, 0, 0, 0)]
    select(lamps["three"])
    bpy.ops.radiosity.light_group_select(group="Kitchen")
    assert selected() == {"one", "two"}
    select(lamps["one"])
    bpy.ops.radiosity.light_group_remove()
    assert listed() == [("Kitchen", 1, 0, 0, 0, 0)]
    assert lamps["one"].lightgroup == ""
    assert [group.name for group in bpy.context.view_layer.lightgroups] == ["Kitchen"]


def test_assigning_replaces_the_field_of_earlier_versions(lamps: dict) -> None:
    lamps["one"].radiosity_light_group = "Old"
    assert listed() == [("Old", 1, 0, 0, 0, 0)]
    select(lamps["one"])
    bpy.ops.radiosity.light_group_assign(group="New")
    assert listed() == [("New", 1, 0, 0, 0, 0)]
    assert not lamps["one"].is_property_set(NAME)


def test_a_group_without_members_is_listed() -> None:
    bpy.context.view_layer.lightgroups.add(name="Empty")
    assert listed() == [("Empty", 0, 0, 0, 0, 0)]


def test_everything_with_a_name_is_listed() -> None:
    bpy.context.scene.collection.radiosity_light_group = "house"
    set_world(1.0, 1.0, 1.0).radiosity_light_group = "sky"
    glow = shader_material("glow", "ShaderNodeEmission")
    glow.radiosity_light_group = "Signs"
    sign = add_mesh("Sign", material=glow)
    add_mesh("Own", material=glow).radiosity_light_group = "signs"
    assert listed() == [
        ("house", 3, 0, 0, 1, 0),
        ("Signs", 0, 0, 1, 0, 0),
        ("signs", 0, 1, 0, 0, 0),
        ("sky", 0, 0, 0, 0, 1),
    ]
    bpy.ops.radiosity.light_group_select(group="Signs")
    assert selected() == {sign.name}


def test_buttons_that_cannot_work_are_off_or_say_why(lamps: dict) -> None:
    select()
    assert not bpy.ops.radiosity.light_group_assign.poll()
    assert not bpy.ops.radiosity.light_group_remove.poll()
    assert not bpy.ops.radiosity.light_group_reset.poll()
    select(lamps["one"])
    with pytest.raises(RuntimeError, match="needs a name"):
        bpy.ops.radiosity.light_group_assign("EXEC_DEFAULT", group="  ")


def test_reset_sets_the_sliders_back() -> None:
    lit_plane()
    bake_groups()
    slide("Glow", 0.25, (1.0, 0.0, 0.0))
    assert bpy.ops.radiosity.light_group_reset() == {"FINISHED"}
    for sliders in sliders_of(mixers()[0]):
        assert (sliders.strength.default_value, tuple(sliders.color.default_value)) == (1.0, (1, 1, 1, 1))


def test_the_switch_is_the_setting() -> None:
    assert not settings_of(bpy.context).light_groups
    bpy.context.scene.radiosity.use_light_groups = True
    assert settings_of(bpy.context).light_groups


def test_every_name_and_button_has_a_tooltip() -> None:
    for kind in (bpy.types.Object, bpy.types.Material, bpy.types.World, bpy.types.Collection):
        assert kind.bl_rna.properties[NAME].description
    for name in ("assign", "remove", "select", "reset"):
        told = getattr(bpy.ops.radiosity, f"light_group_{name}").get_rna_type()
        assert told.description
        assert all(prop.description for prop in told.properties if prop.identifier != "rna_type")


def test_the_panel_draws_groups_and_sliders(lamps: dict) -> None:
    lit_plane().active_material.radiosity_light_group = "Glow"
    lamps["one"].radiosity_light_group = "Lamps"
    bake_groups()
    notes: Notes = []
    light_group_panels.LightGroupSection.draw(NoteLayout(notes), bpy.context)
    # Each group in the list with the numbers of what is in it (an object and a material, whose lightmap
    # copy does not count), and again with its sliders.
    assert labels(notes) == ["Glow", "1", "1", "Lamps", "1", "Lamps", "Glow"]
    drawn = [args[0] for name, args, _ in notes if name == "prop" and args[1] == "default_value"]
    assert drawn == [
        socket for sliders in sliders_of(mixers()[0]) for socket in (sliders.color, sliders.strength)
    ]
