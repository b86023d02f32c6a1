"""When a button can be pressed, and what Blender says when it cannot."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ..session import last_bake
from ..session.state import session
from .panel_facts import has_light_mixers, relight_refusal


def no_bake_runs(_context: bpy.types.Context) -> str:
    """Most operators wait for the end of a bake."""
    return "A bake is running; press Esc to cancel it" if session.running.active else ""


def has_scene(context: bpy.types.Context) -> str:
    """A window may have no scene while a file is loaded."""
    return "There is no scene" if context.scene is None else ""


def can_relight(context: bpy.types.Context) -> str:
    """Return why the scene's bake cannot be relit."""
    return has_scene(context) or relight_refusal(context)


def has_folder(context: bpy.types.Context) -> str:
    """A packed bake has no folder to open."""
    last = last_bake.read(context.scene)
    return "The last bake wrote no files" if last is None or not last.folder else ""


def has_selection(context: bpy.types.Context) -> str:
    """Light groups are assigned to what is selected."""
    return "" if context.view_layer.objects.selected else "Select lamps or objects that emit light first"


def in_object_mode(context: bpy.types.Context) -> str:
    """Objects cannot be selected while one is edited, and undo there would only concern its own mesh."""
    return "" if context.mode == "OBJECT" else "Switch to Object Mode first"


def has_light_groups(context: bpy.types.Context) -> str:
    """Only baked light groups have sliders."""
    return "" if has_light_mixers(context) else "No bake with light groups is shown"


class Conditional:
    """A mixin of operators: they can run while none of their conditions returns a reason against it."""

    conditions: tuple[Callable[[bpy.types.Context], str], ...] = (no_bake_runs,)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Check the conditions in their order."""
        for condition in cls.conditions:
            reason = condition(context)
            if reason:
                cls.poll_message_set(reason[0].upper() + reason[1:])  # type: ignore[attr-defined]
                return False
        return True
