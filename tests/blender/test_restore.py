"""Restore brings the whole file back exactly, at once and after saving and reloading."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.apply.apply import apply_lightmaps
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks import bake_record
from radiosity_addon.blender.files.files import open_scene
from radiosity_addon.blender.images.images import write_pages
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.file_dump import differences, differences_since, dump_file, tidy_dump
from tests.blender.hand_bake import SMALL, hand_result
from tests.blender.zoo import build_zoo

pytestmark = pytest.mark.usefixtures("record")


def _bake(folder: Path | None, **settings: str) -> None:
    wanted = BakeSettings(**{"resolution": SMALL, **settings})
    export = export_scene(bpy.context, wanted)
    result = hand_result(export, ((0.25, 0.5, 0.75), (1.0, 2.0, 3.0)))
    apply_lightmaps(bpy.context, export, result, write_pages(result, wanted, folder), wanted)


def test_restore_leaves_no_difference(tmp_path: Path) -> None:
    build_zoo(bpy.context)
    before = tidy_dump()
    _bake(tmp_path)
    assert len(differences(before, dump_file())) > 100
    assert restore(bpy.context) > 0
    assert differences_since(before, tidy_dump()) == []
    assert not bake_record.is_baked()


def test_restore_after_save_and_reload_leaves_no_difference(tmp_path: Path) -> None:
    build_zoo(bpy.context)
    path = str(tmp_path / "zoo.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    before = tidy_dump()
    _bake(None)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert bake_record.is_baked()
    restore(bpy.context)
    assert differences(before, tidy_dump()) == []
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert differences(before, tidy_dump()) == []


@pytest.mark.parametrize(
    "scene",
    [
        "godot-tests/test01/boxes.blend",
        "godot-tests/test02/scene.blend",
        "godot-tests/test03/leaks.blend",
        "instancing/01_multiple_collection_instances.blend",
        "instancing/32_gpu_instancing_with_instancing.blend",
    ],
)
def test_restore_leaves_no_difference_in_other_people_s_scenes(shared_scenes: Path, scene: str) -> None:
    open_scene(shared_scenes / scene)
    before = tidy_dump()
    _bake(None)
    assert restore(bpy.context) > 0
    assert differences_since(before, tidy_dump()) == []


def test_restore_of_an_unbaked_file_does_nothing() -> None:
    build_zoo(bpy.context)
    before = tidy_dump()
    assert restore(bpy.context) == 0
    assert differences(before, tidy_dump()) == []


def _cube() -> bpy.types.Object:
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object


def test_copies_that_the_user_made_of_a_baked_object_are_restored_too() -> None:
    cube = _cube()
    original = cube.data
    _bake(None)
    copy = cube.copy()
    copy.data = cube.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    assert restore(bpy.context) == 2
    assert cube.data == original
    assert [mesh.users for mesh in bpy.data.meshes] == [1, 1]
    for mesh in (cube.data, copy.data):
        assert ([layer.name for layer in mesh.uv_layers], list(mesh.materials)) == (["UVMap"], [])


def test_a_mesh_the_user_gave_a_baked_object_since_is_kept() -> None:
    cube = _cube()
    _bake(None)
    cube.data = bpy.data.meshes.new("Mine")
    restore(bpy.context)
    assert cube.data.name == "Mine"


def test_where_the_original_mesh_is_gone_the_copy_stays() -> None:
    cube = _cube()
    original = cube.data
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Other", original))
    _bake(None)
    bpy.data.meshes.remove(original)
    restore(bpy.context)
    assert len(cube.data.polygons) == 6
    assert "Lightmap" not in cube.data.uv_layers
    assert not bake_record.is_baked()
    assert list(bpy.data.images) == []


def test_an_object_in_edit_mode_is_taken_out_of_it() -> None:
    cube = _cube()
    original = cube.data
    _bake(None)
    bpy.ops.object.mode_set(mode="EDIT")
    restore(bpy.context)
    assert (cube.mode, cube.data) == ("OBJECT", original)


def test_baked_objects_linked_from_another_file_are_that_file_s(tmp_path: Path) -> None:
    _cube().name = "Linked"
    _bake(None)
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.objects = ["Linked"]
    bpy.context.scene.collection.objects.link(bpy.data.objects["Linked"])
    assert not bake_record.is_baked()
    assert restore(bpy.context) == 0
    assert "Lightmap" in bpy.data.objects["Linked"].data.uv_layers


def test_the_record_says_nothing_after_baking_and_restoring() -> None:
    """Not even an empty group of properties stays behind on an object."""
    cube = _cube()
    _bake(None)
    assert cube.is_property_set("radiosity_bake")
    restore(bpy.context)
    assert not cube.is_property_set("radiosity_bake")
    assert list(cube.keys()) == []


def test_an_error_after_apply_leaves_images_to_their_maker(tmp_path: Path) -> None:
    """`apply_lightmaps` removes what it made itself, and only that."""
    wanted = BakeSettings()
    cube = _cube()
    export = export_scene(bpy.context, wanted)
    result = hand_result(export)
    images = write_pages(result, wanted, tmp_path)
    cube.data.clear_geometry()
    with pytest.raises(BakeError):
        apply_lightmaps(bpy.context, export, result, images, wanted)
    assert [block.name for block in bake_record.made_datablocks()] == ["lightmap.exr"]
