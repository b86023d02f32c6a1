"""Material slots: lightmap copies in them, and the user's materials back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import bpy
import numpy as np

from ..datablocks.bake_record import ORIGINAL, is_made
from .copy_marks import EMPTY_SLOT

_KINDS_WITH_MATERIALS = ("meshes", "curves", "metaballs", "hair_curves", "pointclouds", "volumes")


def original_of(material: bpy.types.Material | None) -> bpy.types.Material | None:
    """Return the user's material behind a lightmap copy; any other material is the user's itself."""
    return material.get(ORIGINAL) if material is not None and is_made(material) else material


def is_copy(material: bpy.types.Material | None) -> bool:
    """Whether a slot's material is a lightmap copy."""
    return material is not None and is_made(material)


def data_with_copies() -> Iterator[Any]:
    """Yield the file's own data, of any kind, that has a lightmap copy in a slot."""
    for kind in _KINDS_WITH_MATERIALS:
        for data in getattr(bpy.data, kind, ()):
            if data.library is None and any(is_copy(material) for material in data.materials):
                yield data


def own_copies(obj: bpy.types.Object) -> bool:
    """Whether a slot that is linked to the object holds a lightmap copy."""
    return any(slot.link == "OBJECT" and is_copy(slot.material) for slot in obj.material_slots)


def show_originals(data: Any) -> None:
    """Put the user's materials into the slots of a mesh; those that are no copies stay."""
    for index, material in enumerate(data.materials):
        if is_copy(material):
            data.materials[index] = original_of(material)


def empty_slots(obj: bpy.types.Object) -> set[int]:
    """Return which slots are linked to the object and empty, so that the mesh's materials show in them."""
    materials = getattr(obj.data, "materials", ())
    pairs = enumerate(zip(obj.material_slots, materials, strict=False))
    return {
        number for number, (slot, of_mesh) in pairs
        if slot.link == "OBJECT" and slot.material is None and of_mesh is not None
    }  # fmt: skip


def drawn_materials(obj: bpy.types.Object) -> list[bpy.types.Material | None]:
    """Return the material that each slot of an object shows."""
    empty = empty_slots(obj)
    return [
        obj.data.materials[number] if number in empty else slot.material
        for number, slot in enumerate(obj.material_slots)
    ]


def show_own_originals(obj: bpy.types.Object) -> None:
    """The same for the slots that are linked to the object."""
    materials = list(getattr(obj.data, "materials", ()))
    for number, slot in enumerate(obj.material_slots):
        if slot.link != "OBJECT" or not is_copy(slot.material):
            continue
        original = original_of(slot.material)
        of_mesh = original_of(materials[number]) if number < len(materials) else None
        # A slot that was empty stays so, unless an edit there went to a material of its own.
        slot.material = None if EMPTY_SLOT in slot.material and original == of_mesh else original


def link_to_object(obj: bpy.types.Object, slot: int) -> None:
    """Have a slot show the object's material instead of its mesh's."""
    obj.material_slots[slot].link = "OBJECT"
    if obj.override_library is None:
        return
    # A file restores overrides in the order in which they were noted, and a material only after the link.
    noted = obj.override_library.properties
    paths = {f"material_slots[{slot}].material", "active_material"}
    for entry in [entry for entry in noted if entry.rna_path in paths]:
        noted.remove(entry)


def set_materials(mesh: bpy.types.Mesh, materials: Sequence[bpy.types.Material | None]) -> None:
    """Fill the mesh's slots; which slot a polygon uses stays, as it would not if they were cleared."""
    for index, material in enumerate(materials):
        if index >= len(mesh.materials):
            mesh.materials.append(material)
        elif mesh.materials[index] != material:
            mesh.materials[index] = material


def drop_added_slots(mesh: bpy.types.Mesh, added: int, users: Sequence[bpy.types.Object]) -> None:
    """Remove slots that a bake added to a mesh without any, unless somebody uses them by now."""
    if added and len(mesh.materials) == added and not any(mesh.materials):
        drop_slots(mesh, 0, users)


def drop_slots(data: Any, number: int, users: Sequence[bpy.types.Object]) -> None:
    """Remove the slots of a mesh after a number of them; `users` are the objects that show it."""
    if len(data.materials) <= number:
        return
    # Blender lowers the polygons' indices to the slots that are left; theirs may be of slots that never were.
    indices = np.empty(len(data.polygons), dtype=np.int32)
    data.polygons.foreach_get("material_index", indices)
    while len(data.materials) > number:
        data.materials.pop()
    if indices.any():
        data.polygons.foreach_set("material_index", indices)
    for obj in users:
        if obj.data == data:
            obj.data = data  # or the object would go on having a slot
