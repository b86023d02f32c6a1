"""What the tests of the export share: cubes, instances, node groups, and looks at the result."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.blender.scene_records.export_sources import Export
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeObject
from tests.blender.scenes import add_mesh, add_object

TRIANGLE = ((0, 0, 0), (1, 0, 0), (0, 1, 0))
CUBE = tuple((x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1))
CUBE_FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def export_with(**settings: Any) -> Export:
    return export_scene(bpy.context, BakeSettings(**settings))


def add_cube(name: str = "Cube", **transform: Any) -> bpy.types.Object:
    return add_mesh(name, CUBE, CUBE_FACES, **transform)


def objects_by_name(export: Export) -> dict[str, BakeObject]:
    return {obj.name: obj for obj in export.bake_scene.objects}


def triangles_of(export: Export, name: str) -> np.ndarray:
    return export.bake_scene.scene.triangles[objects_by_name(export)[name].rows]


def signed_volume(triangles: np.ndarray) -> float:
    """Signed volume inside; positive where the triangles face outwards."""
    return float(np.einsum("ti,ti->t", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6)


def add_instance(collection: bpy.types.Collection, name: str, **transform: Any) -> bpy.types.Object:
    empty = add_object(name, None, None, **transform)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    return empty


def sphere_nodes() -> bpy.types.NodeTree:
    group = bpy.data.node_groups.new("Sphere", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    sphere = group.nodes.new("GeometryNodeMeshIcoSphere")
    sphere.inputs["Subdivisions"].default_value = 4
    smooth = group.nodes.new("GeometryNodeSetShadeSmooth")
    group.links.new(sphere.outputs["Mesh"], smooth.inputs[0])
    group.links.new(smooth.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    return group


def scatter_nodes(instance: bpy.types.Object | None) -> bpy.types.NodeTree:
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


def check_copy(export: Export, obj: BakeObject, mesh: bpy.types.Mesh, matrix: np.ndarray) -> None:
    """The copy's corners, put where the source stands, are the exported triangles."""
    corners = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops])
    world = corners @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(world[obj.loops], export.bake_scene.scene.triangles[obj.rows], atol=1e-5)
