"""An earlier bake set aside while a new one is made, and put back if that comes to nothing.

A bake must see the originals, yet until the new lightmaps are there the old ones are all
the user has. So the earlier bake is neither restored nor removed: its meshes are taken off
the objects, its record into memory, and only success removes it for good.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ..bake_scene import BakeWarning
from .bake_record import is_made, made_datablocks, mark_made, recorded_objects, remove_datablocks, unmark_made
from .material_edits import carry_edits
from .restore import leave_edit_modes, restore, show_original

SHAPE = "radiosity_shape"
"""Custom property of a baked copy: what its shape was."""

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
)


@dataclass(frozen=True)
class _Baked:
    """One object as the earlier bake left it, and what its record said."""

    obj: bpy.types.Object
    record: dict[str, object]
    modifiers: tuple[tuple[str, bool, bool], ...]
    mesh: bpy.types.ID | None
    slot_links: tuple[str, ...]
    active_material_index: int
    modifier_flags: tuple[tuple[str, bool, bool], ...]
    hide_viewport: bool
    hide_render: bool


class EarlierBake:
    """A bake that is set aside; it must be put back or discarded before control returns to the user.

    While aside its datablocks are not marked as made by a bake and have names that leave
    theirs free, so that a new bake can be applied as if this one had never been.
    """

    def __init__(self, context: bpy.types.Context) -> None:
        objects = recorded_objects()
        leave_edit_modes(context, objects)
        self._context = context
        self._objects = [_remember(obj) for obj in objects]
        self._made = [(block, block.name) for block in made_datablocks()]
        self._stand_ins = [
            (block, block.hide_viewport, block.hide_render)
            for block, _ in self._made
            if isinstance(block, bpy.types.Object)
        ]
        for obj in objects:
            show_original(obj)
        for block, _, _ in self._stand_ins:
            block.hide_viewport = block.hide_render = True
        for block, name in self._made:
            unmark_made(block)
            block.name = f".earlier {name}"
        context.view_layer.update()

    def put_back(self) -> None:
        """Show the earlier bake again, exactly as it was."""
        for block, hide_viewport, hide_render in self._stand_ins:
            block.hide_viewport, block.hide_render = hide_viewport, hide_render
        for block, name in self._made:
            mark_made(block)
            block.name = name
        for baked in self._objects:
            _show_baked(baked)
        self._context.view_layer.update()

    def discard(self, keep: frozenset[str] = frozenset()) -> None:
        """Remove the earlier bake for good, but for the objects whose names are to keep theirs."""
        shown = [baked for baked in self._objects if baked.obj.name in keep]
        for baked in shown:
            _show_baked(baked)
        meshes = [baked.mesh for baked in shown if baked.mesh is not None]
        used = _all_used(meshes, [block for block, _ in self._made])
        for block, name in self._made:
            if block in used:
                mark_made(block)
                block.name = name
        remove_datablocks([block for block, _ in self._made if block not in used])
        self._context.view_layer.update()


def seal() -> None:
    """Remember the shape of every baked copy, to know later whether somebody edited it."""
    for obj in recorded_objects():
        if isinstance(obj.data, bpy.types.Mesh) and is_made(obj.data):
            obj.data[SHAPE] = _shape(obj.data)


def edited_copies() -> tuple[BakeWarning, ...]:
    """Warn of copies edited since the bake: baking again starts from the originals and drops them."""
    shown = [obj for obj in recorded_objects() if isinstance(obj.data, bpy.types.Mesh)]
    return tuple(
        BakeWarning(
            obj.name,
            "its mesh was edited while it showed a lightmap; the bake used the original mesh: "
            "press Restore before editing",
        )
        for obj in shown
        if SHAPE in obj.data.keys() and obj.data[SHAPE] != _shape(obj.data)  # noqa: SIM118 (an ID is no dict)
    )


def _shape(mesh: bpy.types.Mesh) -> str:
    """A digest of the mesh's corners."""
    corners = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", corners)
    return hashlib.sha256(corners.tobytes()).hexdigest()


@contextmanager
def originals_shown(context: bpy.types.Context) -> Iterator[tuple[BakeWarning, ...]]:
    """Show the originals for a moment, as if nothing had been baked; yields what to warn of."""
    leave_edit_modes(context, recorded_objects())
    edited = (*carry_edits(), *edited_copies())
    earlier = EarlierBake(context)
    try:
        yield edited
    finally:
        earlier.put_back()


@contextmanager
def replacing_earlier(context: bpy.types.Context, keep: frozenset[str] = frozenset()) -> Iterator[None]:
    """Set the earlier bake aside; remove it on success, but for objects to `keep`; put it back on failure."""
    earlier = EarlierBake(context)
    try:
        yield
    except BaseException:
        restore(context)  # what the new bake has shown so far
        earlier.put_back()
        raise
    earlier.discard(keep)


def _all_used(roots: list[bpy.types.ID], among: list[bpy.types.ID]) -> set[bpy.types.ID]:
    """Return those of some datablocks that `roots` are or use, however indirectly."""
    users = bpy.data.user_map(subset=among) if among else {}
    used = set(roots)
    while True:
        more = {block for block, of in users.items() if block not in used and not used.isdisjoint(of)}
        if not more:
            return used
        used |= more


def _remember(obj: bpy.types.Object) -> _Baked:
    record = obj.radiosity_bake
    return _Baked(
        obj=obj,
        record={name: getattr(record, name) for name in _RECORD_FIELDS if record.is_property_set(name)},
        modifiers=tuple((entry.name, entry.show_viewport, entry.show_render) for entry in record.modifiers),
        mesh=obj.data,
        slot_links=tuple(slot.link for slot in obj.material_slots),
        active_material_index=obj.active_material_index,
        modifier_flags=tuple((m.name, m.show_viewport, m.show_render) for m in obj.modifiers),
        hide_viewport=obj.hide_viewport,
        hide_render=obj.hide_render,
    )


def _show_baked(baked: _Baked) -> None:
    obj = baked.obj
    for name, value in baked.record.items():
        setattr(obj.radiosity_bake, name, value)
    for name, show_viewport, show_render in baked.modifiers:
        entry = obj.radiosity_bake.modifiers.add()
        entry.name, entry.show_viewport, entry.show_render = name, show_viewport, show_render
    if obj.data != baked.mesh:
        obj.data = baked.mesh
    for slot, link in zip(obj.material_slots, baked.slot_links, strict=False):
        slot.link = link
    obj.active_material_index = baked.active_material_index
    for name, show_viewport, show_render in baked.modifier_flags:
        modifier = obj.modifiers.get(name)
        if modifier is not None:
            modifier.show_viewport, modifier.show_render = show_viewport, show_render
    obj.hide_viewport, obj.hide_render = baked.hide_viewport, baked.hide_render
