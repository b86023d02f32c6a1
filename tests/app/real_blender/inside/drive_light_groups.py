"""Bake light groups, open their section and photograph it.

Usage: blender FILE --enable-event-simulate --python drive_light_groups.py -- ANSWER.json
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events

MODULE = "bl_ext.user_default.radiosity_addon"

seen = {"drawn": {}}


def opened_section():
    """Have the section open that comes folded, and note each time it was drawn to the end."""
    section = importlib.import_module(f"{MODULE}.blender.panels.light_group_panels").LightGroupSection
    draw = section.draw

    def draw_and_note(layout, context):
        draw(layout, context)
        seen["drawn"]["sidebar"] = seen["drawn"].get("sidebar", 0) + 1

    section.folded, section.draw = False, draw_and_note


def active(name):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj.name == name)
    bpy.context.view_layer.objects.active = bpy.data.objects[name]


def script():
    opened_section()
    scene = bpy.context.scene
    group = scene.radiosity
    group.resolution, group.quality, group.use_light_groups = 64, "sketch", True
    lamp = next(obj for obj in scene.objects if obj.type == "LIGHT")
    active(lamp.name)
    bpy.ops.radiosity.light_group_assign(group="Ceiling")
    with bpy.context.temp_override(window=events.window(), area=events.area_3d()):
        seen["baked"] = sorted(bpy.ops.radiosity.bake("EXEC_DEFAULT"))
    yield from events.open_sidebar("Radiosity")
    yield 1.0
    events.screenshot(events.ANSWER.with_name("light-groups.png"))


events.drive(script(), seen)
