"""Measure how long the window stands still while a bake runs, and how long Esc takes. Writes JSON.

The 3D viewport is drawn again at every turn of the window's loop; the time between two drawings is a
frame. First without a bake, then during several, then Esc at several moments.

Usage: blender cornell.blend --enable-event-simulate --python drive_frames.py --
       ANSWER.json QUALITY RESOLUTION BAKES
"""

import importlib
import os
import sys
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events
from file_dump import differences, dump_file

QUALITY, RESOLUTION, BAKES = sys.argv[sys.argv.index("--") + 2 :]
MODULE = "bl_ext.user_default.radiosity_addon"
runtime = importlib.import_module(f"{MODULE}.blender.session.state").session

IDLE_SECONDS = 4.0
ESCAPE_AT = ("export", "unwrap", "solve", "light", "late light")
"""Stages in which Esc is pressed; "late" when nearly all of it is done."""

seen = {"bakes": [], "escapes": [], "version": bpy.app.version_string, "cores": os.cpu_count()}


class Frames:
    """Notes when the viewport was drawn, and in which stage."""

    def __init__(self):
        self.drawn = []
        self._handler = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_PIXEL")
        bpy.app.timers.register(self._again, persistent=True)
        self._on = True

    def _draw(self):
        stage = runtime.running.stage if runtime.running.active else "idle"
        self.drawn.append((time.perf_counter(), time.thread_time(), stage))

    def _again(self):
        if not self._on:
            return None
        events.region("WINDOW").tag_redraw()
        return 0.02

    def close(self):
        """Draw no more than asked for; returns each frame's stage, length and main thread's work [s]."""
        self._on = False
        bpy.types.SpaceView3D.draw_handler_remove(self._handler, "WINDOW")
        pairs = zip(self.drawn, self.drawn[1:], strict=False)
        return [(stage, after - before, end - start) for (before, start, stage), (after, end, _) in pairs]


def summary(frames):
    """Longest, 99th percentile and median frame of each stage, and the longest work in one [ms]."""
    stages = {}
    for stage, length, work in frames:
        stages.setdefault(stage, []).append((1000 * length, 1000 * work))
    told = {}
    for stage, both in stages.items():
        lengths = sorted(length for length, _ in both)
        told[stage] = {
            "longest_work_ms": round(max(work for _, work in both), 1),
            "frames": len(lengths),
            "longest_ms": round(lengths[-1], 1),
            "p99_ms": round(lengths[min(int(0.99 * len(lengths)), len(lengths) - 1)], 1),
            "median_ms": round(lengths[len(lengths) // 2], 1),
        }
    return told


def settled():
    """No bake runs any more."""
    return not runtime.running.active


def bake():
    """Press the button without looking for it."""
    with bpy.context.temp_override(
        window=events.window(), area=events.area_3d(), region=events.region("WINDOW")
    ):
        assert bpy.ops.radiosity.bake("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def reached(moment):
    """A stage, or its end, has come, or the bake is over."""
    stage = moment.rpartition(" ")[2]
    late = moment.startswith("late") and runtime.running.fraction < 0.85
    return settled() or (runtime.running.stage == stage and not late)


def escape(moment):
    """Bake, press Esc at a moment, and wait for the operator to be gone."""
    view = events.center("WINDOW")
    before = dump_file()
    bake()
    while not reached(moment):
        yield 0.0
    stage = runtime.running.stage if runtime.running.active else "over"
    pressed = time.perf_counter()
    events.window().event_simulate(type="ESC", value="PRESS", x=view[0], y=view[1])
    while not settled():
        yield 0.0
    seconds = time.perf_counter() - pressed
    events.window().event_simulate(type="ESC", value="RELEASE", x=view[0], y=view[1])
    yield 1.0
    changed = differences(before, dump_file())
    seen["escapes"].append(
        {"moment": moment, "stage": stage, "seconds": round(seconds, 3), "changed": changed}
    )


def script():
    settings = bpy.context.scene.radiosity
    settings.quality, settings.resolution = QUALITY, int(RESOLUTION)
    # Switching to the material preview compiles shaders, once, whatever is baked.
    settings.show_result = False
    # What is measured is the bake, not how fast a processor draws shadows and smooth edges.
    bpy.context.preferences.system.viewport_aa = "OFF"
    events.area_3d().spaces.active.overlay.show_overlays = False
    bpy.ops.ed.undo_push(message="Settings")
    yield from events.open_sidebar("Radiosity")
    yield from events.hover(*events.center("WINDOW"))
    yield 1.0
    frames = Frames()
    yield IDLE_SECONDS
    seen["idle"] = summary(frames.close())
    for moment in ESCAPE_AT:
        yield from escape(moment)
        yield 2.0  # for the step that ran to end
    for _ in range(int(BAKES)):
        load, frames, start = os.getloadavg()[0], Frames(), time.perf_counter()
        bake()
        yield from events.until(settled, 600)
        seconds = time.perf_counter() - start
        yield 0.5
        told = summary(frames.close())
        told.pop("idle", None)
        seen["bakes"].append({"seconds": round(seconds, 2), "load_before": round(load, 2), "stages": told})
        yield 1.0


events.drive(script(), seen)
