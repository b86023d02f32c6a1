"""Keyframes and drivers, by the data paths that they animate."""

from __future__ import annotations

from collections.abc import Iterator

import bpy


def path_of(socket: bpy.types.NodeSocket) -> str:
    """Return the data path of a socket's value in its tree."""
    return f"{socket.path_from_id()}.default_value"


def is_keyed(socket: bpy.types.NodeSocket) -> bool:
    """Whether keyframes or a driver of its tree animate a socket's value."""
    tree = socket.id_data
    if tree.animation_data is None:
        return False
    path = path_of(socket)
    return any(curve.data_path == path for curve in curves(tree))


def move_keys(tree: bpy.types.NodeTree, before: str, after: str) -> None:
    """Redirect the animation of one path of a tree to another."""
    if tree.animation_data is not None and before != after:
        for curve in list(curves(tree)):
            if curve.data_path == before:
                curve.data_path = after


def curves(owner: bpy.types.ID) -> Iterator[bpy.types.FCurve]:
    """Yield all drivers of a datablock, and all curves of its action and of its strips' actions."""
    data = owner.animation_data
    if data is None:
        return
    yield from data.drivers
    yield from _curves_for(data.action, getattr(data, "action_slot", None))
    for track in data.nla_tracks:
        for strip in track.strips:
            yield from _curves_for(strip.action, getattr(strip, "action_slot", None))


def _curves_for(
    action: bpy.types.Action | None, slot: bpy.types.ActionSlot | None
) -> Iterator[bpy.types.FCurve]:
    """Yield an action's curves; of one with slots those of a slot, or of all where it is not known."""
    if action is None:
        return
    if hasattr(action, "fcurves"):  # until Blender 5.0
        yield from action.fcurves
        return
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                if slot is None or bag.slot_handle == slot.handle:
                    yield from bag.fcurves
