"""Objects that are baked, only light, or are left out; curves and the like; Cycles' ray visibility."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.base.errors import UsageError
from radiosity_addon.base.steps import drain
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.jobs.inspection import ERROR, inspect
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.exporting import add_cube, add_instance, export_with, objects_by_name
from tests.blender.file_dump import differences, dump_file
from tests.blender.scenes import (
    add_lamp,
    add_mesh,
    add_object,
    measure_irradiance,
    set_world,
    shader_material,
)


def other_surface(kind: str) -> bpy.types.Object:
    """Add a surface that is not a mesh, 2 m above the origin."""
    if kind == "CURVE":
        data = bpy.data.curves.new("Other", "CURVE")
        data.dimensions, data.bevel_depth = "3D", 0.2
        data.splines.new("POLY").points.add(1)
        data.splines[0].points[1].co = (1, 0, 0, 1)
    elif kind == "FONT":
        data = bpy.data.curves.new("Other", "FONT")
        data.body, data.extrude = "A", 0.1
    elif kind == "META":
        data = bpy.data.metaballs.new("Other")
        data.elements.new().radius = 1.0
    else:
        bpy.ops.surface.primitive_nurbs_surface_sphere_add()
        data = bpy.context.object.data
        bpy.data.objects.remove(bpy.context.object)
    return add_object("Other", data, location=(0, 0, 2))


@pytest.mark.parametrize("kind", ["CURVE", "FONT", "META", "SURFACE"])
def test_other_surfaces_get_lightmaps_and_are_restored_exactly(kind: str, registered: None) -> None:
    add_mesh("Floor")
    obj = other_surface(kind)
    if kind == "META":
        add_object("Other.001", obj.data, location=(1, 0, 2))
    add_lamp("POINT", transform={"location": (0, 0, 5)}, energy=100.0)
    bpy.context.view_layer.update()
    before = dump_file()
    report = drain(run_bake(bpy.context, BakeSettings(resolution=64, quality="draft"), None)).as_dict()
    assert sorted(entry["object"] for entry in report["objects"]) == ["Floor", "Other"]
    stand_in = bpy.data.objects["Other (Lightmap)"]
    assert "Lightmap" in stand_in.data.uv_layers
    assert len(stand_in.data.polygons) > 0
    assert obj.hide_render
    shown = {i.object.name for i in bpy.context.evaluated_depsgraph_get().object_instances if i.show_self}
    assert shown == {"Floor", "Other (Lightmap)", "Lamp"}
    restore(bpy.context)
    bpy.context.scene.property_unset("radiosity")
    assert differences(before, dump_file()) == []


def test_the_users_modes(registered: None) -> None:
    for name in ("Floor", "Lighting", "Gone"):
        add_cube(name)
    bpy.data.objects["Lighting"].radiosity_mode = "LIGHT_ONLY"
    bpy.data.objects["Gone"].radiosity_mode = "IGNORE"
    bpy.data.objects["Floor"].radiosity_texel_scale = 2.5
    bpy.data.objects["Floor"].radiosity_lightmap_page = 3
    found = objects_by_name(export_with(sky=True, pages=3))
    assert {name: (item.bake, item.count) for name, item in found.items()} == {
        "Floor": (True, 12),
        "Lighting": (False, 12),
        "Gone": (False, 0),
    }
    assert found["Floor"].texel_scale == 2.5
    assert found["Floor"].page == 3
    with pytest.raises(UsageError, match=r"'Lighting'.*ignored"):
        export_with(objects=("Lighting",))


def test_an_object_on_a_page_that_there_is_not_is_refused(registered: None) -> None:
    add_cube("Floor").radiosity_lightmap_page = 3
    with pytest.raises(UsageError, match="'Floor' is to be on page 3, but the bake has 2 pages"):
        export_with(sky=True, pages=2)
    settings = BakeSettings(sky=True, pages=2)
    errors = [each.message for each in inspect(bpy.context, settings, None).findings if each.level == ERROR]
    assert any("page 3" in message for message in errors)
    export_with(sky=True, atlas="per-object")
    export_with(sky=True, texel_density=10.0)


def test_an_instance_is_on_the_page_of_what_makes_it(registered: None) -> None:
    collection = bpy.data.collections.new("Trees")
    tree = add_cube("Tree")
    bpy.context.scene.collection.objects.unlink(tree)
    collection.objects.link(tree)
    tree.radiosity_lightmap_page = 1
    add_instance(collection, "First")
    add_instance(collection, "Second").radiosity_lightmap_page = 2
    found = objects_by_name(export_with(sky=True, pages=2))
    assert sorted(item.page for item in found.values()) == [1, 2]


def test_modes_on_the_command_line_win_and_unknown_names_are_refused() -> None:
    for name in ("Floor", "Wall", "Chair"):
        add_cube(name)
    found = objects_by_name(export_with(sky=True, ignore=("Chair",), light_only=("Wall",)))
    assert [(found[name].bake, found[name].count) for name in ("Floor", "Wall", "Chair")] == [
        (True, 12),
        (False, 12),
        (False, 0),
    ]
    with pytest.raises(UsageError, match=r"--ignore.*'Chairs'.*'Chair'"):
        export_with(ignore=("Chairs",))
    with pytest.raises(UsageError, match="both"):
        BakeSettings(objects=("Wall",), light_only=("Wall",))


def test_nan_coordinates_of_what_is_ignored_do_no_harm() -> None:
    add_cube("Floor")
    add_cube("Broken").data.vertices[0].co = (math.nan, 0, 0)
    assert objects_by_name(export_with(sky=True, ignore=("Broken",)))["Broken"].count == 0


def test_what_is_ignored_still_shows_next_to_a_baked_instance(registered: None) -> None:
    group = bpy.data.collections.new("Group")
    add_cube("Baked", collection=group)
    add_cube("Left", collection=group, location=(3, 0, 0)).radiosity_mode = "IGNORE"
    add_instance(group, "Here")
    set_world(1, 1, 1)
    drain(run_bake(bpy.context, BakeSettings(resolution=32, quality="sketch"), None))
    shown = {i.object.name for i in bpy.context.evaluated_depsgraph_get().object_instances if i.show_self}
    assert {"Here/Baked (Lightmap)", "Here/Left (Lightmap)"} <= shown
    assert "Lightmap" not in bpy.data.objects["Here/Left (Lightmap)"].data.uv_layers


@pytest.mark.parametrize("flag", ["is_holdout", "is_shadow_catcher"])
def test_what_is_never_seen_itself_gets_no_lightmap(flag: str) -> None:
    add_cube("Floor")
    setattr(add_cube("Stand-in"), flag, True)
    export = export_with(sky=True)
    assert [obj.bake for obj in export.bake_scene.objects] == [True, False]
    assert [w.name for w in export.bake_scene.warnings] == ["Stand-in"]


VISIBILITIES = [
    {"visible_diffuse": False},
    {"visible_shadow": False},
    {"visible_diffuse": False, "visible_shadow": False},
    {"is_holdout": True},
    {"is_shadow_catcher": True},
    {},
]


@pytest.mark.parametrize("flags", VISIBILITIES, ids=lambda flags: "+".join(flags) or "none")
def test_ray_visibility_as_in_cycles(flags: dict[str, bool]) -> None:
    """A red screen between lamp and meter, and a red wall beside it, both with the flags."""
    red = shader_material("Red", "ShaderNodeBsdfDiffuse", Color=(0.9, 0.1, 0.1, 1.0))
    meter = add_mesh(
        "Meter", material=shader_material("Gray", "ShaderNodeBsdfDiffuse", Color=(0.5,) * 3 + (1,))
    )
    screen = add_mesh("Screen", material=red, location=(0.8, 0, 1.5), scale=(0.6, 0.6, 1))
    wall = add_mesh("Wall", material=red, location=(-1.2, 0, 1), rotation_euler=(0, math.pi / 2, 0))
    for obj in (screen, wall):
        for attribute, value in flags.items():
            setattr(obj, attribute, value)
    add_lamp("POINT", transform={"location": (0.5, 0, 3)}, energy=500.0, shadow_soft_size=0.1)
    export = export_with(objects=("Meter",))
    result = bake(export.bake_scene, BakeSettings(resolution=32, quantity="irradiance"))
    page = result.pages[0]
    ours = page.pixels[page.coverage].mean(axis=0)
    cycles = measure_irradiance(meter, samples=512)
    np.testing.assert_allclose(ours, cycles, rtol=0.02)
    balance = result.solver["power_W"]
    # What lets lamps' light through and reflects it too makes energy, in Cycles as here.
    if flags.get("visible_shadow", True) or "visible_diffuse" in flags:
        assert balance["absorbed"] + balance["escaped"] == pytest.approx(balance["emitted"], rel=0.01)


def test_a_restored_file_keeps_nothing_of_the_roles(registered: None, tmp_path: Path) -> None:
    add_cube("Cube")
    before = dump_file()
    assert bpy.data.objects["Cube"].radiosity_mode == "BAKE"
    assert differences(before, dump_file()) == []
