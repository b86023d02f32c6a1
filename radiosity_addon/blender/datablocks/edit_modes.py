"""Take objects out of Edit Mode and other modes, in any scene."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...base import BakeError


def leave_edit_modes(context: bpy.types.Context, objects: Iterable[bpy.types.Object]) -> None:
    """Switch objects that are being edited to object mode; their data cannot be swapped in it.

    Raises BakeError if one cannot be switched.
    """
    for obj in objects:
        if obj.mode != "OBJECT":
            leave_edit_mode_of(context, obj)
        if obj.mode != "OBJECT":
            raise BakeError(f"object '{obj.name}' is being edited: switch it to Object Mode first")


def leave_edit_mode_of(context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """Switch one object to object mode."""
    here = [(context.scene, context.view_layer)]
    layers = [*here, *((scene, layer) for scene in obj.users_scene for layer in scene.view_layers)]
    for scene, layer in layers:
        if obj.mode == "OBJECT":
            return
        if layer.objects.get(obj.name) != obj:
            continue
        place = {"scene": scene, "view_layer": layer, "active_object": obj, "object": obj}
        with context.temp_override(**place, selected_objects=[obj]):
            if bpy.ops.object.mode_set.poll():
                bpy.ops.object.mode_set(mode="OBJECT")
