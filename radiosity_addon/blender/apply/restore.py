"""Restore: objects as they were before the bake, with all that was edited since."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ...base import BakeWarning
from ..datablocks.bake_record import made_datablocks, recorded_objects
from ..stand_ins.stand_ins import INSTANCER
from .edits import carry_edits
from .lamp_highlights import put_unused_back
from .scopes import scene_of
from .shown_state import sharing, showing, take_off, take_off_unused
from .sweep import sweep


@dataclass(frozen=True)
class RestoreResult:
    """What Restore did: how many objects it brought back, and what the user should know of edits."""

    count: int
    warnings: tuple[BakeWarning, ...]


def restore(context: bpy.types.Context) -> int:
    """Bring every baked object of the file back; returns how many, 0 if nothing was baked."""
    return restore_scene(context, None).count


def restore_scene(context: bpy.types.Context, scene: bpy.types.Scene | None) -> RestoreResult:
    """Take the lightmaps off the objects of a scene, or of the whole file.

    Meshes, UV layers, materials, slots, modifiers and visibility are as they were, with the user's edits
    since. What the bake made is removed as far as nothing else shows or uses it. Image files on disk stay.

    scene: None restores the whole file. Objects of no scene go with any of them.
    """
    if next(made_datablocks(), None) is None and not recorded_objects():
        put_unused_back()
        return RestoreResult(0, ())
    warnings = carry_edits(context)
    shown = showing()
    if scene is not None:
        shown = sharing(obj for obj in shown if is_of_scene(obj, scene))
    count = sum(obj in set(shown) for obj in recorded_objects())
    stand_ins = stand_ins_of(shown, scene)
    take_off(shown)
    take_off_unused()
    sweep(stand_ins)
    put_unused_back()
    context.view_layer.update()
    return RestoreResult(count, warnings)


def is_of_scene(obj: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Whether an object is in a scene, shows a lightmap of the scene's bake, or is in no scene at all."""
    return scene_of(obj) == scene or scene in (scenes := obj.users_scene) or not scenes


def stand_ins_of(
    objects: Sequence[bpy.types.Object], scene: bpy.types.Scene | None
) -> list[bpy.types.Object]:
    """Return the stand-in objects of instances that some objects make, or of the whole file."""
    stand_ins = [block for block in made_datablocks() if isinstance(block, bpy.types.Object)]
    if scene is None:
        return stand_ins
    inside = set(objects)
    found = []
    for stand_in in stand_ins:
        instancer = stand_in.get(INSTANCER)
        if instancer in inside or (instancer is None and is_of_scene(stand_in, scene)):
            found.append(stand_in)
    return found
