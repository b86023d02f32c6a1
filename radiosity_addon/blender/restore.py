"""Restore: the file as it was before the bake, from what `bake_record` remembers."""

from __future__ import annotations

import bpy

from .bake_record import forget, is_made, recorded_objects, remove_made, unmark_made
from .material_edits import carry_edits


def restore(context: bpy.types.Context) -> int:
    """Bring every baked object of the file back and remove all that the bake made.

    Meshes, UV layers, materials, slots, modifiers and visibility are exactly as they were:
    the originals were never edited, only put aside. Image files on disk are not touched.

    Returns
    -------
    count : int
        How many objects were brought back; 0 means nothing was baked.
    """
    carry_edits()
    objects = recorded_objects()
    leave_edit_modes(context, objects)
    for obj in objects:
        if not show_original(obj):
            unmark_made(obj.data)
    remove_made()
    context.view_layer.update()
    return len(objects)


def leave_edit_modes(context: bpy.types.Context, objects: list[bpy.types.Object]) -> None:
    """Switch objects that are being edited to object mode; their data cannot be swapped in it."""
    for obj in objects:
        if obj.mode != "OBJECT" and context.view_layer.objects.get(obj.name) == obj:
            with context.temp_override(active_object=obj, object=obj, selected_objects=[obj]):
                bpy.ops.object.mode_set(mode="OBJECT")


def show_original(obj: bpy.types.Object) -> bool:
    """Bring one object back and forget that it was baked; what the bake made is left alone.

    Returns False where somebody deleted the original mesh since: the object then keeps the
    copy that the bake made.
    """
    record = obj.radiosity_bake
    found = not record.is_baked or _restore_mesh(obj)
    if record.is_hidden:
        obj.hide_viewport = record.hide_viewport
        obj.hide_render = record.hide_render
    forget(obj)
    return found


def _restore_mesh(obj: bpy.types.Object) -> bool:
    """Give the object its own mesh, slots and modifiers back; False where the mesh is gone."""
    record = obj.radiosity_bake
    for entry in record.modifiers:
        modifier = obj.modifiers.get(entry.name)
        if modifier is not None:
            modifier.show_viewport = entry.show_viewport
            modifier.show_render = entry.show_render
    if record.original_mesh is None:
        return False
    # Somebody may have given the object another mesh since, which is then theirs to keep.
    if is_made(obj.data):
        obj.data = record.original_mesh
    for index in map(int, record.object_slots.split()):
        if index < len(obj.material_slots):
            obj.material_slots[index].link = "OBJECT"
    obj.active_material_index = record.active_material_index
    return True
