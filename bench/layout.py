"""The lightmap UVs that both bakers use."""

from __future__ import annotations

import bmesh
import bpy
import numpy as np

from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.lightmap.unwrap.atlas import AtlasInput, run_atlas
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import LIGHTMAP_UV_LAYER

WELDED = 1e-6
"""Vertices so near each other are one for Smart UV Project [m]."""

CORNER = "original_corner"
"""Attribute of a welded mesh: the corner of the original one."""


def lay_out(resolution: int) -> dict[str, np.ndarray]:
    """Return each object's lightmap UVs by mesh corner, as a bake of the open scene lays them out."""
    export = export_scene(bpy.context, BakeSettings(resolution=resolution))
    bake_scene = export.bake_scene
    baked = [item for item in bake_scene.objects if item.bake]
    inputs = [AtlasInput(item.name, bake_scene.scene.triangles[item.rows], item.polygon) for item in baked]
    layout = {}
    for item, placed in zip(baked, run_atlas(inputs, resolution).objects, strict=True):
        corners = np.zeros((len(bpy.data.objects[item.name].data.loops), 2), dtype=np.float32)
        corners[item.loops] = placed.uv
        layout[item.name] = corners
    return layout


def write_layout(uv: dict[str, np.ndarray]) -> None:
    """Give the scene's meshes this UV layer, and make it the active one."""
    for name, corners in uv.items():
        layers = bpy.data.objects[name].data.uv_layers
        layer = layers.get(LIGHTMAP_UV_LAYER) or layers.new(name=LIGHTMAP_UV_LAYER)
        layer.data.foreach_set("uv", np.ascontiguousarray(corners, dtype=np.float32).ravel())
        layer.active = True


def project_smart(scene: bpy.types.Scene, resolution: int) -> None:
    """Lay out the scene's lightmap UVs anew by Blender's Smart UV Project, with a texel between islands.

    Its islands are of faces that share vertices. Flattened meshes share none: it gets welded copies of
    them. Others stay as they are: of boxes that touch, welded into one, it lays islands over each other.
    """
    layer = bpy.context.view_layer
    objects = objects_with_layout(scene)
    meshes = [obj.data for obj in objects]
    for obj in scene.objects:
        obj.select_set(obj in objects)
    for obj in objects:
        obj.data = obj.data.copy()
        corners = obj.data.attributes.new(CORNER, "INT", "CORNER")
        corners.data.foreach_set("value", np.arange(len(obj.data.loops), dtype=np.int32))
        if len(obj.data.vertices) == len(obj.data.loops):
            _weld(obj.data)
    layer.objects.active = objects[0]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    # Of its margins, the one that fills the most of the page (a third of it in the classroom).
    bpy.ops.uv.smart_project(island_margin=0.5 / resolution, margin_method="ADD")
    bpy.ops.object.mode_set(mode="OBJECT")
    for obj, mesh in zip(objects, meshes, strict=True):
        welded, obj.data = obj.data, mesh
        corner = np.empty(len(welded.loops), dtype=np.int32)
        welded.attributes[CORNER].data.foreach_get("value", corner)
        found = np.empty((len(welded.loops), 2), dtype=np.float32)
        welded.uv_layers[LIGHTMAP_UV_LAYER].data.foreach_get("uv", found.reshape(-1))
        # Faces that welding has removed have no area, and get none on the page.
        uv = np.zeros((len(mesh.loops), 2), dtype=np.float32)
        uv[corner] = found
        mesh.uv_layers[LIGHTMAP_UV_LAYER].data.foreach_set("uv", uv.reshape(-1))
        bpy.data.meshes.remove(welded)


def _weld(mesh: bpy.types.Mesh) -> None:
    """Make vertices in the same place one."""
    welded = bmesh.new()
    welded.from_mesh(mesh)
    bmesh.ops.remove_doubles(welded, verts=welded.verts[:], dist=WELDED)
    welded.to_mesh(mesh)
    welded.free()


def objects_with_layout(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the meshes that are baked."""
    return [obj for obj in scene.objects if obj.type == "MESH" and LIGHTMAP_UV_LAYER in obj.data.uv_layers]
