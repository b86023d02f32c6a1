"""What objects show of a bake: taken off them, and put back exactly."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..datablocks.bake_record import LAYER, ORIGINAL, forget, is_made, is_recorded
from ..datablocks.uv_layers import LayerRecord, layer_record, layer_values, put_back_layer, take_layer_off
from ..material_copies.material_slots import (
    data_with_copies,
    drop_added_slots,
    drop_slots,
    link_to_object,
    own_copies,
    set_materials,
    show_originals,
    show_own_originals,
)
from ..stand_ins.followers import switch_drivers_on
from ..stand_ins.stand_ins import own_mesh, stand_in_of

_RECORD_FIELDS = (
    "is_baked",
    "original_mesh",
    "object_slots",
    "active_material_index",
    "is_hidden",
    "hide_viewport",
    "hide_render",
    "fingerprint",
    "texels_per_metre",
    "light",
    "scene",
)


def showing() -> list[bpy.types.Object]:
    """Return the file's own objects that show anything of a bake, except for stand-ins."""
    dressed = set(_dressed())
    return [
        obj
        for obj in bpy.data.objects
        if obj.library is None
        and not is_made(obj)
        and (is_recorded(obj) or _shows(obj, dressed) or own_copies(obj))
    ]


def _shows(obj: bpy.types.Object, dressed: Collection[Any]) -> bool:
    return obj.data is not None and (is_made(obj.data) or obj.data in dressed)


def _meshes_with_layer() -> list[bpy.types.Mesh]:
    return [mesh for mesh in bpy.data.meshes if mesh.library is None and LAYER in mesh]


@dataclass(frozen=True)
class _Object:
    """One object as it was."""

    obj: bpy.types.Object
    record: dict[str, object]
    modifiers: tuple[tuple[str, bool, bool], ...]
    data: bpy.types.ID | None
    slots: tuple[tuple[str, bpy.types.Material | None], ...]
    active_material_index: int
    modifier_flags: tuple[tuple[str, bool, bool], ...]
    hide_viewport: bool
    hide_render: bool


@dataclass(frozen=True)
class _Data:
    """Data of an object's own as it was."""

    data: Any
    materials: tuple[bpy.types.Material | None, ...]
    record: LayerRecord | None
    values: np.ndarray | None
    users: tuple[bpy.types.Object, ...]


class ShownState:
    """What some objects show, remembered; `take_off` and `put_back` can be called in turns.

    objects: None of them stand-ins.
    """

    def __init__(self, objects: Sequence[bpy.types.Object]) -> None:
        self._objects = [_remember(obj) for obj in objects]
        own = [obj.data for obj in objects if obj.data is not None and not is_made(obj.data)]
        own += [mesh for obj in objects if (mesh := own_mesh(obj)) is not None]
        editable = [
            data for data in dict.fromkeys(own) if data.library is None and hasattr(data, "materials")
        ]
        users = _users_of_data()
        self._data = [_remember_data(data, users.get(data, ())) for data in editable]

    def put_back(self) -> None:
        """Show all of it again, exactly as it was."""
        for data in self._data:
            _put_back_data(data)
        for baked in self._objects:
            _put_back(baked)
        switch_drivers_on([baked.obj for baked in self._objects])


def take_off(objects: Sequence[bpy.types.Object]) -> None:
    """Have objects show their own meshes, materials, modifiers and visibility; no records stay.

    A mesh that other objects share keeps the lightmap that these show.
    """
    inside = set(objects)
    for obj in objects:
        _take_off(obj)
    users = _users_of_data()
    for data in _dressed():
        if data in users and inside.issuperset(users[data]):
            _take_off_data(data, users[data])
    switch_drivers_on(objects)


def take_off_unused() -> None:
    """The same for data that no object uses."""
    users = _users_of_data()
    for data in _dressed():
        if data not in users:
            _take_off_data(data)


def _users_of_data() -> dict[bpy.types.ID, list[bpy.types.Object]]:
    users: dict[bpy.types.ID, list[bpy.types.Object]] = {}
    for obj in bpy.data.objects:
        if obj.data is not None:
            users.setdefault(obj.data, []).append(obj)
    return users


def _dressed() -> list[Any]:
    """Return the user's data that have a layer of ours, or lightmap copies in their slots."""
    return [data for data in dict.fromkeys([*_meshes_with_layer(), *data_with_copies()]) if not is_made(data)]


def _take_off_data(data: Any, users: Sequence[bpy.types.Object] = ()) -> None:
    """Take our layer off a mesh of the user's, and put the user's materials into the slots of any data."""
    record = layer_record(data) if isinstance(data, bpy.types.Mesh) else None
    if record is not None:
        take_layer_off(data)
    show_originals(data)
    if record is not None:
        drop_added_slots(data, record.slots, users)


def sharing(objects: Iterable[bpy.types.Object]) -> list[bpy.types.Object]:
    """Return the objects and those that share a mesh with a lightmap with one of them."""
    chosen = list(dict.fromkeys(objects))
    meshes = {obj.data for obj in chosen if isinstance(obj.data, bpy.types.Mesh) and LAYER in obj.data}
    more = [
        obj for obj in bpy.data.objects if obj.data in meshes and obj.library is None and not is_made(obj)
    ]
    return list(dict.fromkeys([*chosen, *more]))


def _take_off(obj: bpy.types.Object) -> None:
    recorded = is_recorded(obj)
    known = stand_in_of(obj.data) if isinstance(obj.data, bpy.types.Mesh) else None
    original = obj.data.get(ORIGINAL) if known is not None else None
    record = obj.radiosity_bake.modifiers if recorded else ()
    modifiers = tuple((each.name, each.show_viewport, each.show_render) for each in record)
    if known is not None and original is not None:
        obj.data = original
        if recorded or obj.override_library is not None:
            for slot in known.object_slots:
                if slot < len(obj.material_slots):
                    link_to_object(obj, slot)
            obj.active_material_index = known.active_slot
            modifiers = modifiers or known.modifiers
    _switch_on(obj, modifiers)
    show_own_originals(obj)
    if recorded and obj.radiosity_bake.is_hidden:
        # What was made visible meanwhile stays so.
        obj.hide_viewport = obj.hide_viewport and obj.radiosity_bake.hide_viewport
        obj.hide_render = obj.hide_render and obj.radiosity_bake.hide_render
    if obj.is_property_set("radiosity_bake"):
        forget(obj)


def _switch_on(obj: bpy.types.Object, modifiers: Sequence[tuple[str, bool, bool]]) -> None:
    """Let modifiers show as they did, except for those that the user switched on since."""
    names = {name for name, _, _ in modifiers}
    renamed = [m for m in obj.modifiers if m.name not in names and not (m.show_viewport or m.show_render)]
    for name, show_viewport, show_render in modifiers:
        modifier = obj.modifiers.get(name)
        if modifier is None and renamed:
            modifier = renamed.pop(0)
        if modifier is not None:
            modifier.show_viewport = modifier.show_viewport or show_viewport
            modifier.show_render = modifier.show_render or show_render


def _remember(obj: bpy.types.Object) -> _Object:
    record = obj.radiosity_bake if obj.is_property_set("radiosity_bake") else None
    fields = () if record is None else filter(record.is_property_set, _RECORD_FIELDS)
    return _Object(
        obj=obj,
        record={name: getattr(record, name) for name in fields},
        modifiers=tuple((m.name, m.show_viewport, m.show_render) for m in record.modifiers) if record else (),
        data=obj.data,
        slots=tuple((slot.link, slot.material) for slot in obj.material_slots),
        active_material_index=obj.active_material_index,
        modifier_flags=tuple((m.name, m.show_viewport, m.show_render) for m in obj.modifiers),
        hide_viewport=obj.hide_viewport,
        hide_render=obj.hide_render,
    )


def _remember_data(data: Any, users: Sequence[bpy.types.Object]) -> _Data:
    mesh = isinstance(data, bpy.types.Mesh)
    return _Data(
        data=data,
        materials=tuple(data.materials),
        record=layer_record(data) if mesh else None,
        values=layer_values(data) if mesh else None,
        users=tuple(users),
    )


def _put_back_data(before: _Data) -> None:
    data = before.data
    if isinstance(data, bpy.types.Mesh):
        take_layer_off(data)
    drop_slots(data, len(before.materials), before.users)
    set_materials(data, before.materials)
    if before.record is not None:
        put_back_layer(data, before.record, before.values)


def _put_back(before: _Object) -> None:
    obj = before.obj
    if obj.is_property_set("radiosity_bake"):
        forget(obj)
    for name, value in before.record.items():
        setattr(obj.radiosity_bake, name, value)
    for name, show_viewport, show_render in before.modifiers:
        entry = obj.radiosity_bake.modifiers.add()
        entry.name, entry.show_viewport, entry.show_render = name, show_viewport, show_render
    if obj.data != before.data:
        obj.data = before.data
    for number, (slot, (link, material)) in enumerate(zip(obj.material_slots, before.slots, strict=False)):
        if slot.link != link == "OBJECT":
            link_to_object(obj, number)
        elif slot.link != link:
            slot.link = link
        if link == "OBJECT" and slot.material != material:
            slot.material = material
    obj.active_material_index = before.active_material_index
    for name, show_viewport, show_render in before.modifier_flags:
        modifier = obj.modifiers.get(name)
        if modifier is not None:
            modifier.show_viewport, modifier.show_render = show_viewport, show_render
    obj.hide_viewport, obj.hide_render = before.hide_viewport, before.hide_render
