"""Objects that Cycles evaluates together: each of its bakes reads a scene, so that single ones cost most."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bpy

from ..datablocks.bake_record import remove_datablocks
from .export_materials import ExportMaterial
from .export_scene import ExportScene


@contextmanager
def bake_units(context: bpy.types.Context, made: ExportScene) -> Iterator[list[bpy.types.Object]]:
    """Yield objects that stand for all baked ones; those that were added are removed again.

    Constants and images look the same on any object: what has no other materials is joined.
    """
    by_material = {each.material.name: each for each in made.materials}
    joined: dict[str, list[bpy.types.Object]] = {}
    units = []
    for obj in made.baked_copies:
        found = [by_material.get(slot.material.name) for slot in obj.material_slots if slot.material]
        if obj.modifiers or not all(_is_plain(each) for each in found):
            units.append(obj)
            continue
        rendered = next(layer.name for layer in obj.data.uv_layers if layer.active_render)
        joined.setdefault(rendered, []).append(obj)
    added = []
    try:
        for objects in joined.values():
            if len(objects) > 1:
                added.append(_joined(context, made, objects))
            else:
                units.append(objects[0])
        yield [*units, *added]
    finally:
        remove_datablocks([*added, *(obj.data for obj in added)])


def _is_plain(material: ExportMaterial | None) -> bool:
    return material is not None and not material.evaluated


def _joined(
    context: bpy.types.Context, made: ExportScene, objects: Sequence[bpy.types.Object]
) -> bpy.types.Object:
    """Return one object with the faces of some, which stay."""
    copies = []
    for obj in objects:
        copy = obj.copy()
        copy.data = obj.data.copy()
        copy.parent = None
        made.scene.collection.objects.link(copy)
        copies.append(copy)
    meshes = [copy.data for copy in copies[1:]]
    first = copies[0]
    with context.temp_override(
        scene=made.scene,
        view_layer=made.scene.view_layers[0],
        object=first,
        active_object=first,
        selected_objects=copies,
        selected_editable_objects=copies,
    ):
        bpy.ops.object.join()
    remove_datablocks(mesh for mesh in meshes if mesh.users == 0)
    return first


@contextmanager
def alone(made: ExportScene, obj: bpy.types.Object) -> Iterator[None]:
    """Hide all other objects of the temporary scene from Cycles."""
    others = [each for each in made.scene.objects if each != obj and not each.hide_render]
    for each in others:
        each.hide_render = True
    try:
        yield
    finally:
        for each in others:
            each.hide_render = False
