"""Drag a lamp's slider with Live on, undo it, and press Relight. Writes what was seen.

Usage: blender FILE --enable-event-simulate --python drive_relight.py -- ANSWER.json
"""

import importlib
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import events

MODULE = "bl_ext.user_default.radiosity_addon.blender"
HEADER = 34  # pixels at the sidebar's top: the panel's title, which a click would fold
STEPS = 4

PATIENCE = 10.0  # seconds for one change to be seen

seen = {}
drawn = []


def module(name):
    return importlib.import_module(f"{MODULE}.{name}")


def running(name):
    return any(operator.bl_idname == name for operator in events.window().modal_operators)


def baking():
    """A bake runs as a modal operator."""
    return running("RADIOSITY_OT_bake")


def not_baking():
    """The bake has ended."""
    return not baking()


def relighting():
    """The button's operator runs."""
    return running("RADIOSITY_OT_relight")


def not_relighting():
    """The button's operator has ended."""
    return not relighting()


def resting():
    """Live has nothing left to do."""
    live = module("session.state").session.live
    return live is not None and not live.is_at_work()


def note_drawing():
    drawn.append(time.perf_counter())


def lamp():
    return bpy.data.objects["Lamp"].data


def light():
    """Mean of the lightmap."""
    (image,) = (image for image in bpy.data.images if image.name.endswith("lightmap.exr"))
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return float(pixels.reshape(-1, 4)[:, :3].mean())


def script():
    view = events.center("WINDOW")
    bpy.types.SpaceView3D.draw_handler_add(
        lambda: drawn.append(time.perf_counter()), (), "WINDOW", "POST_PIXEL"
    )
    yield from events.open_sidebar("Radiosity")
    bpy.context.scene.radiosity.show_result = False
    yield from events.click_down(HEADER, baking)
    yield from events.until(not_baking, 240)
    # Textures on plain surfaces are quick to draw without a graphics card, and materials are not.
    shading = events.area_3d().spaces.active.shading
    shading.type, shading.color_type = "SOLID", "TEXTURE"
    yield 1.0
    bpy.context.window_manager.radiosity_live = True
    yield from events.until(resting, 60)
    seen["baked"], seen["power"] = light(), lamp().energy
    events.screenshot(events.ANSWER.with_name("relight-before.png"))

    yield from drag()
    yield from events.until(resting, 60)
    seen["dragged"], seen["power_dragged"] = light(), lamp().energy
    events.screenshot(events.ANSWER.with_name("relight-after.png"))
    yield from events.key("Z", *view, ctrl=True)
    yield 0.5
    yield from events.until(resting, 60)
    seen["undone"], seen["power_undone"] = light(), lamp().energy

    yield from follow()
    yield from events.until(resting, 60)
    seen["message"] = module("session.state").session.live_message
    yield 1.0
    seen["still_resting"] = resting()

    seen["on"] = bpy.context.window_manager.radiosity_live

    bpy.context.window_manager.radiosity_live = False
    lamp().energy = 0.5 * seen["power"]
    window, area = events.window(), events.area_3d()
    with bpy.context.temp_override(window=window, area=area, region=events.region("WINDOW")):
        bpy.ops.radiosity.relight("INVOKE_DEFAULT")
    seen["modal"] = relighting()
    yield from events.until(not_relighting, 60)
    seen["halved"] = light()


class PowerSlider(bpy.types.Panel):
    """A tab with the lamp's power and nothing else, so that it is known where the slider is."""

    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Slider"
    bl_idname, bl_label = "SLIDER_PT_power", "Slider"

    def draw(self, _context):
        column = self.layout.column()
        column.scale_y = 3.0
        column.prop(lamp(), "energy")


def drag():
    """Drag the slider of the lamp's power to the right."""
    bpy.utils.register_class(PowerSlider)
    yield from events.open_sidebar("Slider")
    sidebar = events.region("UI")
    x, y = sidebar.x + sidebar.width // 2, sidebar.y + sidebar.height - HEADER - 36
    yield from events.hover(x, y)
    events.window().event_simulate(type="LEFTMOUSE", value="PRESS", x=x, y=y)
    yield events.PAUSE
    for step in range(1, 12):
        events.window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x + 5 * step, y=y)
        yield events.PAUSE
    events.window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=x + 55, y=y)
    yield 0.2
    assert lamp().energy != seen["power"], "the drag did not change the lamp's power"


def follow():
    """Change the power step by step; note how long the image takes, and how long until it is drawn."""
    live = module("session.state").session.live
    latencies, frames = [], []
    for step in range(STEPS):
        shown = live.changes
        drawn.clear()
        start = time.perf_counter()
        lamp().energy = seen["power"] * (1.0 + 0.1 * step) * 1.01
        while live.changes == shown and time.perf_counter() - start < PATIENCE:
            yield 0.0
        latencies.append(live.latency)
        changed = time.perf_counter()
        while not [at for at in drawn if at > changed] and time.perf_counter() - start < PATIENCE:
            yield 0.0
        frames.append(max(drawn, default=np.inf) - start)
    seen["latencies"], seen["frames"] = latencies, frames


events.drive(script(), seen)
