"""Change what the panel shows, and photograph the first frame of each change and the last.

Usage: blender cornell.blend --enable-event-simulate --python drive_panel_frames.py -- ANSWER.json
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events

MODULE = "bl_ext.user_default.radiosity_addon"
runtime = importlib.import_module(f"{MODULE}.blender.session.state").session

seen = {"changes": []}


def photograph(name):
    """Picture of the sidebar."""
    place, height = events.region("UI"), events.window().height
    part = (place.x, height - place.y - place.height, place.width, place.height)
    events.screenshot(events.ANSWER.with_name(f"frames-{name}.png"), part)


def after(name):
    """Photograph what is drawn first after a change, and what Blender comes to when it is drawn again."""
    events.first_frame("UI")
    photograph(f"{name}-first")
    for _ in range(3):
        yield 0.3
        events.region("UI").tag_redraw()
    yield 0.3
    photograph(f"{name}-last")
    seen["changes"].append(name)


def script():
    scene = bpy.context.scene
    scene.radiosity.resolution, scene.radiosity.quality = 32, "sketch"
    scene.radiosity.show_result = False
    bpy.context.view_layer.objects.active = bpy.data.objects["Floor"]
    # What is in the view shines through the sidebar, and is drawn more finely each time: look away from it.
    view = events.area_3d().spaces.active.region_3d
    view.view_perspective, view.view_location = "PERSP", (0.0, 0.0, 1000.0)
    yield from events.open_sidebar("Radiosity")
    yield from after("opened")
    runtime.running.active = True  # as while a bake runs, but at rest
    yield from after("baking")
    # The mouse is left where the Bake button was pressed: over the progress bar.
    yield from events.hover(events.center("UI")[0], events.region("UI").y + events.region("UI").height - 49)
    runtime.running.active = False
    yield from after("canceled")
    yield from events.hover(*events.center("WINDOW"))
    with bpy.context.temp_override(window=events.window(), area=events.area_3d()):
        bpy.ops.radiosity.bake("EXEC_DEFAULT")
        yield from after("baked")
        runtime.interrupted = True
        yield from after("interrupted")
        runtime.interrupted = False
        yield from after("recovered")
        bpy.ops.radiosity.restore()
        yield from after("restored")


events.drive(script(), seen)
