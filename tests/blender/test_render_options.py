"""Settings of scene and view layer act as in a render, or are told to be ignored."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.scene_records.export_sources import Export
from tests.blender.exporting import add_cube, export_with, objects_by_name
from tests.blender.scenes import add_lamp, add_mesh, measure_irradiance, set_world
from tests.wording import one_says, says


def messages(export: Export) -> list[str]:
    return [warning.message for warning in export.bake_scene.warnings]


def blue_world() -> bpy.types.World:
    world = set_world(0.0, 0.0, 1.0)
    bpy.context.scene.world = None
    return world


@pytest.mark.parametrize("settings", [{"use_sky": False}, {"world_override": True}])
def test_the_view_layer_s_world_lights_as_in_cycles(settings: dict[str, Any]) -> None:
    floor, layer = add_mesh("Floor"), bpy.context.view_layer
    if "world_override" in settings:
        if not hasattr(layer, "world_override"):
            pytest.skip(f"Blender {bpy.app.version_string} does not have it")
        settings = {"world_override": blue_world()}
    set_world(1.0, 0.5, 0.25)
    for name, value in settings.items():
        setattr(layer, name, value)
    lights = export_with().bake_scene.scene.lights
    ours = sum((np.pi * light.strength for light in lights), np.zeros(3))
    np.testing.assert_allclose(ours, measure_irradiance(floor), rtol=0.01, atol=1e-6)


def test_what_is_not_followed_is_reported() -> None:
    scene = bpy.context.scene
    add_lamp("POINT", energy=1.0)
    add_mesh("Floor")
    assert not messages(export_with())
    scene.cycles.use_fast_gi = True
    scene.render.use_simplify = scene.cycles.use_camera_cull = True
    add_cube("Culled").cycles.use_camera_cull = True
    of_scene, of_object = messages(export_with())
    assert says(of_scene, scene.name, "Fast GI")
    assert says(of_object, "Culled", "culling")


def test_a_library_that_is_missing_is_named(tmp_path: Path) -> None:
    """Blender shows nothing in its place, so that light would be missing without a word."""
    library = tmp_path / "lamps.blend"
    lamp = add_lamp("POINT", energy=100.0)
    bpy.data.libraries.write(str(library), {lamp})
    bpy.data.objects.remove(lamp)
    with bpy.data.libraries.load(str(library), link=True) as (there, linked):
        linked.objects = there.objects
    bpy.context.scene.collection.objects.link(linked.objects[0])
    add_mesh("Floor")
    add_lamp("SUN", energy=1.0)
    assert not messages(export_with())
    file = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    library.unlink()
    bpy.ops.wm.open_mainfile(filepath=file)
    (message,) = messages(export_with())
    assert says(message, "lamps.blend", "relink")


def test_a_driven_viewport_is_reported() -> None:
    add_mesh("Floor")
    add_lamp("POINT", energy=1.0)
    hidden, plain = add_cube("Hidden"), add_cube("Plain")
    modifier = plain.modifiers.new("Finer", "SUBSURF")
    for owner, name, value in ((hidden, "hide_viewport", "1"), (modifier, "show_viewport", "0")):
        owner.driver_add(name).driver.expression = value
    export = export_with()
    assert "Hidden" not in objects_by_name(export)
    assert objects_by_name(export)["Plain"].count == 12
    of_object, of_modifier = messages(export)
    assert says(of_object, "Hidden", "driven")
    assert says(of_modifier, "Plain", "Finer", "driven")


@pytest.mark.skipif(not hasattr(bpy.data, "colorspace"), reason="files have no working space here")
def test_an_unusual_working_space_is_reported() -> None:
    add_mesh("Floor")
    add_lamp("POINT", energy=1.0)
    bpy.ops.wm.set_working_color_space(working_space="ACEScg")
    (told,) = messages(export_with())
    assert "ACEScg" in told


def test_nodes_that_ask_for_the_viewport_are_reported() -> None:
    inner = bpy.data.node_groups.new("Inner", "GeometryNodeTree")
    inner.nodes.new("GeometryNodeIsViewport")
    outer = bpy.data.node_groups.new("Outer", "GeometryNodeTree")
    for kind in ("INPUT", "OUTPUT"):
        outer.interface.new_socket("Geometry", in_out=kind, socket_type="NodeSocketGeometry")
    ends = [outer.nodes.new(f"NodeGroup{end}") for end in ("Input", "Output")]
    outer.links.new(ends[0].outputs[0], ends[1].inputs[0])
    outer.nodes.new("GeometryNodeGroup").node_tree = inner
    add_mesh("Floor").modifiers.new("Nodes", "NODES").node_group = outer
    assert one_says(messages(export_with()), "Floor", "Is Viewport")


def background() -> bpy.types.Scene:
    """Show a scene behind the context's: a lamp, a roof over half of the floor, what renders do not show."""
    behind = bpy.data.scenes.new("Behind")
    add_lamp("POINT", energy=100.0, transform={"location": (0, 0, 3)})
    roof = add_mesh("Roof", location=(1, 0, 1))
    add_mesh("Shade", location=(-1, 0, 1)).hide_render = True
    monitor, eye = (add_mesh(name, location=(0, 0, height)) for name, height in (("Monitor", 5), ("Eye", 6)))
    monitor.hide_viewport = True
    for obj in [obj for obj in bpy.context.scene.objects if obj.name != "Floor"]:
        bpy.context.scene.collection.objects.unlink(obj)
        behind.collection.objects.link(obj)
    eye.hide_set(True, view_layer=behind.view_layers[0])
    roof.select_set(True, view_layer=behind.view_layers[0])
    bpy.context.scene.background_set = behind
    return behind


def test_a_background_scene_lights_and_blocks_as_in_cycles() -> None:
    floor = add_mesh("Floor")
    behind = background()
    layer = behind.view_layers[0]

    def state() -> list:
        return [(o.name, o.hide_viewport, o.select_get(view_layer=layer), o.hide_get(view_layer=layer))
                for o in layer.objects]  # fmt: skip

    before = state()
    export = export_with()
    assert state() == before
    bake = {name: obj.bake for name, obj in objects_by_name(export).items()}
    assert bake == {"Floor": True, "Roof": False, "Monitor": False, "Eye": False}
    assert [light.name for light in export.bake_scene.scene.lights] == ["Lamp"]
    (told,) = messages(export)
    assert says(told, "Behind", "background")
    shaded = measure_irradiance(floor)
    behind.objects["Roof"].hide_render = True
    assert shaded.mean() < 0.8 * measure_irradiance(floor).mean()
    assert "Roof" not in objects_by_name(export_with())


def test_what_a_scene_shares_with_its_background_is_there_once() -> None:
    floor = add_mesh("Floor")
    behind = bpy.data.scenes.new("Behind")
    behind.collection.objects.link(floor)
    bpy.context.scene.background_set = behind
    export = export_with()
    assert [(obj.name, obj.bake) for obj in export.bake_scene.objects] == [("Floor", True)]


def test_a_holdout_collection_gets_no_lightmaps() -> None:
    add_mesh("Floor")
    held = bpy.data.collections.new("Held")
    bpy.context.scene.collection.children.link(held)
    add_mesh("Screen", collection=held, location=(0, 0, 1))
    bpy.context.view_layer.layer_collection.children["Held"].holdout = True
    export = export_with()
    assert {name: obj.bake for name, obj in objects_by_name(export).items()} == {
        "Floor": True,
        "Screen": False,
    }
    assert one_says(messages(export), "Screen", "holdout")
