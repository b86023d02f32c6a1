"""Stand-ins: meshes, and objects, that show a lightmap where the user's own cannot.

A stand-in mesh is a copy of a mesh that several objects share, or what modifiers make of one. It knows the
mesh it stands for (`radiosity_original`), the materials its slots stand for, and how the object was.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace

import bpy

from ..datablocks.bake_record import ASIDE, LAYER, MADE_MARKER, ORIGINAL, is_made, is_recorded, unmark_made
from ..datablocks.uv_layers import take_layer_off
from ..material_copies.material_slots import original_of, show_originals
from .mesh_digest import digest_of_mesh

STAND_IN = "radiosity_stand_in"
"""Custom property of a stand-in mesh: what is known of it; of a stand-in object: how it was placed."""

SLOTS = "radiosity_slots"
"""Custom property of a stand-in mesh: the materials its slots stand for, by their number."""

INSTANCER = "radiosity_instancer"
"""Custom property of a stand-in object: the object that makes the instance."""

OWN, EVALUATED = "own", "evaluated"
"""Kinds of stand-in meshes: a copy of the original, or what modifiers or instances make of it."""


@dataclass(frozen=True)
class Names:
    """What a stand-in mesh was called and called things when it was shown.

    mesh, shape_keys: Names of the datablocks; "" for none.
    groups tuple of (str, bool): Vertex groups and whether they were locked.
    roles (str, str): The user's UV layers that were active and for renders.
    """

    mesh: str = ""
    shape_keys: str = ""
    groups: tuple[tuple[str, bool], ...] = ()
    roles: tuple[str, str] = ("", "")


@dataclass(frozen=True)
class StandIn:
    """What a stand-in mesh knows.

    kind: `OWN` or `EVALUATED`.
    seal: The digest it was made with.
    slots: How many material slots it was made with.
    active_slot: The object's active material slot.
    object_slots: Slots that were linked to the object before (in files of earlier versions).
    modifiers tuple of (str, bool, bool): Those that were switched off: their names, and whether they showed
        in viewports and renders.
    """

    kind: str = EVALUATED
    seal: str = ""
    slots: int = 0
    active_slot: int = 0
    object_slots: tuple[int, ...] = ()
    modifiers: tuple[tuple[str, bool, bool], ...] = field(default_factory=tuple)
    names: Names = Names()


def stand_in_of(mesh: bpy.types.ID | None) -> StandIn | None:
    """Return what a stand-in mesh knows; None for any other mesh."""
    if mesh is None or STAND_IN not in mesh or not is_made(mesh):
        return None
    try:
        stored = json.loads(mesh[STAND_IN])
        stored["modifiers"] = tuple((str(name), bool(v), bool(r)) for name, v, r in stored["modifiers"])
        stored["object_slots"] = tuple(stored["object_slots"])
        names = stored.pop("names", {})
        if names:
            groups = tuple((str(name), bool(lock)) for name, lock in names.pop("groups"))
            stored["names"] = Names(**{**names, "groups": groups, "roles": tuple(names["roles"])})
        return StandIn(**stored)
    except (ValueError, TypeError, KeyError):
        return StandIn()


def set_stand_in(mesh: bpy.types.Mesh, known: StandIn) -> None:
    """Have a stand-in mesh know this."""
    mesh[STAND_IN] = json.dumps(asdict(known))


def record_shapes(
    mesh: bpy.types.Mesh,
    kind: str,
    stands_for: Sequence[bpy.types.Material | None],
    known: StandIn,
) -> StandIn:
    """Remember what a stand-in mesh is like, to notice edits; `stands_for` are the materials of its slots."""
    known = replace(known, kind=kind, seal=digest_of_mesh(mesh), slots=len(mesh.materials))
    set_stand_in(mesh, known)
    mesh[SLOTS] = {str(slot): material for slot, material in enumerate(stands_for) if material is not None}
    return known


def stood_for(mesh: bpy.types.Mesh, slot: int) -> bpy.types.Material | None:
    """Return the material that a stand-in's slot stands for."""
    known = mesh.get(SLOTS)
    return None if known is None else known.get(str(slot))


def has_edited_slots(mesh: bpy.types.Mesh, known: StandIn) -> bool:
    """Whether the user has assigned other materials to a stand-in, added slots or removed some.

    Another lightmap copy is another material too: the user picked it, or made a new one of it.
    """
    slots = enumerate(mesh.materials)
    other = any(original_of(material) != stood_for(mesh, slot) for slot, material in slots)
    return other or len(mesh.materials) != known.slots


def is_edited(mesh: bpy.types.Mesh, known: StandIn) -> bool:
    """Whether a stand-in's geometry or layers are not as the bake made them."""
    return known.seal != digest_of_mesh(mesh)


def own_mesh(obj: bpy.types.Object) -> bpy.types.ID | None:
    """Return the user's mesh of an object, also where another stands in for it."""
    data = obj.data
    if data is not None and is_made(data):
        return data.get(ORIGINAL) or (obj.radiosity_bake.original_mesh if is_recorded(obj) else None)
    return data


def release(mesh: bpy.types.Mesh) -> None:
    """Make a stand-in mesh the user's: without our layer, with the user's materials, unmarked."""
    take_layer_off(mesh)
    show_originals(mesh)
    for key in (MADE_MARKER, ORIGINAL, STAND_IN, SLOTS, LAYER, "radiosity_shape"):
        if key in mesh:
            del mesh[key]


def released_copy(mesh: bpy.types.Mesh, name: str) -> bpy.types.Mesh:
    """Return a copy of a stand-in mesh as the user's own."""
    copy = mesh.copy()
    release(copy)
    copy.name = name
    return copy


def record_object(obj: bpy.types.Object, instancer: bpy.types.Object | None, source: str) -> None:
    """Remember how a stand-in object was made, of which source, and whose instance it stands for."""
    if instancer is not None:
        obj[INSTANCER] = instancer
    obj[STAND_IN] = json.dumps({"place": _place(obj), "state": _state(obj), "source": source})


def source_name(obj: bpy.types.Object) -> str:
    """Return the name by which a bake knows an object: for a stand-in, that of the instance."""
    return str(_stored(obj).get("source", obj.name)) if is_made(obj) else obj.name


def placed(obj: bpy.types.Object) -> list[list[float]] | None:
    """Return the rows of the transform a stand-in object was made with."""
    place = _stored(obj).get("place")
    return None if place is None else [place[row : row + 4] for row in range(0, 16, 4)]


def moved_place(obj: bpy.types.Object) -> list[float] | None:
    """Return where a stand-in object is if that is not where it was put; None if it is there."""
    place = _stored(obj).get("place")
    return _place(obj) if place is not None and place != _place(obj) else None


def place_again(obj: bpy.types.Object) -> None:
    """Remember where a stand-in object is now as the place it was put."""
    obj[STAND_IN] = json.dumps({**_stored(obj), "place": _place(obj)})


def is_edited_object(obj: bpy.types.Object) -> bool:
    """Whether the user has moved a stand-in object, renamed it, or added anything to it."""
    stored = _stored(obj)
    return bool(stored) and (stored.get("place") != _place(obj) or stored.get("state") != _state(obj))


def release_object(obj: bpy.types.Object) -> None:
    """Make a stand-in object the user's."""
    unmark_made(obj)
    for key in (STAND_IN, INSTANCER):
        if key in obj:
            del obj[key]


def _stored(obj: bpy.types.Object) -> dict:
    try:
        return dict(json.loads(obj[STAND_IN])) if STAND_IN in obj else {}
    except (ValueError, TypeError):
        return {}


def _place(obj: bpy.types.Object) -> list[float]:
    return [float(value) for row in obj.matrix_basis for value in row]


def _state(obj: bpy.types.Object) -> list:
    """Return what somebody may add to an object."""
    # Before Blender 5.0, properties of add-ons are among them, merely because somebody read them.
    known = obj.bl_rna.properties
    custom = sorted(key for key in obj.keys() if key not in known and not key.startswith("radiosity"))  # noqa: SIM118
    action = obj.animation_data is not None
    return [
        obj.name.removeprefix(ASIDE),
        "" if obj.parent is None else obj.parent.name,
        [constraint.type for constraint in obj.constraints],
        [modifier.type for modifier in obj.modifiers],
        [group.name for group in obj.vertex_groups],
        custom,
        action,
        [original.name if original else "" for original in map(original_of, _object_slots(obj))],
    ]


def _object_slots(obj: bpy.types.Object) -> list[bpy.types.Material | None]:
    return [slot.material for slot in obj.material_slots if slot.link == "OBJECT"]
