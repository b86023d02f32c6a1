"""What the evaluated scene holds: meshes, instances of meshes, and lamps, one by one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import bpy
import numpy as np

from ..datablocks.bake_record import ORIGINAL
from ..datablocks.mesh_arrays import same_polygons
from .export_sources import ExportSource
from .render_state import render_depsgraph

_NO_ID = 2**31 - 1  # fills the unused end of a persistent id

_UNKNOWN_TYPES = {
    "VOLUME": "a volume",
    "CURVES": "hair",
    "POINTCLOUD": "a point cloud",
    "GPENCIL": "a grease pencil",
    "GREASEPENCIL": "a grease pencil",
}

_KEEPS_POLYGONS = frozenset(
    {
        "ARMATURE",
        "CAST",
        "CLOTH",
        "COLLISION",
        "CORRECTIVE_SMOOTH",
        "CURVE",
        "DATA_TRANSFER",
        "DISPLACE",
        "HOOK",
        "LAPLACIANDEFORM",
        "LAPLACIANSMOOTH",
        "LATTICE",
        "MESH_CACHE",
        "MESH_DEFORM",
        "NORMAL_EDIT",
        "PARTICLE_SYSTEM",
        "SHRINKWRAP",
        "SIMPLE_DEFORM",
        "SMOOTH",
        "SOFT_BODY",
        "SURFACE",
        "SURFACE_DEFORM",
        "UV_PROJECT",
        "UV_WARP",
        "VERTEX_WEIGHT_EDIT",
        "VERTEX_WEIGHT_MIX",
        "VERTEX_WEIGHT_PROXIMITY",
        "WARP",
        "WAVE",
        "WEIGHTED_NORMAL",
    }
)
"""Modifiers that move or mark what is there. Geometry nodes are not among them: they may
set materials and drop UV layers even where the polygons stay."""


def visible_objects(depsgraph: bpy.types.Depsgraph) -> Iterator[bpy.types.DepsgraphObjectInstance]:
    """Iterate over the meshes and lamps of an evaluated scene, instances among them.

    Curves, texts, surfaces and metaballs come as instances of the mesh they evaluate to.
    """
    for instance in depsgraph.object_instances:
        if not instance.show_self or instance.object.type not in ("MESH", "LIGHT"):
            continue
        if not instance.is_instance and _shown_by_parent(instance.object):
            continue
        yield instance


def unknown_objects(depsgraph: bpy.types.Depsgraph) -> dict[str, str]:
    """Return what a render would show and we leave out: object names, and what each is."""
    unknown = {}
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type in _UNKNOWN_TYPES and instance.show_self:
            unknown[obj.name] = _UNKNOWN_TYPES[obj.type]
        for particles in obj.particle_systems if obj.type == "MESH" else ():
            if particles.settings.type == "HAIR" and particles.settings.render_type == "PATH":
                unknown[obj.name] = "a mesh with hair"
    return unknown


def _shown_by_parent(obj: bpy.types.Object) -> bool:
    """Return whether an object appears on its parent's vertices or faces, and so not by itself.

    Renders leave it out then; the viewport's graph does not.
    """
    return obj.parent is not None and obj.parent.instance_type in ("VERTS", "FACES")


def original_object(instance: bpy.types.DepsgraphObjectInstance) -> bpy.types.Object:
    """Return the object in the file that an evaluated one, or an instance, shows."""
    shown = instance.instance_object if instance.is_instance else instance.object
    return shown.original


def is_generated(instance: bpy.types.DepsgraphObjectInstance) -> bool:
    """Return whether an instance shows geometry of its own: made by nodes, or a curve's mesh.

    Blender hands these out under the object that made them, whose evaluated mesh they are
    not: only `object.data` is right then (and `to_mesh` crashes Blender 4.2).
    """
    if not instance.is_instance:
        return False
    return instance.object.data.as_pointer() != instance.instance_object.data.as_pointer()


def matrix_of(instance: bpy.types.DepsgraphObjectInstance) -> np.ndarray:
    """Return the instance's world matrix, (4, 4) float64."""
    return np.array(instance.matrix_world, dtype=np.float64)


def materials_of(instance: bpy.types.DepsgraphObjectInstance) -> list[bpy.types.Material | None]:
    """Return the evaluated material of every slot, the object's own before the mesh's."""
    obj = instance.object
    own = list(obj.data.materials)
    slots = obj.material_slots
    for index, slot in enumerate(slots):
        if index >= len(own):
            own.append(slot.material)
        elif slot.link == "OBJECT":
            own[index] = slot.material
    return [_read_material(material) for material in own]


def _read_material(material: bpy.types.Material | None) -> bpy.types.Material | None:
    """Return the original of a copy that shows a lightmap: copies in linked files cannot be taken off."""
    original = None if material is None or material.library is None else material.get(ORIGINAL)
    return material if original is None else original


def source_of(instance: bpy.types.DepsgraphObjectInstance, name: str, makes_instances: bool) -> ExportSource:
    """Return the record by which what was exported is found again."""
    object_name, library, instancer, persistent_id = identity_of(instance)
    if instance.is_instance:
        # Without a look at polygons: there may be thousands.
        modifiers = original_object(instance).modifiers
        is_modified = is_generated(instance) or any(modifier.show_render for modifier in modifiers)
    else:
        is_modified = _modifiers_change_polygons(instance.object)
    return ExportSource(
        name=name,
        object_name=object_name,
        library=library,
        is_instance=instance.is_instance,
        instancer=instancer,
        persistent_id=persistent_id,
        matrix_world=tuple(tuple(float(value) for value in row) for row in instance.matrix_world),
        needs_evaluated_mesh=instance.is_instance or makes_instances or is_modified,
        makes_instances=makes_instances,
        is_modified=is_modified,
    )


def copy_evaluated_meshes(
    context: bpy.types.Context, sources: Sequence[ExportSource]
) -> dict[str, bpy.types.Mesh]:
    """Make a mesh in the file of what each source was exported as.

    context: Of the scene as it was when it was exported.
    Returns by `ExportSource.name`: polygons and loops in the exported order, all layers, and the materials it
        is drawn with. Nothing uses them yet.
    """
    wanted = {
        (source.object_name, source.library, source.instancer, source.persistent_id): source.name
        for source in sources
    }
    meshes: dict[str, bpy.types.Mesh] = {}
    with render_depsgraph(context) as depsgraph:
        for instance in visible_objects(depsgraph):
            if instance.object.type != "MESH" or not wanted:
                continue
            name = wanted.pop(identity_of(instance), None)
            if name is not None:
                meshes[name] = _copy_mesh(instance, depsgraph)
    return meshes


def identity_of(instance: bpy.types.DepsgraphObjectInstance) -> tuple[str, str | None, str, tuple[int, ...]]:
    """Return what identifies an instance: object, library, instancer, persistent id."""
    shown = original_object(instance)
    library = shown.library.filepath if shown.library else None
    instancer = instance.parent.original.name if instance.is_instance else ""
    return shown.name, library, instancer, _persistent_id(instance)


def _copy_mesh(instance: bpy.types.DepsgraphObjectInstance, depsgraph: bpy.types.Depsgraph) -> bpy.types.Mesh:
    if is_generated(instance):
        mesh = instance.object.data.copy()
    else:
        mesh = bpy.data.meshes.new_from_object(
            instance.object, preserve_all_data_layers=True, depsgraph=depsgraph
        )
    materials = [material and material.original for material in materials_of(instance)]
    # In place: clearing the slots would move every polygon to the first.
    for index, material in enumerate(materials):
        if index < len(mesh.materials):
            mesh.materials[index] = material
        else:
            mesh.materials.append(material)
    return mesh


def _persistent_id(instance: bpy.types.DepsgraphObjectInstance) -> tuple[int, ...]:
    if not instance.is_instance:
        return ()
    ids = [int(value) for value in instance.persistent_id]
    while ids and ids[-1] == _NO_ID:
        ids.pop()
    return tuple(ids)


def _modifiers_change_polygons(obj: bpy.types.Object) -> bool:
    modifiers = [modifier.type for modifier in obj.original.modifiers if modifier.show_render]
    if not modifiers:
        return False
    if not _KEEPS_POLYGONS.issuperset(modifiers):
        return True
    return not same_polygons(obj.original.data, obj.data)
