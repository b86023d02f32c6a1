"""Instances become stand-ins that can be found, and copied, again."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.scene_records.scene_objects import copy_evaluated_meshes
from tests.blender.exporting import (
    CUBE,
    CUBE_FACES,
    add_cube,
    add_instance,
    check_copy,
    export_with,
    objects_by_name,
    scatter_nodes,
    signed_volume,
    triangles_of,
)
from tests.blender.scenes import add_mesh, add_object, shader_material


def test_collection_instances_become_stand_ins_with_their_own_matrices() -> None:
    group = bpy.data.collections.new("Group")
    add_cube("Part", collection=group, location=(1, 0, 0))
    add_instance(group, "Here", location=(0, 0, 5))
    add_instance(group, "There", location=(0, 0, -5), scale=(-2, 2, 2))
    export = export_with()
    assert sorted(objects_by_name(export)) == ["Here/Part", "There/Part"]
    for source in export.sources:
        assert source.is_instance
        assert source.needs_evaluated_mesh
        assert source.object_name == "Part"
        assert source.instancer == source.name.split("/")[0]
    np.testing.assert_allclose(triangles_of(export, "Here/Part").mean(axis=(0, 1)), (1, 0, 5), atol=1e-6)
    center = np.array((-2, 0, -5))
    assert signed_volume(triangles_of(export, "There/Part") - center) == pytest.approx(8 * 8, rel=1e-6)


def test_instances_share_a_name_only_once() -> None:
    group = bpy.data.collections.new("Group")
    inner = bpy.data.collections.new("Inner")
    add_cube("Part", collection=inner)
    for x in (0, 5):
        empty = add_object(f"Nested{x}", None, group, location=(x, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", inner
    add_instance(group, "Top")
    names = [obj.name for obj in export_with().bake_scene.objects]
    assert names == ["Top/Part", "Top/Part.001"]


@pytest.mark.parametrize("of_object", [False, True], ids=["geometry", "object"])
def test_geometry_nodes_instances_are_read_and_copied_as_they_are_drawn(of_object: bool) -> None:
    part = add_cube("Part", location=(50, 0, 0)) if of_object else None
    ground = add_mesh("Ground")
    ground.modifiers.new("Scatter", "NODES").node_group = scatter_nodes(part)
    export = export_with()
    stand_ins = [source for source in export.sources if source.is_instance]
    assert [source.instancer for source in stand_ins] == ["Ground"] * 4
    assert len({source.persistent_id for source in stand_ins}) == 4
    ground_source = next(source for source in export.sources if source.name == "Ground")
    assert ground_source.makes_instances
    assert ground_source.needs_evaluated_mesh
    assert objects_by_name(export)["Ground"].count == 2
    corners = sorted(tuple(np.round(triangles_of(export, s.name).mean(axis=(0, 1)), 5)) for s in stand_ins)
    if not of_object:
        np.testing.assert_allclose(corners, [(-1, -1, 0), (-1, 1, 0), (1, -1, 0), (1, 1, 0)], atol=1e-6)
    meshes = copy_evaluated_meshes(bpy.context, export.sources)
    assert len(meshes) == len(export.sources)
    for source, obj in zip(export.sources, export.bake_scene.objects, strict=True):
        check_copy(export, obj, meshes[source.name], np.array(source.matrix_world))


def test_copied_meshes_are_the_rendered_ones_with_their_materials() -> None:
    red = shader_material("Red", "ShaderNodeBsdfDiffuse")
    blue = shader_material("Blue", "ShaderNodeBsdfDiffuse")
    cube = add_mesh("Cube", CUBE, CUBE_FACES, material=red)
    cube.data.materials.append(blue)
    cube.data.polygons.foreach_set("material_index", [1, 0, 1, 0, 1, 0])
    subdivision = cube.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 1
    cube.hide_viewport = True
    export = export_with()
    mesh = copy_evaluated_meshes(bpy.context, export.sources)["Cube"]
    assert list(mesh.materials) == [red, blue]
    assert [polygon.material_index for polygon in mesh.polygons] == [
        i for i in (1, 0, 1, 0, 1, 0) for _ in range(4)
    ]
    check_copy(export, export.bake_scene.objects[0], mesh, np.eye(4))
    assert cube.hide_viewport


def test_face_instances_hide_their_instancer_as_a_render_does() -> None:
    parent = add_mesh("Parent")
    parent.instance_type = "FACES"
    parent.show_instancer_for_render = False
    add_cube("Child", scale=(0.1, 0.1, 0.1)).parent = parent
    names = [obj.name for obj in export_with().bake_scene.objects]
    assert names == ["Parent/Child"]


@pytest.mark.parametrize(
    ("path", "triangles", "objects"),
    [
        ("instancing/01_multiple_collection_instances.blend", 36, 3),
        ("instancing/32_gpu_instancing_with_instancing.blend", 1702, 13),
    ],
)
def test_shared_instancing_scenes(shared_scenes: Path, path: str, triangles: int, objects: int) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(shared_scenes / path), load_ui=False)
    export = export_with()
    assert len(export.bake_scene.scene) == triangles
    assert len(export.sources) == objects
    assert [source.name for source in export.sources] == [obj.name for obj in export.bake_scene.objects]
    assert len(set(objects_by_name(export))) == objects
