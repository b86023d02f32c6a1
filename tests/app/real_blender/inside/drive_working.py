"""Work with the panel as the guide tells: presets, the check that comes by itself, a bake, Esc; take photos.

Usage: blender cornell.blend --enable-event-simulate --python drive_working.py -- ANSWER.json
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events
from file_dump import differences, dump_file

MODULE = "bl_ext.user_default.radiosity_addon"
HEADER = 34  # pixels at the sidebar's top: the panel's title, which a click would fold

checks = importlib.import_module(f"{MODULE}.blender.operators.checks")
runtime = importlib.import_module(f"{MODULE}.blender.session.state").session

seen = {}


def looked():
    """Somebody has looked at the scene."""
    return checks.last_check(bpy.context.scene) is not None


def baking():
    """A bake runs as a modal operator."""
    return runtime.running.active


def not_baking():
    """The bake has ended."""
    return not baking()


def time_told():
    """The time left is told, or the bake is over."""
    return not baking() or runtime.running.seconds_left is not None


def photograph(name, part):
    """Take a part of the screen: x, y from the top left, width, height."""
    yield 0.7
    events.screenshot(events.ANSWER.with_name(f"working-{name}.png"), part)


def script():
    view = events.center("WINDOW")
    yield from events.open_sidebar("Radiosity")
    sidebar = events.region("UI")
    beside = (sidebar.x - 10, 80, sidebar.width + 20, 380)
    yield from photograph("panel", beside)

    yield from events.hover(*view)
    override = {"window": events.window(), "area": events.area_3d(), "region": events.region("WINDOW")}
    with bpy.context.temp_override(**override):
        bpy.ops.wm.call_panel(name="RADIOSITY_PT_presets", keep_open=True)
    yield from photograph("presets", (view[0] - 130, 800 - view[1] - 60, 260, 170))
    yield from events.key("ESC", *view)

    # Something odd: a block that renders show and the viewport does not, and one that is hardly there.
    bpy.data.objects["Tall Block"].hide_set(True)
    bpy.data.objects["Short Block"].radiosity_texel_scale = 0.02
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.show_result = 256, False
    bpy.ops.ed.undo_push(message="Odd")
    before = dump_file()
    bake_button = yield from events.click_down(HEADER, looked)
    yield from photograph("check", (440, 40, 600, 420))
    seen["baked_unlooked"] = baking()
    seen["findings"] = [finding.message for finding in checks.last_check(bpy.context.scene).findings]
    yield from events.key("ESC", *view)
    yield 0.3
    seen["after_check"] = differences(before, dump_file())

    sidebar = events.region("UI")
    x, y = sidebar.x + sidebar.width // 2, sidebar.y + sidebar.height - bake_button
    yield from events.click(x, y)
    seen["baking_after_check"] = baking()
    yield from events.until(time_told, 120)
    seen["seconds_left"] = runtime.running.seconds_left
    yield from photograph("progress", (beside[0], 80, beside[2], 160))
    yield from events.key("ESC", *view)
    yield from events.until(not_baking, 30)
    yield 0.5
    seen["after_escape"] = differences(before, dump_file())


events.drive(script(), seen)
