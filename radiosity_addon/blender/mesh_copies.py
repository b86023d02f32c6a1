"""Copies of the meshes behind an export's sources, with the corners the export counted."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ..errors import BakeError
from .bake_record import mark_made
from .export_sources import ExportSource
from .scene_objects import copy_evaluated_meshes


def copy_meshes(context: bpy.types.Context, sources: Sequence[ExportSource]) -> list[bpy.types.Mesh]:
    """Copy the mesh of every source; the copies have no users yet.

    Returns
    -------
    meshes : list of Mesh
        Parallel to `sources`. Their slots hold the materials that are drawn, those linked
        to the object among them.

    Raises
    ------
    BakeError
        If a source is no longer in the scene.
    """
    evaluated = copy_evaluated_meshes(context, [source for source in sources if source.needs_evaluated_mesh])
    for mesh in evaluated.values():
        mark_made(mesh)
    return [evaluated.get(source.name) or _copy_own_mesh(source) for source in sources]


def set_materials(mesh: bpy.types.Mesh, materials: Sequence[bpy.types.Material | None]) -> None:
    """Fill the mesh's slots; which slot a polygon uses stays, as it would not if they were cleared."""
    for index, material in enumerate(materials):
        if index < len(mesh.materials):
            mesh.materials[index] = material
        else:
            mesh.materials.append(material)


def _copy_own_mesh(source: ExportSource) -> bpy.types.Mesh:
    """Copy the mesh of a source whose modifiers leave its polygons alone."""
    obj = None if source.needs_evaluated_mesh else bpy.data.objects.get((source.object_name, source.library))
    if obj is None or obj.type != "MESH":
        raise BakeError(f"object '{source.name}' went away while it was being baked: bake again")
    mesh = obj.data.copy()
    mark_made(mesh)
    set_materials(mesh, [slot.material for slot in obj.material_slots])
    return mesh
