"""Bake from the check's dialog, with another add-on's timer and a second window that edits; take photos.

Usage: blender cornell.blend --enable-event-simulate --python drive_manners.py -- ANSWER.json
"""

import hashlib
import importlib
import json
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events
from file_dump import differences, dump_file

MODULE = "bl_ext.user_default.radiosity_addon"

cleaning = importlib.import_module(f"{MODULE}.blender.operators.cleaning")
staging = importlib.import_module(f"{MODULE}.publishing.publish")
last_bake = importlib.import_module(f"{MODULE}.blender.session.last_bake")
runtime = importlib.import_module(f"{MODULE}.blender.session.state").session
window_job = importlib.import_module(f"{MODULE}.blender.jobs.window_job")

CORNER = 0.0625  # where an edit puts a corner

seen = {"foreign_ticks": 0, "advanced": 0}


class FOREIGN_OT_ticking(bpy.types.Operator):  # noqa: N801 (Blender's convention)
    """A modal operator of somebody else, with a fast timer in the same window."""

    bl_idname = "wm.foreign_ticking"
    bl_label = "Ticking"

    def invoke(self, context, _event):
        self.timer = context.window_manager.event_timer_add(0.001, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "TIMER":
            seen["foreign_ticks"] += 1
            if seen.get("stop"):
                context.window_manager.event_timer_remove(self.timer)
                return {"CANCELLED"}
        return {"PASS_THROUGH"}


progress_text = window_job.progress_text


def counted(running):
    seen["advanced"] += 1
    return progress_text(running)


window_job.progress_text = counted


def baking():
    """A bake runs as a modal operator."""
    return runtime.running.active


def not_baking():
    """The bake has ended."""
    return not baking()


def solving():
    """The bake is past its export."""
    return not baking() or runtime.running.stage in {"solve", "light"}


def override(window):
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def invoke(operator, window=None):
    with override(window or events.window()):
        operator("INVOKE_DEFAULT")


def photograph(name):
    yield 0.7
    events.screenshot(events.ANSWER.with_name(f"manners-{name}.png"))


def script():
    view = events.center("WINDOW")
    settings = bpy.context.scene.radiosity
    settings.show_result = False
    yield from events.open_sidebar("Radiosity")
    bpy.context.view_layer.objects.active = bpy.data.objects["Floor"]
    yield from photograph("before")
    # Its own settings, in the panel Active Object below the folder.
    sidebar = events.region("UI")
    yield from events.click(sidebar.x + 70, 800 - 372)
    yield from photograph("object")
    yield from events.click(sidebar.x + 70, 800 - 372)

    # The check's dialog: its button bakes, and it closes.
    bpy.data.objects["Short Block"].radiosity_texel_scale = 0.02
    yield from events.hover(*view)
    invoke(bpy.ops.radiosity.check)
    yield from photograph("check")
    yield from events.key("RET", *view)
    seen["baking_from_dialog"] = baking() or last_bake.read(bpy.context.scene) is not None
    yield from photograph("dialog-closed")
    yield from events.until(not_baking, 120)
    yield from photograph("after")
    seen["lit"] = last_bake.read(bpy.context.scene) is not None
    yield from scroll("down")
    yield from photograph("below")
    yield from scroll("up")
    engine = bpy.context.scene.render.engine
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    yield from photograph("workbench")
    bpy.context.scene.render.engine = engine
    yield from recover()

    # Somebody else's timer does not carry it on, and is not kept from its owner.
    bpy.utils.register_class(FOREIGN_OT_ticking)
    settings.resolution = 256
    invoke(bpy.ops.wm.foreign_ticking)
    yield 0.3
    seen["foreign_ticks"] = seen["advanced"] = 0
    invoke(bpy.ops.radiosity.bake)
    yield 1.0
    seen["ticks"] = [seen["foreign_ticks"], seen["advanced"]]
    yield from events.key("ESC", *view)
    seen["stop"] = True
    yield from events.until(not_baking, 30)
    yield 0.3

    # A second window: what is done there while the first one bakes.
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality = 64, "sketch"
    for name, edit in (("edited", move_corner), ("deleted", delete), ("undone", undo), ("closed", close)):
        yield from second_window()
        yield from bake_and(name, edit, events.window())
    # The window that bakes is closed; the other one stays.
    yield from second_window()
    yield from bake_and("closed_itself", close, bpy.context.window_manager.windows[-1])


def scroll(way):
    """Move the sidebar by pages, to its end."""
    with bpy.context.temp_override(window=events.window(), area=events.area_3d(), region=events.region("UI")):
        for _ in range(3):
            getattr(bpy.ops.view2d, f"scroll_{way}")(page=True)
    yield 0.3


def recover():
    """Leave the folder as a bake that is killed while it replaces its files, and recover."""
    (lightmap,) = Path(bpy.data.filepath).with_name("lightmaps").glob("*lightmap.exr")
    good = lightmap.read_bytes()
    folder = staging.Staging(lightmap.parent)
    (folder.path / staging.EARLIER).mkdir()
    (folder.path / staging.EARLIER / lightmap.name).write_bytes(good)
    lightmap.write_bytes(b"new")
    digests = {"new": hashlib.sha256(b"new").hexdigest(), "old": hashlib.sha256(good).hexdigest()}
    told = {"version": 2, "files": {lightmap.name: digests}}
    (folder.path / staging.JOURNAL).write_text(json.dumps(told))
    folder.release()
    cleaning.look_for_interrupted(bpy.context)
    yield from photograph("recover")
    seen["interrupted"] = runtime.interrupted
    invoke(bpy.ops.radiosity.recover)
    yield from photograph("recovered")
    seen["recovered"] = not runtime.interrupted and lightmap.read_bytes() == good


def second_window():
    """Open one unless there is one, and start from the originals."""
    invoke(bpy.ops.radiosity.restore)
    yield 0.3
    bpy.ops.ed.undo_push(message="Before")
    if len(bpy.context.window_manager.windows) < 2:
        with override(events.window()):
            bpy.ops.wm.window_new()
        yield 0.7
    seen["windows"] = len(bpy.context.window_manager.windows)


def bake_and(name, edit, window):
    """Bake in a window, and have the second one do something once the scene is read."""
    before = dump_file()
    invoke(bpy.ops.radiosity.bake, window)
    yield from events.until(solving, 60)
    told = seen[name] = {"while_baking": baking()}
    edit(bpy.context.window_manager.windows[-1])
    yield from events.until(not_baking, 120)
    yield 0.5
    after = dump_file()
    told["changed"] = [line for line in differences(before, after) if "/window_managers" not in line]
    told["shows"] = sorted(obj.name for obj in bpy.data.objects if obj.type == "MESH")
    told["lit"] = sorted(
        obj.name for obj in bpy.data.objects if obj.type == "MESH" and "Lightmap" in obj.data.uv_layers
    )
    told["windows"] = len(bpy.context.window_manager.windows)
    if "Tall Block" in told["shows"]:
        told["corner"] = bpy.data.objects["Tall Block"].data.vertices[0].co.z


def move_corner(window):
    with override(window):
        mesh = bpy.data.objects["Tall Block"].data
        mesh.vertices[0].co.z = CORNER
        mesh.update()
        bpy.ops.ed.undo_push(message="Move")


def delete(window):
    with override(window):
        bpy.data.objects.remove(bpy.data.objects["Tall Block"])
        bpy.ops.ed.undo_push(message="Delete")


def undo(window):
    with override(window):
        bpy.ops.ed.undo()


def close(window):
    with override(window):
        bpy.ops.wm.window_close()


events.drive(script(), seen)
