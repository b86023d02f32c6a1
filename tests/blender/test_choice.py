"""Which objects are baked, and which scenes cannot be."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import SceneError, UsageError
from radiosity_addon.blender.scene_records.scene_objects import copy_evaluated_meshes
from tests.blender.exporting import (
    CUBE,
    CUBE_FACES,
    TRIANGLE,
    add_cube,
    add_instance,
    check_copy,
    export_with,
)
from tests.blender.scenes import add_lamp, add_mesh


def test_only_the_objects_requested_are_baked_the_rest_blocks() -> None:
    for name in ("A", "B", "C"):
        add_cube(name)
    export = export_with(objects=("C", "A"))
    assert [(obj.name, obj.bake) for obj in export.bake_scene.objects] == [
        ("A", True),
        ("B", False),
        ("C", True),
    ]


def test_an_instancers_name_asks_for_all_it_makes() -> None:
    group = bpy.data.collections.new("Group")
    add_cube("Part", collection=group)
    add_cube("Other", collection=group)
    add_instance(group, "Here")
    add_instance(group, "There")
    export = export_with(objects=("Here",))
    assert {obj.name for obj in export.bake_scene.objects if obj.bake} == {"Here/Part", "Here/Other"}
    export = export_with(objects=("There/Part",))
    assert {obj.name for obj in export.bake_scene.objects if obj.bake} == {"There/Part"}


def test_names_that_cannot_be_baked_say_why() -> None:
    add_cube("Table")
    add_cube("Secret").hide_render = True
    add_mesh("Hollow", (), ())
    add_lamp("POINT", "Bulb", energy=1.0)
    for name, words in (
        ("Tabel", "no object 'Tabel' to bake; did you mean 'Table'"),
        ("Xyz", "no object 'Xyz' to bake"),
        ("Secret", "'Secret' is hidden from render"),
        ("Hollow", "'Hollow' has no faces"),
        ("Bulb", "'Bulb' is not a surface but light"),
    ):
        with pytest.raises(UsageError, match=words):
            export_with(objects=("Table", name))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_coordinates_that_are_no_numbers_are_an_error(value: float) -> None:
    cube = add_cube("Broken")
    cube.data.vertices[3].co.x = value
    with pytest.raises(SceneError, match=r"'Broken'.*NaN"):
        export_with()


def test_a_transform_that_is_no_number_is_an_error() -> None:
    add_cube("Broken").location = (math.nan, 0, 0)
    with pytest.raises(SceneError, match=r"'Broken'.*NaN"):
        export_with()


def test_triangles_without_area_warn() -> None:
    add_mesh("Sliver", (*TRIANGLE, (2, 0, 0)), ((0, 1, 2), (0, 1, 3)))
    export = export_with(sky=True)
    assert len(export.bake_scene.scene) == 2
    (warning,) = export.bake_scene.warnings
    assert warning.name == "Sliver"
    assert "without area" in warning.message


def test_nothing_to_bake_is_an_error() -> None:
    with pytest.raises(SceneError, match=r"'Scene'.*nothing"):
        export_with()
    add_lamp("POINT", energy=1.0)
    with pytest.raises(SceneError, match=r"'Scene'.*nothing"):
        export_with()
    add_cube("Flat", scale=(0, 0, 0))
    with pytest.raises(SceneError, match=r"'Scene'.*nothing"):
        export_with()


def test_no_light_at_all_warns() -> None:
    add_cube()
    (warning,) = export_with().bake_scene.warnings
    assert "no light" in warning.message


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """A file with a cube in a collection."""
    path = tmp_path / "library.blend"
    collection = bpy.data.collections.new("Furniture")
    bpy.context.scene.collection.children.link(collection)
    add_mesh("Chair", CUBE, CUBE_FACES, collection=collection)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return path


def _link(library: Path) -> bpy.types.Collection:
    with bpy.data.libraries.load(str(library), link=True) as (_, into):
        into.collections = ["Furniture"]
    return into.collections[0]


def test_linked_objects_light_and_block_but_cannot_be_baked(library: Path) -> None:
    bpy.context.scene.collection.children.link(_link(library))
    with pytest.raises(SceneError, match=r"'Chair'.*library\.blend"):
        export_with()
    add_cube("Mine")
    export = export_with()
    assert {obj.name: obj.bake for obj in export.bake_scene.objects} == {"Chair": False, "Mine": True}
    assert ("Chair", True) in [(w.name, "linked" in w.message) for w in export.bake_scene.warnings]
    with pytest.raises(SceneError, match=r"'Chair'.*linked"):
        export_with(objects=("Chair",))


def test_a_library_override_is_baked(library: Path) -> None:
    collection = _link(library)
    bpy.context.scene.collection.children.link(collection)
    collection.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    export = export_with()
    assert any(obj.bake for obj in export.bake_scene.objects)


def test_an_instance_of_a_linked_collection_is_baked(library: Path) -> None:
    add_instance(_link(library), "Placed", location=(0, 0, 3))
    export = export_with()
    assert [(obj.name, obj.bake) for obj in export.bake_scene.objects] == [("Placed/Chair", True)]
    assert export.sources[0].library is not None
    mesh = copy_evaluated_meshes(bpy.context, export.sources)["Placed/Chair"]
    assert mesh.library is None
    check_copy(export, export.bake_scene.objects[0], mesh, np.array(export.sources[0].matrix_world))
