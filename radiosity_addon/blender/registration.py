"""All that the extension adds to Blender but its command, in one order; taken out in the reverse."""

from __future__ import annotations

import atexit
from collections.abc import Callable
from functools import partial

import bpy

from . import handlers
from .datablocks import bake_record
from .operators import (
    bake_operators,
    cleaning,
    export_operators,
    face_operators,
    light_group_operators,
    relight_operators,
    setting_operators,
)
from .overlays import overlay_properties, overlay_view
from .panels import (
    bake_panel,
    check_panel,
    light_group_panels,
    material_panel,
    object_panel,
    overlay_panel,
)
from .relight import live_switch, relight_properties
from .scene_records import glass, object_roles
from .session import facts
from .session.state import session
from .settings import light_group_properties, preferences, preset_menu, properties

CLASSES = (
    *preferences.CLASSES,
    *bake_operators.CLASSES,
    *relight_operators.CLASSES,
    *export_operators.CLASSES,
    *light_group_operators.CLASSES,
    *face_operators.CLASSES,
    *setting_operators.CLASSES,
    *preset_menu.CLASSES,
    *bake_panel.CLASSES,
    *light_group_panels.CLASSES,
    *check_panel.CLASSES,
    *object_panel.CLASSES,
    *material_panel.CLASSES,
    *overlay_panel.CLASSES,
    *cleaning.CLASSES,
)

_undo: list[Callable[[], None]] = []


def register() -> None:
    """Register everything once; a failure part of the way takes back what was done."""
    if _undo:
        return
    try:
        for module in (
            *(bake_record, object_roles, glass, light_group_properties, properties),
            *(relight_properties, live_switch, overlay_properties, overlay_view, handlers),
        ):
            module.register()
            _undo.append(module.unregister)
        for cls in CLASSES:
            bpy.utils.register_class(cls)
            _undo.append(partial(bpy.utils.unregister_class, cls))
        preset_menu.register()
        _undo.append(preset_menu.unregister)
        _undo.append(facts.stop)
        _undo.append(session.stop_running)
    except BaseException:
        unregister()
        raise
    # Blender as a Python module crashes or hangs at exit (4.2, 4.5) while Python classes
    # of ours are still registered. The application is gone when these callbacks run, and
    # unregistering would crash it: it looks after its extensions itself.
    if not bpy.app.binary_path:
        atexit.register(unregister)


def also_undo(undo: Callable[[], None]) -> None:
    """Have `unregister` take out first what was added after `register`."""
    _undo.append(undo)


def unregister() -> None:
    """Take everything out again; harmless where nothing is registered."""
    atexit.unregister(unregister)
    while _undo:
        _undo.pop()()
