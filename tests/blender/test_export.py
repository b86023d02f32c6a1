"""The export: every visible triangle, once, where a render would show it, and whose it is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, ClassVar

import bpy
import numpy as np
import pytest

from radiosity_addon.bake_scene import BakeObject
from radiosity_addon.blender.export import export_scene
from radiosity_addon.blender.export_sources import Export
from radiosity_addon.blender.render_state import render_depsgraph
from radiosity_addon.blender.scene_objects import copy_evaluated_meshes, visible_objects
from radiosity_addon.errors import SceneError, UsageError
from radiosity_addon.settings import BakeSettings
from tests.blender.scenes import add_lamp, add_mesh, add_object, shader_material

_TRIANGLE = ((0, 0, 0), (1, 0, 0), (0, 1, 0))
_CUBE = tuple((x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1))
_CUBE_FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def _export(**settings: Any) -> Export:
    return export_scene(bpy.context, BakeSettings(**settings))


def _cube(name: str = "Cube", **transform: Any) -> bpy.types.Object:
    return add_mesh(name, _CUBE, _CUBE_FACES, **transform)


def _by_name(export: Export) -> dict[str, BakeObject]:
    return {obj.name: obj for obj in export.bake_scene.objects}


def _triangles(export: Export, name: str) -> np.ndarray:
    return export.bake_scene.scene.triangles[_by_name(export)[name].rows]


def _volume(triangles: np.ndarray) -> float:
    """Signed volume inside; positive where the triangles face outwards."""
    return float(np.einsum("ti,ti->t", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6)


def _instance(collection: bpy.types.Collection, name: str, **transform: Any) -> bpy.types.Object:
    empty = add_object(name, None, None, **transform)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    return empty


# --- Geometry


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
    cube = _cube(**transform)
    export = _export()
    scene = export.bake_scene.scene
    centred = scene.triangles - np.array(cube.matrix_world.translation)
    assert len(scene) == 12
    assert _volume(centred) == pytest.approx(8 * abs(np.prod(cube.scale)), rel=1e-5)
    np.testing.assert_allclose(scene.normals, np.repeat(scene.face_normals[:, None], 3, axis=1), atol=1e-5)
    assert scene.two_sided.all()


@pytest.mark.parametrize("scale", [(1, 2, 4), (-1, 2, 4)], ids=["uneven", "mirrored"])
def test_smooth_normals_are_those_of_the_scaled_surface(scale: tuple[float, ...]) -> None:
    """A sphere scaled to an ellipsoid, whose gradient is known."""
    sphere = add_mesh("Sphere", scale=scale)
    sphere.modifiers.new("Sphere", "NODES").node_group = _sphere_nodes()
    scene = _export().bake_scene.scene
    gradient = scene.triangles / np.square(scale)
    gradient /= np.linalg.norm(gradient, axis=2, keepdims=True)
    # The shading normals of a faceted sphere are the true ones but for its fineness.
    assert np.einsum("tci,tci->tc", gradient, scene.normals).min() > 0.99
    np.testing.assert_allclose(np.linalg.norm(scene.normals, axis=2), 1, rtol=1e-9)


def _sphere_nodes() -> bpy.types.NodeTree:
    group = bpy.data.node_groups.new("Sphere", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    sphere = group.nodes.new("GeometryNodeMeshIcoSphere")
    sphere.inputs["Subdivisions"].default_value = 4
    smooth = group.nodes.new("GeometryNodeSetShadeSmooth")
    group.links.new(sphere.outputs["Mesh"], smooth.inputs[0])
    group.links.new(smooth.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    return group


@pytest.mark.parametrize("mirrored", [False, True])
def test_loops_and_polygons_lead_back_to_the_mesh(mirrored: bool) -> None:
    cube = _cube(scale=(-1.0 if mirrored else 1.0, 2.0, 1.0))
    export = _export()
    (obj,) = export.bake_scene.objects
    mesh = cube.data
    world = [cube.matrix_world @ mesh.vertices[loop.vertex_index].co for loop in mesh.loops]
    np.testing.assert_allclose(np.array(world)[obj.loops], export.bake_scene.scene.triangles, atol=1e-6)
    for polygon, loops in zip(obj.polygon, obj.loops, strict=True):
        assert set(loops) <= set(mesh.polygons[polygon].loop_indices)
    assert not export.sources[0].needs_evaluated_mesh


def test_linked_duplicates_are_objects_of_their_own() -> None:
    first = _cube("First")
    add_object("Second", first.data, None, location=(5, 0, 0))
    export = _export()
    assert [obj.name for obj in export.bake_scene.objects] == ["First", "Second"]
    assert not any(source.is_instance for source in export.sources)
    np.testing.assert_allclose(
        _triangles(export, "Second") - _triangles(export, "First"), np.broadcast_to((5, 0, 0), (12, 3, 3))
    )


def test_edges_points_and_empty_meshes_are_left_out() -> None:
    _cube()
    add_mesh("Empty", (), ())
    loose = add_mesh("Loose", ((0, 0, 0), (1, 0, 0)), ())
    loose.data.edges.add(1)
    assert [obj.name for obj in _export().bake_scene.objects] == ["Cube"]


def test_a_mesh_in_edit_mode_is_flushed() -> None:
    import bmesh

    cube = _cube()
    bpy.context.view_layer.objects.active = cube
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(cube.data)
    bmesh.ops.translate(edited, verts=edited.verts[:], vec=(0, 0, 10))
    export = _export()
    np.testing.assert_allclose(export.bake_scene.scene.triangles.mean(axis=(0, 1)), (0, 0, 10), atol=1e-6)
    assert cube.mode == "OBJECT"


# --- Modifiers


def test_modifiers_run_as_for_a_render_and_are_put_back() -> None:
    cube = _cube()
    subdivision = cube.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 2
    only_viewport = cube.modifiers.new("Array", "ARRAY")
    only_viewport.show_render = False
    export = _export()
    assert len(export.bake_scene.scene) == 6 * 4**2 * 2
    assert export.sources[0].needs_evaluated_mesh
    assert (subdivision.levels, subdivision.render_levels) == (0, 2)
    assert (only_viewport.show_viewport, only_viewport.show_render) == (True, False)


def test_a_deforming_modifier_keeps_the_polygons() -> None:
    box = add_mesh("Box", tuple((x, y, 3 * z) for x, y, z in _CUBE), _CUBE_FACES)
    cast = box.modifiers.new("Cast", "CAST")
    cast.factor = 1.0
    export = _export()
    assert not export.sources[0].needs_evaluated_mesh
    corners = export.bake_scene.scene.triangles
    radius = np.linalg.norm(corners, axis=2)
    np.testing.assert_allclose(radius, np.full_like(radius, radius[0, 0]), rtol=1e-5)  # all on one sphere


@pytest.mark.parametrize("kind", ["TRIANGULATE", "SOLIDIFY", "NODES"])
def test_a_modifier_that_may_change_polygons_needs_the_evaluated_mesh(kind: str) -> None:
    cube = _cube()
    modifier = cube.modifiers.new("Modifier", kind)
    if kind == "NODES":
        modifier.node_group = _sphere_nodes()
    assert _export().sources[0].needs_evaluated_mesh
    modifier.show_render = False
    assert not _export().sources[0].needs_evaluated_mesh


# --- What is visible


def test_what_a_render_shows_is_exported_and_nothing_else_and_the_scene_is_left_as_it_was() -> None:
    scene, layer = bpy.context.scene, bpy.context.view_layer
    objects = {name: _cube(name) for name in ("Plain", "Monitor", "Eye", "NoRender")}
    objects["Monitor"].hide_viewport = True
    objects["Eye"].hide_set(True)
    objects["NoRender"].hide_render = True
    for name in ("ColMonitor", "ColEye", "ColNoRender", "ColExcluded"):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        objects[f"In{name}"] = _cube(f"In{name}", collection=collection)
    bpy.data.collections["ColMonitor"].hide_viewport = True
    bpy.data.collections["ColNoRender"].hide_render = True
    layer.layer_collection.children["ColEye"].hide_viewport = True
    layer.layer_collection.children["ColExcluded"].exclude = True
    layer.update()
    objects["NoRender"].select_set(True)
    objects["Plain"].select_set(True)
    layer.objects.active = objects["NoRender"]

    def state() -> list:
        return [
            [(o.name, o.hide_viewport, o.hide_render, o.select_get(), o.hide_get()) for o in layer.objects],
            [(c.name, c.hide_viewport, c.hide_render) for c in bpy.data.collections],
            [(c.name, c.hide_viewport, c.exclude) for c in layer.layer_collection.children],
            layer.objects.active.name,
        ]

    before = state()
    export = _export()
    assert sorted(_by_name(export)) == ["Eye", "InColEye", "InColMonitor", "Monitor", "Plain"]
    assert all(obj.bake for obj in export.bake_scene.objects)
    assert state() == before


def test_a_view_layers_material_override_counts() -> None:
    add_mesh("Floor", material=shader_material("Red", "ShaderNodeBsdfDiffuse", Color=(1, 0, 0, 1)))
    override = shader_material("Clay", "ShaderNodeBsdfDiffuse", Color=(0.25, 0.5, 0.75, 1))
    bpy.context.view_layer.material_override = override
    np.testing.assert_allclose(_export().bake_scene.scene.reflectance, [(0.25, 0.5, 0.75)] * 2, rtol=1e-6)


def test_the_scene_is_put_back_when_the_export_fails() -> None:
    _cube("NoRender").hide_render = True
    with pytest.raises(SceneError, match="nothing to bake"):
        _export()
    assert not bpy.data.objects["NoRender"].hide_viewport


class _Listing(bpy.types.RenderEngine):
    """An engine that only notes what Blender hands it to render."""

    bl_idname = "RADIOSITY_TEST_LISTING"
    bl_label = "Listing"
    meshes: ClassVar[list[tuple]] = []

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        assert depsgraph.mode == "RENDER"
        _Listing.meshes = [_listed(instance) for instance in depsgraph.object_instances if _drawn(instance)]


def _drawn(instance: bpy.types.DepsgraphObjectInstance) -> bool:
    return instance.object.type == "MESH" and instance.show_self and len(instance.object.data.polygons) > 0


def _listed(instance: bpy.types.DepsgraphObjectInstance) -> tuple:
    mesh, matrix = instance.object.data, tuple(tuple(row) for row in instance.matrix_world)
    return instance.object.name, instance.is_instance, len(mesh.polygons), len(mesh.vertices), matrix


def test_the_export_sees_what_blender_hands_a_render_engine() -> None:
    """All at once: hiding of every kind, levels, instances, instancers that hide, curves."""
    scene = bpy.context.scene
    _cube("Subdivided").modifiers.new("Subdivision", "SUBSURF").render_levels = 3
    screw = add_mesh("Screw", location=(9, 0, 0)).modifiers.new("Screw", "SCREW")
    screw.steps, screw.render_steps = 3, 7
    for name, attribute in (("ViewportOnly", "hide_render"), ("RenderOnly", "hide_viewport")):
        setattr(_cube(name), attribute, True)
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        _cube(f"In{name}", collection=collection)
        setattr(collection, attribute, True)
    group = bpy.data.collections.new("Group")
    _cube("Shown", collection=group).hide_viewport = True
    _cube("Hidden", collection=group).hide_render = True
    _instance(group, "Instancer", location=(0, 0, 9)).hide_viewport = True
    faces = add_mesh("Faces")
    faces.instance_type, faces.show_instancer_for_render = "FACES", False
    _cube("OnFaces").parent = faces
    add_mesh("Scattered").modifiers.new("Scatter", "NODES").node_group = _scatter_nodes(None)
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.resolution_u, text.render_resolution_u = "O", 2, 6
    add_object("Text", text)
    scene.camera = add_object("Camera", bpy.data.cameras.new("Camera"))

    bpy.utils.register_class(_Listing)
    try:
        scene.render.engine = _Listing.bl_idname
        bpy.ops.render.render()
        scene.render.engine = "CYCLES"
    finally:
        bpy.utils.unregister_class(_Listing)
    with render_depsgraph(bpy.context) as depsgraph:
        seen = [_listed(instance) for instance in visible_objects(depsgraph) if _drawn(instance)]
    assert len(seen) > 10
    assert sorted(seen) == sorted(_Listing.meshes)


@pytest.mark.parametrize("kind", ["CURVE", "FONT", "META", "SURFACE"])
def test_curves_texts_metaballs_and_surfaces_light_and_block_but_get_no_lightmap(kind: str) -> None:
    add_mesh("Floor")
    if kind == "CURVE":
        data = bpy.data.curves.new("Other", "CURVE")
        data.splines.new("POLY").points.add(1)
        data.splines[0].points[1].co = (0, 0, 2, 1)
        data.dimensions, data.bevel_depth = "3D", 0.1
    elif kind == "FONT":
        data = bpy.data.curves.new("Other", "FONT")
        data.body = "A"
    elif kind == "META":
        data = bpy.data.metaballs.new("Other")
        data.elements.new()
    else:
        bpy.ops.surface.primitive_nurbs_surface_sphere_add()
        data = bpy.context.object.data
        bpy.data.objects.remove(bpy.context.object)
    data.materials.append(shader_material("Glow", "ShaderNodeEmission"))
    add_object("Other", data)
    export = _export()
    baked, only_blocks = export.bake_scene.objects
    assert (baked.name, baked.bake) == ("Floor", True)
    assert not only_blocks.bake
    assert only_blocks.count > 0
    np.testing.assert_allclose(export.bake_scene.scene.emission[only_blocks.rows], math.pi, rtol=1e-6)
    assert ("Other", True) in [(w.name, "is not a mesh" in w.message) for w in export.bake_scene.warnings]


def test_what_cannot_be_read_is_named() -> None:
    tufted = _cube("Tufted")
    tufted.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings.type = "HAIR"
    add_object("Fog", bpy.data.volumes.new("Fog"))
    export = _export(sky=True)
    assert {warning.name: warning.message for warning in export.bake_scene.warnings} == {
        "Tufted": "object 'Tufted' is a mesh with hair; that is left out: it neither lights nor blocks",
        "Fog": "object 'Fog' is a volume; that is left out: it neither lights nor blocks",
    }
    assert not export.sources[0].needs_evaluated_mesh


# --- Instances


def test_collection_instances_become_stand_ins_with_their_own_matrices() -> None:
    group = bpy.data.collections.new("Group")
    _cube("Part", collection=group, location=(1, 0, 0))
    _instance(group, "Here", location=(0, 0, 5))
    _instance(group, "There", location=(0, 0, -5), scale=(-2, 2, 2))
    export = _export()
    assert sorted(_by_name(export)) == ["Here/Part", "There/Part"]
    for source in export.sources:
        assert source.is_instance
        assert source.needs_evaluated_mesh
        assert source.object_name == "Part"
        assert source.instancer == source.name.split("/")[0]
    np.testing.assert_allclose(_triangles(export, "Here/Part").mean(axis=(0, 1)), (1, 0, 5), atol=1e-6)
    centre = np.array((-2, 0, -5))
    assert _volume(_triangles(export, "There/Part") - centre) == pytest.approx(8 * 8, rel=1e-6)


def test_instances_share_a_name_only_once() -> None:
    group = bpy.data.collections.new("Group")
    inner = bpy.data.collections.new("Inner")
    _cube("Part", collection=inner)
    for x in (0, 5):
        empty = add_object(f"Nested{x}", None, group, location=(x, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", inner
    _instance(group, "Top")
    names = [obj.name for obj in _export().bake_scene.objects]
    assert names == ["Top/Part", "Top/Part.001"]


def _scatter_nodes(instance: bpy.types.Object | None) -> bpy.types.NodeTree:
    """Keep the mesh, and put a cube (or an object) on each of its points."""
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    entry, leave = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    scatter, join = (
        group.nodes.new("GeometryNodeInstanceOnPoints"),
        group.nodes.new("GeometryNodeJoinGeometry"),
    )
    if instance is None:
        source = group.nodes.new("GeometryNodeMeshCube").outputs[0]
    else:
        info = group.nodes.new("GeometryNodeObjectInfo")
        info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = instance, True
        source = info.outputs["Geometry"]
    group.links.new(entry.outputs[0], scatter.inputs["Points"])
    group.links.new(source, scatter.inputs["Instance"])
    group.links.new(scatter.outputs[0], join.inputs[0])
    group.links.new(entry.outputs[0], join.inputs[0])
    group.links.new(join.outputs[0], leave.inputs[0])
    return group


@pytest.mark.parametrize("of_object", [False, True], ids=["geometry", "object"])
def test_geometry_nodes_instances_are_read_and_copied_as_they_are_drawn(of_object: bool) -> None:
    part = _cube("Part", location=(50, 0, 0)) if of_object else None
    ground = add_mesh("Ground")
    ground.modifiers.new("Scatter", "NODES").node_group = _scatter_nodes(part)
    export = _export()
    stand_ins = [source for source in export.sources if source.is_instance]
    assert [source.instancer for source in stand_ins] == ["Ground"] * 4
    assert len({source.persistent_id for source in stand_ins}) == 4
    ground_source = next(source for source in export.sources if source.name == "Ground")
    assert ground_source.makes_instances
    assert ground_source.needs_evaluated_mesh
    assert _by_name(export)["Ground"].count == 2
    corners = sorted(tuple(np.round(_triangles(export, s.name).mean(axis=(0, 1)), 5)) for s in stand_ins)
    if not of_object:
        np.testing.assert_allclose(corners, [(-1, -1, 0), (-1, 1, 0), (1, -1, 0), (1, 1, 0)], atol=1e-6)
    meshes = copy_evaluated_meshes(bpy.context, export.sources)
    assert len(meshes) == len(export.sources)
    for source, obj in zip(export.sources, export.bake_scene.objects, strict=True):
        _check_copy(export, obj, meshes[source.name], np.array(source.matrix_world))


def _check_copy(export: Export, obj: BakeObject, mesh: bpy.types.Mesh, matrix: np.ndarray) -> None:
    """The copy's corners, put where the source stands, are the exported triangles."""
    corners = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops])
    world = corners @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(world[obj.loops], export.bake_scene.scene.triangles[obj.rows], atol=1e-5)


def test_copied_meshes_are_the_rendered_ones_with_their_materials() -> None:
    red = shader_material("Red", "ShaderNodeBsdfDiffuse")
    blue = shader_material("Blue", "ShaderNodeBsdfDiffuse")
    cube = add_mesh("Cube", _CUBE, _CUBE_FACES, material=red)
    cube.data.materials.append(blue)
    cube.data.polygons.foreach_set("material_index", [1, 0, 1, 0, 1, 0])
    subdivision = cube.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 1
    cube.hide_viewport = True
    export = _export()
    mesh = copy_evaluated_meshes(bpy.context, export.sources)["Cube"]
    assert list(mesh.materials) == [red, blue]
    assert [polygon.material_index for polygon in mesh.polygons] == [
        i for i in (1, 0, 1, 0, 1, 0) for _ in range(4)
    ]
    _check_copy(export, export.bake_scene.objects[0], mesh, np.eye(4))
    assert cube.hide_viewport


def test_face_instances_hide_their_instancer_as_a_render_does() -> None:
    parent = add_mesh("Parent")
    parent.instance_type = "FACES"
    parent.show_instancer_for_render = False
    _cube("Child", scale=(0.1, 0.1, 0.1)).parent = parent
    names = [obj.name for obj in _export().bake_scene.objects]
    assert names == ["Parent/Child"]


# --- Which objects


def test_only_the_objects_asked_for_are_baked_the_rest_blocks() -> None:
    for name in ("A", "B", "C"):
        _cube(name)
    export = _export(objects=("C", "A"))
    assert [(obj.name, obj.bake) for obj in export.bake_scene.objects] == [
        ("A", True),
        ("B", False),
        ("C", True),
    ]


def test_an_instancers_name_asks_for_all_it_makes() -> None:
    group = bpy.data.collections.new("Group")
    _cube("Part", collection=group)
    _cube("Other", collection=group)
    _instance(group, "Here")
    _instance(group, "There")
    export = _export(objects=("Here",))
    assert {obj.name for obj in export.bake_scene.objects if obj.bake} == {"Here/Part", "Here/Other"}
    export = _export(objects=("There/Part",))
    assert {obj.name for obj in export.bake_scene.objects if obj.bake} == {"There/Part"}


def test_names_that_cannot_be_baked_say_why() -> None:
    _cube("Table")
    _cube("Secret").hide_render = True
    add_mesh("Hollow", (), ())
    add_lamp("POINT", "Bulb", energy=1.0)
    for name, words in (
        ("Tabel", "no object 'Tabel' to bake; did you mean 'Table'"),
        ("Xyz", "no object 'Xyz' to bake"),
        ("Secret", "'Secret' is hidden from render"),
        ("Hollow", "'Hollow' has no faces"),
        ("Bulb", "'Bulb' is not a mesh but light"),
    ):
        with pytest.raises(UsageError, match=words):
            _export(objects=("Table", name))


# --- UV layers


def test_a_ninth_uv_layer_is_an_error_unless_lightmap_is_there() -> None:
    cube = _cube("Full")
    for index in range(8):
        cube.data.uv_layers.new(name=f"UV{index}")
    with pytest.raises(SceneError, match=r"object 'Full' already has 8 UV layers"):
        _export()
    _cube("Other")
    assert not _by_name(_export(objects=("Other",)))["Full"].bake
    cube.data.uv_layers[3].name = "Lightmap"
    assert _by_name(_export())["Full"].bake


@pytest.mark.parametrize("mirrored", [False, True])
def test_kept_uvs_go_with_their_corners(mirrored: bool) -> None:
    cube = _cube(scale=(-1.0 if mirrored else 1.0, 1.0, 1.0))
    cube.data.uv_layers.new(name="UVMap")
    layer = cube.data.uv_layers.new(name="Lightmap")
    uv = np.random.default_rng(0).random((24, 2)).astype(np.float32)
    layer.data.foreach_set("uv", uv.ravel())
    assert _export().bake_scene.objects[0].uv is None
    (obj,) = _export(keep_uvs=True).bake_scene.objects
    np.testing.assert_array_equal(obj.uv, uv[obj.loops])
    layer.name = "Other"
    assert _export(keep_uvs=True).bake_scene.objects[0].uv is None


# --- Bad input


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_coordinates_that_are_no_numbers_are_an_error(value: float) -> None:
    cube = _cube("Broken")
    cube.data.vertices[3].co.x = value
    with pytest.raises(SceneError, match=r"object 'Broken' has NaN or infinite coordinates"):
        _export()


def test_a_transform_that_is_no_number_is_an_error() -> None:
    _cube("Broken").location = (math.nan, 0, 0)
    with pytest.raises(SceneError, match=r"object 'Broken' has NaN or infinite coordinates"):
        _export()


def test_triangles_without_area_warn() -> None:
    add_mesh("Sliver", (*_TRIANGLE, (2, 0, 0)), ((0, 1, 2), (0, 1, 3)))
    export = _export(sky=True)
    assert len(export.bake_scene.scene) == 2
    (warning,) = export.bake_scene.warnings
    assert (warning.name, warning.message) == (
        "Sliver",
        "object 'Sliver': a triangle without area; no light falls there",
    )


def test_nothing_to_bake_is_an_error() -> None:
    with pytest.raises(SceneError, match=r"scene 'Scene' has nothing to bake"):
        _export()
    add_lamp("POINT", energy=1.0)
    with pytest.raises(SceneError, match=r"scene 'Scene' has nothing to bake"):
        _export()
    _cube("Flat", scale=(0, 0, 0))
    with pytest.raises(SceneError, match=r"scene 'Scene' has nothing to bake"):
        _export()


def test_no_light_at_all_warns() -> None:
    _cube()
    (warning,) = _export().bake_scene.warnings
    assert "no light at all" in warning.message


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """A file with a cube in a collection."""
    path = tmp_path / "library.blend"
    collection = bpy.data.collections.new("Furniture")
    bpy.context.scene.collection.children.link(collection)
    add_mesh("Chair", _CUBE, _CUBE_FACES, collection=collection)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return path


def _link(library: Path) -> bpy.types.Collection:
    with bpy.data.libraries.load(str(library), link=True) as (_, into):
        into.collections = ["Furniture"]
    return into.collections[0]


def test_linked_objects_light_and_block_but_cannot_be_baked(library: Path) -> None:
    bpy.context.scene.collection.children.link(_link(library))
    with pytest.raises(SceneError, match=r"object 'Chair' is linked from .*library\.blend"):
        _export()
    _cube("Mine")
    export = _export()
    assert {obj.name: obj.bake for obj in export.bake_scene.objects} == {"Chair": False, "Mine": True}
    assert ("Chair", True) in [
        (w.name, "linked from a library" in w.message) for w in export.bake_scene.warnings
    ]
    with pytest.raises(SceneError, match=r"object 'Chair' is linked"):
        _export(objects=("Chair",))


def test_a_library_override_is_baked(library: Path) -> None:
    collection = _link(library)
    bpy.context.scene.collection.children.link(collection)
    collection.override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    export = _export()
    assert any(obj.bake for obj in export.bake_scene.objects)


def test_an_instance_of_a_linked_collection_is_baked(library: Path) -> None:
    _instance(_link(library), "Placed", location=(0, 0, 3))
    export = _export()
    assert [(obj.name, obj.bake) for obj in export.bake_scene.objects] == [("Placed/Chair", True)]
    assert export.sources[0].library is not None
    mesh = copy_evaluated_meshes(bpy.context, export.sources)["Placed/Chair"]
    assert mesh.library is None
    _check_copy(export, export.bake_scene.objects[0], mesh, np.array(export.sources[0].matrix_world))


# --- Real scenes


@pytest.mark.parametrize(
    ("path", "triangles", "objects"),
    [
        ("instancing/01_multiple_collection_instances.blend", 36, 3),
        ("instancing/32_gpu_instancing_with_instancing.blend", 1702, 13),
    ],
)
def test_shared_instancing_scenes(shared_scenes: Path, path: str, triangles: int, objects: int) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(shared_scenes / path), load_ui=False)
    export = _export()
    assert len(export.bake_scene.scene) == triangles
    assert len(export.sources) == objects
    assert [source.name for source in export.sources] == [obj.name for obj in export.bake_scene.objects]
    assert len(set(_by_name(export))) == objects
