"""Bake light groups, open their panel and the properties that name them, and photograph both.

Usage: blender FILE --enable-event-simulate --python drive_light_groups.py -- ANSWER.json
"""

import importlib
import json
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events

ANSWER = Path(sys.argv[sys.argv.index("--") + 1])
MODULE = "bl_ext.user_default.radiosity_addon"
# Not those of materials and worlds: their previews take minutes without a graphics card.
PLACES = {
    "OBJECT": "RADIOSITY_PT_light_group_object",
    "DATA": "RADIOSITY_PT_light_group_lamp",
}

seen = {"drawn": {}}


def opened(name):
    """Have a panel open that comes folded, and note each time it was drawn to the end."""
    panel = getattr(bpy.types, name)
    draw = panel.draw

    def draw_and_note(self, context):
        draw(self, context)
        seen["drawn"][name] = seen["drawn"].get(name, 0) + 1

    bpy.utils.unregister_class(panel)
    panel.bl_options, panel.draw = set(), draw_and_note
    bpy.utils.register_class(panel)


def opened_section():
    """The same of the section in the sidebar."""
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
    for name in PLACES.values():
        opened(name)
    scene = bpy.context.scene
    group = scene.radiosity
    group.resolution, group.quality, group.use_light_groups = 64, "draft", True
    lamp = next(obj for obj in scene.objects if obj.type == "LIGHT")
    lamp.radiosity_light_group = "Ceiling"
    active(lamp.name)
    with bpy.context.temp_override(window=events.window(), area=events.area_3d()):
        seen["baked"] = sorted(bpy.ops.radiosity.bake("EXEC_DEFAULT"))
    yield from events.open_sidebar("Radiosity")
    yield 1.0
    events.screenshot(ANSWER.with_name("light-groups.png"))
    properties = next(area for area in events.window().screen.areas if area.type == "PROPERTIES")
    for place in PLACES:
        properties.spaces.active.context = place
        properties.tag_redraw()
        yield 0.5
    events.screenshot(ANSWER.with_name("light-groups-properties.png"))


def finished(failure):
    seen["failure"] = failure
    ANSWER.write_text(json.dumps(seen, indent=1))


bpy.context.preferences.view.show_splash = False
events.drive(script(), finished)
