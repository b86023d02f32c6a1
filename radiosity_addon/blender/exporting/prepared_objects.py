"""*Prepare for Export*: copies of baked objects that any exporter writes as engines want them.

They have the user's own materials and `Lightmap` as the second UV layer, and stay until they are deleted.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ...base import SceneError
from ..datablocks.bake_record import forget, is_recorded
from ..material_copies.material_slots import is_copy, original_of
from .export_scene import arrange_layers, rendered_objects

COLLECTION = "Lightmap Export"
PREPARED = "radiosity_prepared"
"""Custom property of the collection, by which it is found again."""

SUFFIX = " (Export)"


def prepare(context: bpy.types.Context) -> int:
    """Fill the collection with copies of all objects that show a lightmap; returns how many.

    Raises
    ------
    SceneError
        If nothing shows a lightmap.
    """
    objects = [obj for obj in rendered_objects(context.view_layer) if _is_baked(obj)]
    if not objects:
        raise SceneError("the scene shows no lightmap: bake it first")
    collection = _emptied(context.scene)
    copies = {obj: _copy(obj) for obj in objects}
    for obj, copy in copies.items():
        collection.objects.link(copy)
        world = obj.matrix_world.copy()
        copy.parent = copies.get(obj.parent)
        if copy.parent is not None:
            copy.matrix_parent_inverse = obj.matrix_parent_inverse.copy()
        else:
            copy.matrix_world = world
    return len(copies)


def _is_baked(obj: bpy.types.Object) -> bool:
    return obj.type == "MESH" and any(is_copy(slot.material) for slot in obj.material_slots)


def _emptied(scene: bpy.types.Scene) -> bpy.types.Collection:
    """Return the scene's collection for copies, empty; renders leave it out, so that no bake counts them."""
    found = [child for child in scene.collection.children if child.get(PREPARED) is not None]
    if found:
        meshes = [obj.data for obj in found[0].objects]
        bpy.data.batch_remove([*found[0].objects])
        bpy.data.batch_remove(
            [mesh for mesh in dict.fromkeys(meshes) if mesh is not None and mesh.users == 0]
        )
        return found[0]
    made = bpy.data.collections.new(COLLECTION)
    made[PREPARED] = True
    made.hide_render = True
    scene.collection.children.link(made)
    return made


def _copy(obj: bpy.types.Object) -> bpy.types.Object:
    """Return a copy of an object that nothing of a bake is left on but the UV layer."""
    materials = [original_of(slot.material) for slot in obj.material_slots]
    mesh = obj.data.copy()
    arrange_layers(mesh, obj.name)
    copy = obj.copy()
    copy.name = f"{obj.name}{SUFFIX}"
    copy.data = mesh
    mesh.name = copy.name
    for slot, material in zip(copy.material_slots, materials, strict=True):
        slot.link = "DATA"
        slot.material = material
    if is_recorded(copy):
        forget(copy)
    _forget_marks((copy, mesh))
    return copy


def _forget_marks(blocks: Sequence[bpy.types.ID]) -> None:
    for block in blocks:
        for key in [key for key in block.keys() if key.startswith("radiosity_")]:  # noqa: SIM118 - an ID
            if key != "radiosity_bake":
                del block[key]
