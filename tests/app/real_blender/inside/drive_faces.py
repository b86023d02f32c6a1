"""Bake a block that is inside out, flip its faces, undo it, and look at the panel. Writes what was seen.

Usage: blender cornell.blend --enable-event-simulate --python drive_faces.py -- ANSWER.json
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events
from file_dump import differences, dump_file

MODULE = "bl_ext.user_default.radiosity_addon"

facts = importlib.import_module(f"{MODULE}.blender.operators.panel_facts")

seen = {}


def call(operator):
    """Call an operator as a button does, with a step of undo."""
    override = {"window": events.window(), "area": events.area_3d(), "region": events.region("WINDOW")}
    with bpy.context.temp_override(**override):
        operator("EXEC_DEFAULT", True)


def look(name):
    """Note what the panel shows of the last bake, and photograph it."""
    sidebar = events.region("UI")
    x, y = sidebar.x + 30, sidebar.y + 30
    yield from events.hover(x, y)
    for _ in range(20):
        events.window().event_simulate(type="WHEELDOWNMOUSE", value="PRESS", x=x, y=y)
        yield 0.02
    with bpy.context.temp_override(window=events.window()):
        facts.faces_to_flip(bpy.context)
    yield 1.5  # it is worked out on a timer
    with bpy.context.temp_override(window=events.window()):
        seen[name] = facts.faces_to_flip(bpy.context)[0]
    part = (sidebar.x - 10, 40, sidebar.width + 20, 720)
    events.screenshot(events.ANSWER.with_name(f"faces-{name}.png"), part)


def script():
    view = events.center("WINDOW")
    settings = bpy.context.scene.radiosity
    settings.quality, settings.resolution, settings.show_result = "sketch", 64, False
    bpy.data.objects["Tall Block"].data.flip_normals()
    bpy.ops.ed.undo_push(message="Inside Out")
    yield from events.open_sidebar("Radiosity")
    call(bpy.ops.radiosity.bake)
    yield from look("baked")
    sidebar = events.region("UI")
    events.screenshot(
        events.ANSWER.with_name("faces-buttons.png"), (sidebar.x - 10, 290, sidebar.width + 20, 300)
    )
    before = dump_file()
    call(bpy.ops.radiosity.flip_turned_faces)
    yield from look("flipped")
    seen["changed"] = differences(before, dump_file())
    yield from events.key("Z", *view, ctrl=True)
    yield from look("undone")
    seen["after_undo"] = differences(before, dump_file())
    yield from events.key("Z", *view, ctrl=True, shift=True)
    call(bpy.ops.radiosity.bake)
    yield from look("baked_again")


events.drive(script(), seen)
