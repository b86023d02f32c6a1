"""Bake and export in a window, move an object, undo that, and export each time; note what is seen.

Usage: blender cornell.blend --enable-event-simulate --python drive_export.py -- ANSWER.json
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events

MODULE = "bl_ext.user_default.radiosity_addon.blender"
runtime = importlib.import_module(f"{MODULE}.session.state").session
compared = importlib.import_module(f"{MODULE}.exporting.edits_since_bake")

seen = {"reads": [], "scenes": []}
read = compared.export_steps


def counted(*words):
    seen["reads"][-1] += 1
    return read(*words)


compared.export_steps = counted


def idle():
    """No bake or export runs."""
    return not runtime.running.active


def invoke(operator):
    area, region = events.area_3d(), events.region("WINDOW")
    with bpy.context.temp_override(window=events.window(), area=area, region=region):
        operator("INVOKE_DEFAULT", True)
    yield 0.3
    yield from events.until(idle, 240)
    yield 0.3


def can_export():
    """The panel has noticed that there is something to export."""
    return bpy.ops.radiosity.export.poll()


def export():
    yield from events.until(can_export, 30)
    seen["reads"].append(0)
    yield from invoke(bpy.ops.radiosity.export)
    seen["scenes"].append([scene.name for scene in bpy.data.scenes])


def script():
    settings = bpy.context.scene.radiosity
    settings.show_result = False
    settings.resolution, settings.quality = 32, "sketch"
    settings.export_web = True
    bpy.ops.radiosity.check()  # or it would come up before the first bake
    yield from invoke(bpy.ops.radiosity.bake)
    yield from export()
    bpy.data.objects["Short Block"].location.x += 0.1
    bpy.ops.ed.undo_push(message="Moved")
    yield from export()
    yield from events.key("Z", *events.center("WINDOW"), ctrl=True)
    yield 1.0
    yield from export()
    folder = next(Path(bpy.data.filepath).parent.glob("lightmaps/*_export"))
    seen["files"] = sorted(path.name for path in folder.iterdir())


events.drive(script(), seen)
