"""Bake by shooting in a window and watch the viewport brighten; then Esc, another file, switched off.

Every shot gives a picture. The solver waits before some of them until those so far were photographed:
what is on the photographs does not depend on how fast the machine is.

Usage: blender cornell.blend --enable-event-simulate --python drive_live_view.py -- ANSWER.json
"""

import importlib
import sys
import threading
import time
from pathlib import Path

import addon_utils
import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import events
from file_dump import differences, dump_file

FILE = bpy.data.filepath
MODULE = "bl_ext.user_default.radiosity_addon"
live_view = importlib.import_module(f"{MODULE}.blender.jobs.live_view")
pipeline = importlib.import_module(f"{MODULE}.bake.pipeline")
runtime = importlib.import_module(f"{MODULE}.blender.session.state").session

seen = {"pictures": [], "shots": []}


SHOTS = 30
SECONDS_A_PICTURE = 0.2
PHOTOGRAPHED = (2, 5, 12, 20, 28)
"""How many pictures there are when a photograph is taken: the first is dark."""


class Turns:
    """Lets the solver, in its thread, and the photographer, in the window's, take turns."""

    def __init__(self):
        self.made = 0
        self.go_on = threading.Event()
        self.watched = True

    def next_picture(self):
        """Wait, in the solver's thread, until the next picture may be made."""
        if self.watched and self.made in PHOTOGRAPHED:
            self.go_on.wait(60)
        self.go_on.clear()
        self.made += 1

    def ready(self):
        """The solver waits, and its pictures have all come to the window."""
        return self.made in PHOTOGRAPHED and len(seen["pictures"]) >= self.made

    def taken(self):
        """The solver goes on."""
        return not self.ready()


turns = Turns()


def slow_down():
    """Give everybody time to look at every shot."""
    picture = pipeline.Picture

    def slowly(*arrays):
        turns.next_picture()
        time.sleep(SECONDS_A_PICTURE)
        return picture(*arrays)

    pipeline.Picture = slowly
    pipeline.PICTURE_SECONDS = 0.0


def remember_pictures():
    """Note how much light is in every picture of elements on its way to the screen."""
    show = live_view.show

    def showing(picture):
        if hasattr(picture, "corners"):
            one, other = (picture.corners[:, corner] - picture.corners[:, 0] for corner in (1, 2))
            area = np.linalg.norm(np.cross(one, other), axis=1) / 2
            seen["pictures"].append(float(area @ picture.radiosity.sum(axis=1)))
        show(picture)

    live_view.show = showing


def settled():
    """No bake runs any more."""
    return not runtime.running.active


def pictured():
    """A picture with light in it has come since: black ones are not drawn."""
    return any(light > 0 for light in seen["pictures"])


def bake():
    """Press the button without looking for it."""
    area = events.area_3d()
    seen["pictures"].clear()
    region = events.region("WINDOW")
    with bpy.context.temp_override(window=events.window(), area=area, region=region):
        assert bpy.ops.radiosity.bake("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def photograph(name):
    """Take the screen once it has been drawn anew; where the viewport is on it is the same all along."""
    frames = []
    drawing = bpy.types.SpaceView3D.draw_handler_add(frames.append, (1,), "WINDOW", "POST_PIXEL")
    while len(frames) < 2:
        events.region("WINDOW").tag_redraw()
        yield 0.05
    bpy.types.SpaceView3D.draw_handler_remove(drawing, "WINDOW")
    events.screenshot(events.ANSWER.with_name(name))
    place, height = events.region("WINDOW"), events.window().height
    seen["viewport"] = [place.x, height - place.y - place.height, place.width, place.height]


def script():
    view = events.center("WINDOW")
    settings = bpy.context.scene.radiosity
    settings.method = "shooting"
    settings.elements = 400
    settings.max_iterations = SHOTS
    settings.show_result = False
    bpy.ops.ed.undo_push(message="Settings")
    events.area_3d().spaces.active.show_region_toolbar = False
    yield from events.hover(*view)
    yield 1.0
    yield from photograph("live-before.png")
    before = dump_file()

    bake()
    for number in range(len(PHOTOGRAPHED)):
        yield from events.until(turns.ready, 60)
        name = f"live-{number:02d}.png"
        yield from photograph(name)
        seen["shots"].append(name)
        turns.go_on.set()
        yield from events.until(turns.taken, 60)
    turns.watched = False
    yield from events.until(settled, 120)
    seen["brightening"] = list(seen["pictures"])
    seen["active_after_finish"] = live_view.is_active()
    yield from events.key("Z", *view, ctrl=True)
    yield 1.0
    seen["after_undo"] = differences(before, dump_file())
    yield from photograph("live-undone.png")

    bake()
    yield from events.until(pictured, 60)
    seen["active_before_escape"] = live_view.is_active()
    yield from events.key("ESC", *view)
    yield from events.until(settled, 30)
    yield 1.0
    seen["active_after_escape"] = live_view.is_active()
    seen["after_escape"] = differences(before, dump_file())
    yield from photograph("live-escaped.png")

    bpy.context.scene.radiosity.show_while_solving = False
    bake()
    seen["active_when_not_wanted"] = live_view.is_active()
    yield from events.key("ESC", *view)
    yield from events.until(settled, 30)
    bpy.context.scene.radiosity.show_while_solving = True

    bake()
    yield from events.until(pictured, 60)
    bpy.ops.wm.open_mainfile(filepath=FILE)
    yield 1.0
    seen["active_after_opening"] = live_view.is_active()
    seen["running_after_opening"] = runtime.running.active

    bake()
    yield from events.until(pictured, 60)
    addon_utils.disable(MODULE)
    yield from events.hover(*events.center("WINDOW"))
    yield 1.0
    seen["active_when_switched_off"] = live_view.is_active()
    seen["running_when_switched_off"] = runtime.running.active
    seen["operators_when_switched_off"] = len(events.window().modal_operators)


# Edges would go on changing for a while after anything else.
bpy.context.preferences.system.viewport_aa = "OFF"
slow_down()
remember_pictures()
events.drive(script(), seen)
