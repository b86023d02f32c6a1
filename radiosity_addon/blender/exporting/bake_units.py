"""Objects that Cycles evaluates together: each of its bakes reads a scene, so that single ones cost most."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import bpy
import numpy as np

from ..datablocks.bake_record import remove_datablocks
from .export_materials import ExportMaterial
from .export_scene import ExportScene


@contextmanager
def bake_units(made: ExportScene) -> Iterator[list[bpy.types.Object]]:
    """Yield objects that stand for all baked ones; those that were added are removed again.

    Constants and images look the same on any object: what has no other materials is joined.
    """
    by_material = {each.material.name: each for each in made.materials}
    joined: dict[tuple[str, ...], list[bpy.types.Object]] = {}
    units = []
    for obj in made.baked_copies:
        found = [slot.material and by_material.get(slot.material.name) for slot in obj.material_slots]
        if obj.modifiers or not all(_is_plain(each) for each in found):
            units.append(obj)
            continue
        layers = obj.data.uv_layers
        rendered = next(layer.name for layer in layers if layer.active_render)
        joined.setdefault((rendered, *(layer.name for layer in layers)), []).append(obj)
    added = []
    try:
        for objects in joined.values():
            if len(objects) > 1:
                added.append(_joined(made, objects))
            else:
                units.append(objects[0])
        yield [*units, *added]
    finally:
        remove_datablocks([*added, *(obj.data for obj in added)])


def _is_plain(material: ExportMaterial | None) -> bool:
    return material is not None and not material.evaluated


def _joined(made: ExportScene, objects: Sequence[bpy.types.Object]) -> bpy.types.Object:
    """Return one object with the faces, UV layers and materials of some that have the same UV layers.

    Where the faces are does not matter to constants and images. Blender's operator takes 10 ms an object.
    """
    meshes = [obj.data for obj in objects]
    corner, first_corner = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)]), 0
    vertices, starts, slots = [], [], []
    mesh = bpy.data.meshes.new("Radiosity Joined")
    for obj, first_vertex in zip(objects, corner[:-1], strict=True):
        part = obj.data
        for slot in obj.material_slots:
            if slot.material.name not in mesh.materials:
                mesh.materials.append(slot.material)
        names = [slot.material.name for slot in obj.material_slots]
        number = np.array([mesh.materials.find(name) for name in names], dtype=np.int32)
        vertices.append(_values(part.loops, "vertex_index", np.int32) + np.int32(first_vertex))
        starts.append(_values(part.polygons, "loop_start", np.int32) + np.int32(first_corner))
        slots.append(number[np.minimum(_values(part.polygons, "material_index", np.int32), len(number) - 1)])
        first_corner += len(part.loops)
    mesh.vertices.add(int(corner[-1]))
    mesh.loops.add(first_corner)
    mesh.polygons.add(sum(map(len, starts)))
    places = [_values(part.vertices, "co", np.float32, 3) for part in meshes]
    mesh.vertices.foreach_set("co", np.concatenate(places))
    mesh.loops.foreach_set("vertex_index", np.concatenate(vertices))
    mesh.polygons.foreach_set("loop_start", np.concatenate(starts))
    mesh.polygons.foreach_set("material_index", np.concatenate(slots))
    mesh.update(calc_edges=True)
    for layer in meshes[0].uv_layers:
        uv = [_values(part.uv_layers[layer.name].uv, "vector", np.float32, 2) for part in meshes]
        new = mesh.uv_layers.new(name=layer.name, do_init=False)
        new.uv.foreach_set("vector", np.concatenate(uv))
        new.active_render = layer.active_render
    one = bpy.data.objects.new(mesh.name, mesh)
    made.scene.collection.objects.link(one)
    return one


def _values(collection: Any, attribute: str, kind: type, width: int = 1) -> np.ndarray:
    """Return an attribute of all items, one after the other."""
    found: np.ndarray = np.empty(width * len(collection), dtype=kind)
    collection.foreach_get(attribute, found)
    return found


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
