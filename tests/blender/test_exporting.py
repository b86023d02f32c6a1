"""Exports from the panel, by Blender's own exporter and for others; materials as glTF can have them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.blender.exporting import gltf_hook
from radiosity_addon.blender.exporting.export_scene import arrange_layers, export_scene
from radiosity_addon.blender.files.files import open_scene
from radiosity_addon.blender.operators.export_operators import export_folder, is_export_outdated
from radiosity_addon.exports import Glb

from . import group_bake
from .edited_copies import shader
from .hand_bake import BASE, TEXEL, add_plane, bake_by_hand, principled_material, seen_from_above


@pytest.fixture
def baked(registered: None, tmp_path: Path) -> Path:
    """Two planes that show a lightmap made by hand, in a saved file; the second has a mesh it shares."""
    material = principled_material()
    plane = add_plane(material=material)
    plane.name = "Plane"
    other = plane.copy()
    other.name, other.location = "Other", (3, 0, 0)
    bpy.context.scene.collection.objects.link(other)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    (tmp_path / "lightmaps").mkdir()
    bake_by_hand(folder=tmp_path / "lightmaps")
    return tmp_path


@pytest.fixture
def enabled() -> Iterator[None]:
    """The add-on among those whose hooks Blender's exporter calls."""
    entry = bpy.context.preferences.addons.new()
    entry.module = radiosity_addon.__name__
    yield
    bpy.context.preferences.addons.remove(entry)


def contents() -> dict[str, list[Any]]:
    """What objects show, and all names in the file."""
    kinds = ("objects", "meshes", "materials", "images", "scenes", "node_groups", "collections")
    names = {kind: sorted(block.name for block in getattr(bpy.data, kind)) for kind in kinds}
    shown = [
        (obj.name, obj.data.name, [(slot.link, slot.material.name) for slot in obj.material_slots])
        for obj in bpy.data.objects
    ]
    return {**names, "shown": shown}


def test_the_panel_exports_next_to_the_lightmaps(baked: Path) -> None:
    before = contents()
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    assert contents() == before
    folder = export_folder(bpy.context)
    assert folder == baked / "lightmaps" / "room_Scene_export"
    assert {"scene.glb", "scene_baked.glb", "viewer.html", "report.json"} <= {
        p.name for p in folder.iterdir()
    }
    glb = Glb.of_bytes((folder / "scene.glb").read_bytes())
    (material,) = glb.json["materials"]
    color = material["pbrMetallicRoughness"]["baseColorFactor"]
    np.testing.assert_allclose(color, (*BASE, 1.0), atol=1e-6)
    assert sorted(node["name"] for node in glb.json["nodes"]) == ["Other", "Plane"]


def test_roughness_and_metal_are_exported_as_they_are(baked: Path) -> None:
    """Constants and images of the original; where the light is baked in, surfaces stay matte."""
    material, folder = bpy.data.materials["Paint"], export_folder(bpy.context)
    tree, inputs = material.node_tree, shader(material).inputs
    inputs["Roughness"].default_value, inputs["Metallic"].default_value = 0.25, 0.75

    def exported(file: str) -> tuple[dict[str, Any], dict[str, Any]]:
        glb = Glb.of_bytes((folder / file).read_bytes())
        (written,) = glb.json["materials"]
        return glb.json, written["pbrMetallicRoughness"]

    assert bpy.ops.radiosity.export() == {"FINISHED"}
    _, surface = exported("scene.glb")
    assert (surface["roughnessFactor"], surface["metallicFactor"]) == pytest.approx((0.25, 0.75))
    assert exported("scene_baked.glb")[1]["metallicFactor"] == 0.0
    image = bpy.data.images.new("Worn", 2, 2)
    image.colorspace_settings.name = "Non-Color"
    image.pack()
    texture, parts = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeSeparateColor")
    texture.image = image
    tree.links.new(texture.outputs["Color"], parts.inputs["Color"])
    tree.links.new(parts.outputs["Green"], inputs["Roughness"])
    tree.links.new(parts.outputs["Blue"], inputs["Metallic"])
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    written, surface = exported("scene.glb")
    source = written["textures"][surface["metallicRoughnessTexture"]["index"]]["source"]
    assert written["images"][source]["name"] == "Worn"


def test_what_is_exported_stands_where_it_was_baked(baked: Path) -> None:
    """At the frame that is shown, and though viewports hide it."""
    scene, plane, other = bpy.context.scene, bpy.data.objects["Plane"], bpy.data.objects["Other"]
    for frame, height in ((0, 0.0), (20, 2.0)):
        plane.location.z = height
        plane.keyframe_insert("location", frame=frame)
    other.hide_viewport = True
    scene.frame_set(20)
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    written = Glb.of_bytes((export_folder(bpy.context) / "scene.glb").read_bytes())
    places = {node["name"]: node.get("translation") for node in written.json["nodes"]}
    np.testing.assert_allclose(places["Plane"], (0, 2, 0), atol=1e-6)
    np.testing.assert_allclose(places["Other"], (3, 0, 0), atol=1e-6)
    assert scene.frame_current == 20
    assert other.hide_viewport


def test_an_export_of_other_lightmaps_is_outdated(baked: Path) -> None:
    assert not is_export_outdated(bpy.context)
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    assert not is_export_outdated(bpy.context)
    image = next(each for each in bpy.data.images if each.get("radiosity_page") is not None)
    image["radiosity_version"] = "another"
    assert is_export_outdated(bpy.context)


def test_an_export_of_other_sliders_is_outdated(registered: None, tmp_path: Path) -> None:
    group_bake.lit_plane()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    (tmp_path / "lightmaps").mkdir()
    group_bake.bake_groups(folder=tmp_path / "lightmaps")
    group_bake.slide("Lamps", 2.0, (1.0, 0.5, 0.25))
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    assert not is_export_outdated(bpy.context)
    index = json.loads((export_folder(bpy.context) / "lightmaps.json").read_text(encoding="utf-8"))
    factors = {group["name"]: group["factor"] for group in index["light_groups"]}
    assert factors == {"Lamps": [2.0, 1.0, 0.5], "Glow": [1.0, 1.0, 1.0]}
    group_bake.slide("Lamps", 1.0)
    assert is_export_outdated(bpy.context)


def test_nothing_is_exported_without_a_form_or_a_bake(baked: Path) -> None:
    bpy.context.scene.radiosity.export_web = False
    with pytest.raises(RuntimeError, match="form"):
        bpy.ops.radiosity.export()
    bpy.ops.radiosity.restore()
    assert not bpy.ops.radiosity.export.poll()


def test_what_is_in_the_place_of_the_panels_export_is_an_error_message(baked: Path) -> None:
    place = baked / "lightmaps" / "room_Scene_export"
    place.write_text("mine")
    before = contents()
    with pytest.raises(RuntimeError, match="room_Scene_export"):
        bpy.ops.radiosity.export()
    assert place.read_text() == "mine"
    assert contents() == before


def test_blenders_own_exporter_names_lightmaps(baked: Path, enabled: None) -> None:
    before = contents()
    path = baked / "own.glb"
    bpy.ops.export_scene.gltf(filepath=str(path), export_extras=True, export_lights=True)
    assert contents() == before
    glb = Glb.of_bytes(path.read_bytes())
    text = json.dumps(glb.json)
    assert "radiosity" not in text
    (material,) = glb.json["materials"]
    assert material["extras"]["lightmap"]["file"] == "own_lightmap.ktx2"
    assert (baked / "own_lightmap.ktx2").is_file()
    assert material["extensions"]["MOZ_lightmap"]["texCoord"] == 1
    np.testing.assert_allclose(material["pbrMetallicRoughness"]["baseColorFactor"], (*BASE, 1.0), atol=1e-6)
    for mesh in glb.json["meshes"]:
        assert "TEXCOORD_1" in mesh["primitives"][0]["attributes"]


def test_blenders_own_exporter_replaces_no_file_of_others(baked: Path, enabled: None) -> None:
    (baked / "own_lightmap.ktx2").write_bytes(b"mine")
    bpy.ops.export_scene.gltf(filepath=str(baked / "own.glb"))
    assert (baked / "own_lightmap.ktx2").read_bytes() == b"mine"
    assert "MOZ_lightmap" not in json.dumps(Glb.of_bytes((baked / "own.glb").read_bytes()).json)


def test_objects_come_back_after_an_export_that_failed(baked: Path) -> None:
    before = contents()
    gltf_hook.before({"gltf_filepath": str(baked / "own.glb")})
    assert contents() != before
    gltf_hook.put_back()
    assert contents() == before


def test_an_exported_scene_shows_its_lightmap_when_it_is_imported(baked: Path, enabled: None) -> None:
    bpy.ops.radiosity.export()
    path = export_folder(bpy.context) / "scene.glb"
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    np.testing.assert_allclose(seen_from_above(baked)[0, 0], np.multiply(BASE, TEXEL), rtol=2e-3)


def test_an_exported_scene_is_opened_as_it_is_to_be_baked(baked: Path, enabled: None) -> None:
    bpy.ops.radiosity.export()
    open_scene(export_folder(bpy.context) / "scene.glb")
    nodes = [node.type for material in bpy.data.materials for node in material.node_tree.nodes]
    assert "EMISSION" not in nodes


def test_a_scene_without_lightmaps_is_exported_as_ever(
    registered: None, enabled: None, tmp_path: Path
) -> None:
    add_plane(material=principled_material())
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "plain.glb"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plain.glb"]


def test_prepared_objects_have_their_own_materials_and_stay(baked: Path) -> None:
    assert bpy.ops.radiosity.prepare_export() == {"FINISHED"}
    assert bpy.ops.radiosity.prepare_export() == {"FINISHED"}
    collection = bpy.data.collections["Lightmap Export"]
    assert collection.hide_render
    assert sorted(obj.name for obj in collection.objects) == ["Other (Export)", "Plane (Export)"]
    for obj in collection.objects:
        assert obj.data.uv_layers[1].name == "Lightmap"
        assert "(Lightmap)" not in obj.data.materials[0].name
        assert not [key for key in (*obj.keys(), *obj.data.keys()) if key.startswith("radiosity")]
    bpy.ops.radiosity.restore()
    assert len(collection.objects) == 2


@pytest.mark.parametrize(
    "names", [["Lightmap"], ["A", "Lightmap"], ["A", "B", "Lightmap"], ["Lightmap", "A"]]
)
def test_the_lightmap_is_always_the_second_layer(names: list[str]) -> None:
    mesh = add_plane().data
    while mesh.uv_layers:
        mesh.uv_layers.remove(mesh.uv_layers[0])
    values = {name: np.random.default_rng(number).random(8, np.float32) for number, name in enumerate(names)}
    for name in names:
        mesh.uv_layers.new(name=name).uv.foreach_set("vector", values[name])
    others = [name for name in names if name != "Lightmap"]
    assert arrange_layers(mesh, "Plane") == bool(others)
    found = [layer.name for layer in mesh.uv_layers]
    assert found == [*(others[:1] or ["UVMap"]), "Lightmap", *others[1:]]
    for layer in mesh.uv_layers:
        got = np.empty(8, np.float32)
        layer.uv.foreach_get("vector", got)
        np.testing.assert_array_equal(got, values.get(layer.name, values["Lightmap"]))
    assert mesh.uv_layers[0].active_render


def test_the_exported_page_is_the_baked_one(baked: Path) -> None:
    made = export_scene(bpy.context)
    try:
        np.testing.assert_allclose(made.shown.page(0)[..., :], TEXEL * np.ones((4, 8, 3)), rtol=1e-6)
    finally:
        made.close()


@pytest.mark.parametrize(("most", "file"), [(100, "scene.glb"), (20_000, "viewer.html")])
def test_a_disk_without_room_is_named_and_nothing_is_written(baked: Path, most: int, file: str) -> None:
    """As a limit of the size of files, which is one of the process; the earlier export stays."""
    resource = pytest.importorskip("resource")  # not on Windows
    bpy.context.scene.radiosity.export_web = True
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    for _ in range(2):
        before = {path: path.read_bytes() for path in baked.rglob("*") if path.is_file()}
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, limits[1]))
        try:
            with pytest.raises(RuntimeError, match=rf"cannot write '.*_export/{file}': File too large"):
                bpy.ops.radiosity.export()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert {path: path.read_bytes() for path in baked.rglob("*") if path.is_file()} == before
        assert bpy.ops.radiosity.export() == {"FINISHED"}


def test_a_file_that_was_moved_exports_where_it_is(baked: Path) -> None:
    """With its folder it replaces its export there; without its lightmaps it says what is missing."""
    bpy.ops.file.make_paths_relative()
    bpy.ops.wm.save_mainfile()
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    there = baked.rename(baked.parent / "moved")
    bpy.ops.wm.open_mainfile(filepath=str(there / "room.blend"))
    before = {path.name for path in export_folder(bpy.context).iterdir()}
    (export_folder(bpy.context) / "scene.glb").unlink()
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    assert {path.name for path in export_folder(bpy.context).iterdir()} == before
    assert export_folder(bpy.context).parent == there / "lightmaps"
    assert not baked.exists()
    alone = baked.parent / "alone"
    alone.mkdir()
    (there / "room.blend").rename(alone / "room.blend")
    bpy.ops.wm.open_mainfile(filepath=str(alone / "room.blend"))
    with pytest.raises(
        RuntimeError, match=r"lightmap '.*' is missing or damaged: put it back, or bake again"
    ):
        bpy.ops.radiosity.export()
    assert [path.name for path in alone.rglob("*")] == ["room.blend"]


def test_scenes_whose_names_differ_in_case_alone_do_not_replace_each_other(baked: Path) -> None:
    """Where upper and lower case do not count, both exports go into one folder."""
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    earlier = export_folder(bpy.context)
    other = bpy.context.scene.copy()
    other.name = "scene"
    bpy.context.window.scene = other
    assert export_folder(bpy.context).name == "room_scene_export"
    earlier.rename(export_folder(bpy.context))  # what such a file system shows
    before = {path: path.read_bytes() for path in baked.rglob("*") if path.is_file()}
    with pytest.raises(RuntimeError, match="is of scene 'Scene' of"):
        bpy.ops.radiosity.export()
    assert {path: path.read_bytes() for path in baked.rglob("*") if path.is_file()} == before
