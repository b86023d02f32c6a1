"""Mouse and key events for a script that drives Blender's window, and where to aim them.

The scripts are generators: each `yield SECONDS` gives the window time to handle what was sent.
References to Blender's data do not outlive an undo, so everything here looks it up anew.
"""

import json
import subprocess
import sys
import time
import traceback
from pathlib import Path

import bpy

PAUSE = 0.08

ANSWER = Path(sys.argv[sys.argv.index("--") + 1])
"""File for what a script has seen; its pictures go beside it, called alike."""


def window():
    return bpy.context.window_manager.windows[0]


def area_3d():
    return next(area for area in window().screen.areas if area.type == "VIEW_3D")


def region(kind):
    return next(region for region in area_3d().regions if region.type == kind)


def center(kind):
    place = region(kind)
    return place.x + place.width // 2, place.y + place.height // 2


def hover(x, y):
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    yield PAUSE


def click(x, y):
    yield from hover(x, y)
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(type="LEFTMOUSE", value=value, x=x, y=y)
        yield PAUSE


def key(kind, x, y, **modifiers):
    yield from hover(x, y)
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(type=kind, value=value, x=x, y=y, **modifiers)
        yield PAUSE


def open_sidebar(category):
    """Show the sidebar of the 3D viewport on one of its tabs."""
    area_3d().spaces.active.show_region_ui = True
    yield 0.5
    region("UI").active_panel_category = category
    area_3d().tag_redraw()
    yield 0.5


def click_down(below, happened):
    """Click at the sidebar in steps downwards until `happened()`; returns how far below its top.

    A button is not to be found by name, only by what it does.
    """
    sidebar = region("UI")
    x, top, height = sidebar.x + sidebar.width // 2, sidebar.y + sidebar.height, sidebar.height
    for distance in range(below, height, 6):
        yield from click(x, top - distance)
        if happened():
            return distance
    raise AssertionError(f"no click in the sidebar, {below} to {height} px below its top, did it")


def until(happened, seconds):
    """Wait for `happened()`; returns how many times it was asked, and the longest time between two."""
    start = before = time.monotonic()
    asked, longest = 0, 0.0
    while not happened():
        assert before - start < seconds, f"not within {seconds} s: {happened.__doc__}"
        yield 0.05
        now = time.monotonic()
        asked, longest, before = asked + 1, max(longest, now - before), now
    return asked, longest


def screenshot(path, part=None):
    """Picture of the whole screen, or a part of it: x, y from the top left, width and height.

    Blender's own operator knows only what was drawn already.
    """
    crop = ["-crop", "{2}x{3}+{0}+{1}".format(*part), "+repage"] if part else []
    subprocess.run(["import", "-window", "root", *crop, str(path)], check=True)


def first_frame(kind):
    """Have the window drawn once, as it is after a change of what its region of this kind shows."""
    with bpy.context.temp_override(window=window(), area=area_3d(), region=region(kind)):
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)


def drive(script, seen):
    """Run the generator `script` on a timer, write what it has seen, or its failure, as JSON and quit."""

    def tick():
        try:
            return next(script)
        except StopIteration:
            seen["failure"] = None
        except Exception:  # noqa: BLE001  (whatever it is, the test has to hear of it)
            seen["failure"] = traceback.format_exc()
            screenshot(ANSWER.with_name(f"{ANSWER.stem}-failure.png"))
        ANSWER.write_text(json.dumps(seen, indent=1))
        bpy.ops.wm.quit_blender()
        return None

    bpy.context.preferences.view.show_splash = False
    # Persistent, for undo and opening files take other timers away.
    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
