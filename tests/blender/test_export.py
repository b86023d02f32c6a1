"""The export: every triangle once, where a render would show it, and whose corners they are."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import SceneError
from tests.blender.exporting import (
    CUBE,
    CUBE_FACES,
    add_cube,
    export_with,
    objects_by_name,
    signed_volume,
    sphere_nodes,
    triangles_of,
)
from tests.blender.scenes import add_mesh, add_object, shader_material


@pytest.mark.parametrize(
    "transform",
    [
        {},
        {"scale": (2.0, 0.5, 3.0), "rotation_euler": (0.3, 0.5, 0.7), "location": (1, 2, 3)},
        {"scale": (-2.0, 1.0, 1.5), "rotation_euler": (0.3, 0.5, 0.7)},
        {"scale": (-1.0, -1.0, -1.0)},
    ],
    ids=["plain", "uneven", "mirrored", "inverted"],
)
def test_triangles_face_outwards_whatever_the_scale(transform: dict[str, Any]) -> None:
    cube = add_cube(**transform)
    export = export_with()
    scene = export.bake_scene.scene
    centered = scene.triangles - np.array(cube.matrix_world.translation)
    assert len(scene) == 12
    assert signed_volume(centered) == pytest.approx(8 * abs(np.prod(cube.scale)), rel=1e-5)
    np.testing.assert_allclose(scene.normals, np.repeat(scene.face_normals[:, None], 3, axis=1), atol=1e-5)
    assert scene.two_sided.all()


@pytest.mark.parametrize("scale", [(1, 2, 4), (-1, 2, 4)], ids=["uneven", "mirrored"])
def test_smooth_normals_are_those_of_the_scaled_surface(scale: tuple[float, ...]) -> None:
    """A sphere scaled to an ellipsoid, whose gradient is known."""
    sphere = add_mesh("Sphere", scale=scale)
    sphere.modifiers.new("Sphere", "NODES").node_group = sphere_nodes()
    scene = export_with().bake_scene.scene
    gradient = scene.triangles / np.square(scale)
    gradient /= np.linalg.norm(gradient, axis=2, keepdims=True)
    # The shading normals of a faceted sphere are the true ones but for its fineness.
    assert np.einsum("tci,tci->tc", gradient, scene.normals).min() > 0.99
    np.testing.assert_allclose(np.linalg.norm(scene.normals, axis=2), 1, rtol=1e-9)


@pytest.mark.parametrize("mirrored", [False, True])
def test_loops_and_polygons_lead_back_to_the_mesh(mirrored: bool) -> None:
    cube = add_cube(scale=(-1.0 if mirrored else 1.0, 2.0, 1.0))
    export = export_with()
    (obj,) = export.bake_scene.objects
    mesh = cube.data
    world = [cube.matrix_world @ mesh.vertices[loop.vertex_index].co for loop in mesh.loops]
    np.testing.assert_allclose(np.array(world)[obj.loops], export.bake_scene.scene.triangles, atol=1e-6)
    for polygon, loops in zip(obj.polygon, obj.loops, strict=True):
        assert set(loops) <= set(mesh.polygons[polygon].loop_indices)
    assert not export.sources[0].needs_evaluated_mesh


def test_linked_duplicates_are_objects_of_their_own() -> None:
    first = add_cube("First")
    add_object("Second", first.data, None, location=(5, 0, 0))
    export = export_with()
    assert [obj.name for obj in export.bake_scene.objects] == ["First", "Second"]
    assert not any(source.is_instance for source in export.sources)
    np.testing.assert_allclose(
        triangles_of(export, "Second") - triangles_of(export, "First"), np.broadcast_to((5, 0, 0), (12, 3, 3))
    )


def test_edges_points_and_empty_meshes_are_left_out() -> None:
    add_cube()
    add_mesh("Empty", (), ())
    loose = add_mesh("Loose", ((0, 0, 0), (1, 0, 0)), ())
    loose.data.edges.add(1)
    assert [obj.name for obj in export_with().bake_scene.objects] == ["Cube"]


def test_a_mesh_in_edit_mode_is_flushed() -> None:
    import bmesh

    cube = add_cube()
    bpy.context.view_layer.objects.active = cube
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(cube.data)
    bmesh.ops.translate(edited, verts=edited.verts[:], vec=(0, 0, 10))
    export = export_with()
    np.testing.assert_allclose(export.bake_scene.scene.triangles.mean(axis=(0, 1)), (0, 0, 10), atol=1e-6)
    assert cube.mode == "OBJECT"


def test_modifiers_run_as_for_a_render_and_are_put_back() -> None:
    cube = add_cube()
    subdivision = cube.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 2
    only_viewport = cube.modifiers.new("Array", "ARRAY")
    only_viewport.show_render = False
    export = export_with()
    assert len(export.bake_scene.scene) == 6 * 4**2 * 2
    assert export.sources[0].needs_evaluated_mesh
    assert (subdivision.levels, subdivision.render_levels) == (0, 2)
    assert (only_viewport.show_viewport, only_viewport.show_render) == (True, False)


def test_a_deforming_modifier_keeps_the_polygons() -> None:
    box = add_mesh("Box", tuple((x, y, 3 * z) for x, y, z in CUBE), CUBE_FACES)
    cast = box.modifiers.new("Cast", "CAST")
    cast.factor = 1.0
    export = export_with()
    assert not export.sources[0].needs_evaluated_mesh
    corners = export.bake_scene.scene.triangles
    radius = np.linalg.norm(corners, axis=2)
    np.testing.assert_allclose(radius, np.full_like(radius, radius[0, 0]), rtol=1e-5)  # all on one sphere


@pytest.mark.parametrize("kind", ["TRIANGULATE", "SOLIDIFY", "NODES"])
def test_a_modifier_that_may_change_polygons_needs_the_evaluated_mesh(kind: str) -> None:
    cube = add_cube()
    modifier = cube.modifiers.new("Modifier", kind)
    if kind == "NODES":
        modifier.node_group = sphere_nodes()
    assert export_with().sources[0].needs_evaluated_mesh
    modifier.show_render = False
    assert not export_with().sources[0].needs_evaluated_mesh


def test_a_ninth_uv_layer_is_an_error_unless_lightmap_is_there() -> None:
    cube = add_cube("Full")
    for index in range(8):
        cube.data.uv_layers.new(name=f"UV{index}")
    with pytest.raises(SceneError, match=r"'Full'.*UV layers"):
        export_with()
    add_cube("Other")
    assert not objects_by_name(export_with(objects=("Other",)))["Full"].bake
    cube.data.uv_layers[3].name = "Lightmap"
    assert objects_by_name(export_with())["Full"].bake


@pytest.mark.parametrize("mirrored", [False, True])
def test_kept_uvs_go_with_their_corners(mirrored: bool) -> None:
    cube = add_cube(scale=(-1.0 if mirrored else 1.0, 1.0, 1.0))
    cube.data.uv_layers.new(name="UVMap")
    layer = cube.data.uv_layers.new(name="Lightmap")
    uv = np.random.default_rng(0).random((24, 2)).astype(np.float32)
    layer.data.foreach_set("uv", uv.ravel())
    assert export_with().bake_scene.objects[0].uv is None
    (obj,) = export_with(keep_uvs=True).bake_scene.objects
    np.testing.assert_array_equal(obj.uv, uv[obj.loops])
    layer.name = "Other"
    assert export_with(keep_uvs=True).bake_scene.objects[0].uv is None


def test_triangles_tell_which_material_makes_them_emit() -> None:
    """For light groups: materials that emit have a number and a name, others none."""
    for name, strength in (("Dull", None), ("Sign", 2.0), ("Panel", 5.0)):
        cube = add_cube(name, location=(3.0 * len(name), 0, 0))
        inputs = {} if strength is None else {"Strength": strength}
        kind = "ShaderNodeBsdfDiffuse" if strength is None else "ShaderNodeEmission"
        cube.data.materials.append(shader_material(f"{name} paint", kind, **inputs))
    export = export_with()
    scene, emitter = export.bake_scene.scene, export.bake_scene.emitter
    assert emitter is not None
    assert sorted(export.bake_scene.emitter_names) == ["Panel paint", "Sign paint"]
    for name in ("Sign", "Panel"):
        rows = objects_by_name(export)[name].rows
        assert scene.emission[rows].all()
        assert {export.bake_scene.emitter_names[number] for number in emitter[rows]} == {f"{name} paint"}
