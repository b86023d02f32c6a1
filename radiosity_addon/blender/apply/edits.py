"""What the user edited on stand-ins since the bake, carried to what they stand for.

Objects with a mesh of their own show their lightmap on that mesh: an edit there is where it belongs. A
stand-in is a copy. An edited copy of a shared mesh takes its original's place; where it cannot, the object
keeps it as a mesh of its own. The result of modifiers cannot be turned back: an edited one is kept as a mesh
of the user's. After that a stand-in holds nothing that is not elsewhere, and may be removed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np
from mathutils import Matrix

from ...base import BakeWarning
from ...scene import LIGHTMAP_UV_LAYER
from ..datablocks.asset_marks import move_marks
from ..datablocks.bake_record import (
    ASIDE,
    LAYER,
    ORIGINAL,
    is_made,
    is_recorded,
    made_datablocks,
    recorded_objects,
)
from ..datablocks.edit_modes import leave_edit_modes
from ..datablocks.uv_layers import LayerRecord, keep_values_of, set_record, take_layer_off
from ..material_copies.material_slots import (
    drop_added_slots,
    link_to_object,
    original_of,
    show_originals,
)
from ..material_edits import material_edits
from ..stand_ins.mesh_digest import digest_of_mesh
from ..stand_ins.stand_in_names import carry_names
from ..stand_ins.stand_ins import (
    EVALUATED,
    INSTANCER,
    OWN,
    STAND_IN,
    StandIn,
    has_edited_slots,
    is_edited,
    is_edited_object,
    moved_place,
    place_again,
    placed,
    record_object,
    record_shapes,
    released_copy,
    set_stand_in,
    source_name,
    stand_in_of,
    stood_for,
)

EDITED = " (edited)"
"""What the name of a mesh or object ends with that was a stand-in and is the user's now."""

OLD_SHAPE = "radiosity_shape"
"""Custom property of stand-in meshes in files of earlier versions: a digest of their vertices."""


def carry_edits(context: bpy.types.Context) -> tuple[BakeWarning, ...]:
    """Carry all edits on what a bake made to the user's own datablocks; returns what to warn of."""
    leave_edit_modes(context, recorded_objects() + _stand_in_objects())
    know_earlier_versions()
    _part_duplicates()
    warnings = [*material_edits.carry_material_edits(), *_carry_places(), *_deleted_stand_ins()]
    users = _objects_by_mesh()
    for mesh in [mesh for mesh in bpy.data.meshes if mesh.library is None and is_made(mesh)]:
        known = stand_in_of(mesh)
        if known is not None and users.get(mesh):
            warnings += _carry(mesh, known, users[mesh])
    warnings += [
        BakeWarning(obj.name, f"'{obj.name}' stands in for an instance and was edited: it is kept")
        for obj in _stand_in_objects()
        if is_edited_object(obj)
    ]
    return tuple(warnings)


def _part_duplicates() -> None:
    """Give stand-in meshes that the user duplicated, along with their objects, an original of their own."""
    for mesh in [mesh for mesh in bpy.data.meshes if mesh.library is None and mesh.users]:
        known, original = stand_in_of(mesh), mesh.get(ORIGINAL)
        if known is None or original is None or known.names.mesh in ("", mesh.name):
            continue
        duplicated = bpy.data.meshes.get((known.names.mesh, None))
        other = stand_in_of(duplicated)
        if other is None or duplicated.get(ORIGINAL) != original or other.names.mesh != duplicated.name:
            continue
        mesh[ORIGINAL] = original.copy()
        set_stand_in(mesh, replace(known, names=replace(known.names, mesh=mesh.name)))


def _carry_places() -> list[BakeWarning]:
    """Move curves and texts to where their stand-ins were moved."""
    warnings = []
    for stand_in in _stand_in_objects():
        place, source = placed(stand_in), _shown_source(stand_in)
        if source is None or place is None or moved_place(stand_in) is None or source.type == "META":
            continue
        source.matrix_world = stand_in.matrix_basis @ Matrix(place).inverted_safe() @ source.matrix_world
        place_again(stand_in)
        warnings.append(
            BakeWarning(source.name, f"object '{source.name}' was moved to where its lightmap was")
        )
    return warnings


def _deleted_stand_ins() -> list[BakeWarning]:
    """Warn of hidden objects whose stand-ins were deleted: they show again."""
    shown = {stand_in.get(INSTANCER) for stand_in in _stand_in_objects()}
    hidden = [obj for obj in recorded_objects() if is_recorded(obj) and obj.radiosity_bake.is_hidden]
    return [
        BakeWarning(
            obj.name, f"only the lightmap of object '{obj.name}' was deleted: delete '{obj.name}' itself"
        )
        for obj in hidden
        if obj not in shown and obj.type != "META"
    ]


def _shown_source(stand_in: bpy.types.Object) -> bpy.types.Object | None:
    """Return the object that a stand-in object stands for, unless that is one of many instances."""
    source = stand_in.get(INSTANCER)
    return source if source is not None and source_name(stand_in) == source.name else None


def know_earlier_versions() -> None:
    """Have stand-ins of files from earlier versions know what stand-ins know now."""
    for obj in recorded_objects():
        mesh = obj.data
        made = isinstance(mesh, bpy.types.Mesh) and is_made(mesh)
        if made and STAND_IN not in mesh and is_recorded(obj) and obj.radiosity_bake.is_baked:
            _know(obj, mesh)
    for stand_in in _stand_in_objects():
        if STAND_IN not in stand_in:
            source = stand_in.name.removeprefix(ASIDE).removesuffix(" (Lightmap)")
            instancer = bpy.data.objects.get((source.split("/")[0], None))
            record_object(stand_in, instancer, source)


def _know(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> None:
    record = obj.radiosity_bake
    original = record.original_mesh
    if LIGHTMAP_UV_LAYER in mesh.uv_layers:
        set_record(mesh, LayerRecord())
        if original is not None and LIGHTMAP_UV_LAYER in original.uv_layers:
            keep_values_of(mesh, original)
    if original is not None:
        mesh[ORIGINAL] = original
    modifiers = tuple((entry.name, entry.show_viewport, entry.show_render) for entry in record.modifiers)
    known = StandIn(
        active_slot=record.active_material_index,
        object_slots=tuple(map(int, record.object_slots.split())),
        modifiers=modifiers,
    )
    known = record_shapes(
        mesh, EVALUATED if modifiers else OWN, [original_of(m) for m in mesh.materials], known
    )
    if modifiers and OLD_SHAPE in mesh and mesh[OLD_SHAPE] != _old_shape(mesh):
        set_stand_in(mesh, replace(known, seal=""))
    elif not modifiers and original is not None:
        # Only the copy was to be seen, so where it differs from the original, it was edited.
        set_stand_in(mesh, replace(known, seal=digest_of_mesh(original)))


def _old_shape(mesh: bpy.types.Mesh) -> str:
    corners = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", corners)
    return hashlib.sha256(corners.tobytes()).hexdigest()


def _carry(mesh: bpy.types.Mesh, known: StandIn, users: Sequence[bpy.types.Object]) -> list[BakeWarning]:
    """Carry the edits of one stand-in mesh."""
    original = mesh.get(ORIGINAL)
    edited, slots = is_edited(mesh, known), has_edited_slots(mesh, known)
    removed = len(mesh.materials) < known.slots
    shown_on = next((obj for obj in users if not is_made(obj)), None)
    if original is not None and shown_on is not None and not carry_names(mesh, original, shown_on):
        edited = True
    known = stand_in_of(mesh) or known
    if original is not None and original.library is None:
        move_marks(original, mesh)
    if slots and not removed and (known.kind == EVALUATED or not edited):
        moved = _move_slots(mesh, known, original, users)
        edited = edited or not moved
        if not edited:
            _seal_again(mesh, known)
    elif slots:
        edited = True
    name = users[0].name
    if known.kind == EVALUATED:
        if original is None and not is_made(users[0]):
            # The object's mesh was deleted: what the modifiers made of it is all there is.
            mesh[ORIGINAL] = released_copy(mesh, users[0].name)
            set_stand_in(mesh, replace(known, modifiers=(), seal=digest_of_mesh(mesh)))
            message = f"the mesh of object '{name}' is missing: the result of its modifiers is kept"
            return [BakeWarning(name, f"{message}; they stay switched off")]
        had_modifiers = original is not None and known.modifiers and not is_made(users[0])
        removed_all = bool(had_modifiers) and not users[0].modifiers
        if removed_all and edited:
            # They were applied: what they made is the object's mesh now.
            applied = mesh[ORIGINAL] = released_copy(mesh, original.name)
            for key in {*original.keys()} - {*applied.keys(), LAYER}:
                applied[key] = original[key]
            set_stand_in(mesh, replace(known, modifiers=(), seal=digest_of_mesh(mesh)))
            message = f"the modifiers of object '{name}' were applied to a mesh that they had made already"
            return [BakeWarning(name, f"{message}: look whether its shape is what you want")]
        if not edited and not removed_all:
            return []
        kept = released_copy(mesh, f"{name}{EDITED}")
        kept.use_fake_user = True
        _seal_again(mesh, replace(known, modifiers=()) if removed_all else known)
        message = f"the baked mesh of object '{name}' was edited, but is generated by modifiers or instances"
        if removed_all:
            message = f"object '{name}' has no modifiers any more"
        return [BakeWarning(name, f"{message}: the baked mesh is kept as '{kept.name}'")]
    if not edited and original is not None:
        return []
    return [_replace_original(mesh, known, original, name)]


def _move_slots(
    mesh: bpy.types.Mesh,
    known: StandIn,
    original: bpy.types.Mesh | None,
    users: Sequence[bpy.types.Object],
) -> bool:
    """Give newly assigned materials to the slots of the original or the object; False if they fit neither."""
    source = _shown_source(users[0]) if is_made(users[0]) else None
    if original is None and source is not None:
        original = source.data  # a curve or a text
    if original is None:
        return False
    whole = known.kind == OWN or known.slots == max(len(original.materials), 1)
    for slot, assigned in enumerate(mesh.materials):
        material, before = original_of(assigned), stood_for(mesh, slot)
        if material == before:
            continue
        there = slot < len(original.materials)
        if there and original.materials[slot] == material:
            continue
        if there and original.library is None and original.materials[slot] == before:
            original.materials[slot] = material
        elif there and all(not is_made(obj) and slot < len(obj.material_slots) for obj in users):
            for obj in users:
                link_to_object(obj, slot)
                obj.material_slots[slot].material = assigned
        elif slot == len(original.materials) and whole and original.library is None:
            original.materials.append(material)
        else:
            return False
    return True


def _replace_original(
    mesh: bpy.types.Mesh, known: StandIn, original: bpy.types.Mesh | None, name: str
) -> BakeWarning:
    """Put an edited copy of a shared mesh in the place of its original, or have its object keep it."""
    fits = original is not None and original.library is None and original.override_library is None
    if (
        original is None
        or not fits
        or known.seal != digest_of_mesh(original)
        or _has_other_slots(original, mesh, known)
    ):
        kept = released_copy(mesh, f"{original.name if original else name}{EDITED}")
        mesh[ORIGINAL] = kept
        _seal_again(mesh, known)
        why = "its original is missing" if original is None else "its original is linked or was changed too"
        message = f"the mesh of object '{name}' was edited and {why}: the object keeps '{kept.name}'"
        return BakeWarning(name, f"{message} as a mesh of its own")
    if LAYER in original:
        # Objects that share it since the bake show it with a lightmap.
        take_layer_off(original)
        show_originals(original)
    name_of_both = original.name
    original.name = f"{name_of_both} (before)"
    edited = released_copy(mesh, name_of_both)
    move_marks(edited, original)
    for slot in known.object_slots:
        if slot < min(len(edited.materials), len(original.materials)):
            edited.materials[slot] = original.materials[slot]
    if not original.materials and known.slots == 1:
        drop_added_slots(edited, 1, ())
    if original.shape_keys is not None and edited.shape_keys is not None:
        _aim_drivers(original.shape_keys, edited.shape_keys)
        name_of_keys = original.shape_keys.name
        original.shape_keys.name = f"{name_of_keys} (before)"
        edited.shape_keys.name = name_of_keys
    original.user_remap(edited)
    if original.users == 0:
        bpy.data.meshes.remove(original)
    _seal_again(mesh, known)
    message = f"mesh '{edited.name}' was edited since the bake: the edit is in all objects that share it"
    return BakeWarning(name, message)


def _has_other_slots(original: bpy.types.Mesh, mesh: bpy.types.Mesh, known: StandIn) -> bool:
    """Whether a mesh holds other materials than when its stand-in was made."""
    present = [original_of(material) for material in original.materials]
    before = [stood_for(mesh, slot) for slot in range(known.slots)]
    if not present and len(before) == 1:
        return False  # objects without slots show one
    pairs = enumerate(zip(present, before, strict=False))
    other = any(one != two for slot, (one, two) in pairs if slot not in known.object_slots)
    return other or len(present) != len(before)


def _aim_drivers(before: bpy.types.Key, now: bpy.types.Key) -> None:
    """Have drivers that read shape keys read others; `user_remap` would give the mesh the other keys too."""
    for user in bpy.data.user_map(subset={before})[before]:
        for owner in (user, getattr(user, "node_tree", None)):
            data = getattr(owner, "animation_data", None)
            for curve in data.drivers if data is not None else ():
                for variable in curve.driver.variables:
                    for target in variable.targets:
                        if target.id == before:
                            target.id = now


def _seal_again(mesh: bpy.types.Mesh, known: StandIn) -> None:
    record_shapes(mesh, known.kind, [original_of(material) for material in mesh.materials], known)


def _objects_by_mesh() -> dict[bpy.types.ID, list[bpy.types.Object]]:
    found: dict[bpy.types.ID, list[bpy.types.Object]] = {}
    for obj in bpy.data.objects:
        if obj.library is None and obj.data is not None and is_made(obj.data):
            found.setdefault(obj.data, []).append(obj)
    return found


def _stand_in_objects() -> list[bpy.types.Object]:
    return [block for block in made_datablocks() if isinstance(block, bpy.types.Object)]
