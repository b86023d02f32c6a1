"""Work the panel as a user does: Bake, undo, bake and Esc, bake and Restore. Writes what was seen.

Usage: blender cornell.blend --enable-event-simulate --python drive_panel.py -- ANSWER.json
"""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events
from file_dump import differences, dump_file

MODULE = "bl_ext.user_default.radiosity_addon"
HEADER = 34  # pixels at the sidebar's top: the panel's title, which a click would fold

seen = {}


def baking():
    """A bake runs as a modal operator."""
    return any(operator.bl_idname == "RADIOSITY_OT_bake" for operator in events.window().modal_operators)


def not_baking():
    """The modal operator has ended."""
    return not baking()


def lit_objects():
    """Names of the objects with a UV layer Lightmap."""
    return sorted(
        obj.name for obj in bpy.data.objects if obj.type == "MESH" and "Lightmap" in obj.data.uv_layers
    )


def script():
    view = events.center("WINDOW")
    bpy.context.scene.radiosity.quality = "sketch"
    bpy.ops.ed.undo_push(message="Settings")
    yield from events.open_sidebar("Radiosity")
    events.screenshot(events.ANSWER.with_name("panel-before.png"))
    before = dump_file()
    seen["objects"] = sorted(obj.name for obj in bpy.data.objects if obj.type == "MESH")

    bake_button = yield from events.click_down(HEADER, baking)
    seen["modal"] = True
    yield 0.5  # for the progress bar to be drawn
    events.screenshot(events.ANSWER.with_name("panel-baking.png"))
    seen["asked_while_baking"], seen["longest_wait"] = yield from events.until(not_baking, 120)
    seen["lit"] = lit_objects()
    seen["images"] = [image.name for image in bpy.data.images if image.has_data or image.packed_file]
    yield from redrawn()
    seen["shading"] = events.area_3d().spaces.active.shading.type
    events.screenshot(events.ANSWER.with_name("panel.png"))
    events.area_3d().spaces.active.shading.type = "SOLID"
    yield from redrawn()

    yield from events.key("Z", *view, ctrl=True)
    yield 0.5
    seen["after_undo"] = differences(before, dump_file())
    yield from events.key("Z", *view, ctrl=True, shift=True)
    yield 0.5
    seen["lit_after_redo"] = lit_objects()
    yield from events.key("Z", *view, ctrl=True)
    yield 0.5

    # The preview has been seen; without a graphics card each of its frames takes a second.
    bpy.context.scene.radiosity.show_result = False
    bpy.ops.ed.undo_push(message="Show no result")
    before = dump_file()
    sidebar = events.region("UI")
    x, y = sidebar.x + sidebar.width // 2, sidebar.y + sidebar.height - bake_button
    yield from events.click(x, y)
    seen["baking_before_escape"] = baking()
    yield from events.key("ESC", *view)
    yield from events.until(not_baking, 30)
    seen["after_escape"] = differences(before, dump_file())

    yield from events.click(x, y)
    yield from events.until(not_baking, 120)
    seen["lit_before_restore"] = lit_objects()
    # Below the result of the check and the buttons of scope and size, at the left: labels there do nothing,
    # and headers only unfold.
    distance = bake_button + 124
    while lit_objects() and distance < sidebar.height - 20:
        distance += 6
        yield from events.click(sidebar.x + 30, y + bake_button - distance)
    yield 0.5
    seen["after_restore"] = differences(before, dump_file())
    events.screenshot(events.ANSWER.with_name("panel-restored.png"))


def redrawn():
    """Let the viewport finish: the first time its shaders have to be compiled."""
    events.area_3d().tag_redraw()
    yield 1.0
    yield 1.0
    yield 1.0


events.drive(script(), seen)
