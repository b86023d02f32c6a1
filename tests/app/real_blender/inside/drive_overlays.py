"""Bake in a window, choose each overlay in turn and photograph it; then none, Restore, and a reload.

Usage: blender cornell.blend --enable-event-simulate --python drive_overlays.py -- \\
    ANSWER.json RESOLUTION QUALITY
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import events
from file_dump import differences, dump_file

RESOLUTION, QUALITY = sys.argv[sys.argv.index("--") + 2 :]
MODULE = "bl_ext.user_default.radiosity_addon"
live_view = importlib.import_module(f"{MODULE}.blender.jobs.live_view")
kept_details = importlib.import_module(f"{MODULE}.blender.session.kept_details")
overlay_pictures = importlib.import_module(f"{MODULE}.blender.overlays.overlay_pictures")
overlay_panel = importlib.import_module(f"{MODULE}.blender.panels.overlay_panel")
runtime = importlib.import_module(f"{MODULE}.blender.session.state").session
texel_pictures = importlib.import_module(f"{MODULE}.bake.result.texel_pictures")

OVERLAYS = ("FALSE_COLOR", "DENSITY", "CHECKER", "TEXELS", "ELEMENTS", "LINKS", "ERROR")
CURSOR = (-0.6, 1.2, 0.0)
"""On the floor, in front of the blocks."""

seen = {"texels": 0, "missing": {}}


def settled():
    """No bake runs any more."""
    return not runtime.running.active


def texels_drawn():
    """A picture of texels has come."""
    return seen["texels"] > 0


def remember_texels():
    """Note the pictures of texels on their way to the screen."""
    show = live_view.show

    def showing(picture):
        seen["texels"] += hasattr(picture, "surfaces")
        show(picture)

    live_view.show = showing


def bake():
    area, region = events.area_3d(), events.region("WINDOW")
    with bpy.context.temp_override(window=events.window(), area=area, region=region):
        assert bpy.ops.radiosity.bake("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def photograph(name):
    """Take the screen once it has been drawn anew."""
    frames = []
    drawing = bpy.types.SpaceView3D.draw_handler_add(frames.append, (1,), "WINDOW", "POST_PIXEL")
    while len(frames) < 2:
        events.region("WINDOW").tag_redraw()
        yield 0.05
    bpy.types.SpaceView3D.draw_handler_remove(drawing, "WINDOW")
    events.screenshot(events.ANSWER.with_name(name))
    place, height = events.region("WINDOW"), events.window().height
    seen["viewport"] = [place.x, height - place.y - place.height, place.width, place.height]


def missing():
    """What the panel says of each overlay."""
    overlay = bpy.context.window_manager.radiosity_overlay
    told = {}
    for name in OVERLAYS:
        overlay.show = name
        told[name] = overlay_pictures.missing(bpy.context)
    overlay.show = "NONE"
    return told


class PanelAlone(bpy.types.Panel):
    """The panel in a tab of its own, where no other panel hides it."""

    bl_idname, bl_label, bl_category = "RADIOSITY_PT_alone", "Overlays", "Overlays"
    bl_space_type, bl_region_type = "VIEW_3D", "UI"

    def draw(self, context):
        overlay_panel.OverlaySection.draw(self.layout, context)


def every_panel(overlay):
    """Have the panel drawn with each overlay."""
    bpy.utils.register_class(PanelAlone)
    yield from events.open_sidebar("Overlays")
    drawn = []
    light_on_active = overlay_panel.light_on_active

    def drawing(context):
        drawn.append(context.active_object.name)
        return light_on_active(context)

    overlay_panel.light_on_active = drawing
    for name in OVERLAYS[::-1]:
        overlay.show = name
        yield 0.2
    yield from photograph("overlay-panel.png")
    seen["statistics_of"] = drawn
    overlay_panel.light_on_active = light_on_active
    overlay.show = "NONE"
    events.area_3d().spaces.active.show_region_ui = False
    bpy.utils.unregister_class(PanelAlone)
    yield 0.3


def script():
    view = events.center("WINDOW")
    scene = bpy.context.scene
    scene.radiosity.show_result = False
    scene.radiosity.quality = QUALITY
    scene.radiosity.resolution = int(RESOLUTION)
    bpy.context.view_layer.objects.active = bpy.data.objects["Floor"]
    scene.cursor.location = CURSOR
    bpy.ops.ed.undo_push(message="Settings")
    events.area_3d().spaces.active.show_region_toolbar = False
    yield from events.hover(*view)
    yield 1.0
    seen["missing"]["before"] = missing()
    yield from photograph("overlay-before.png")
    before = dump_file()

    bake()
    yield from events.until(texels_drawn, 300)
    yield from photograph("overlay-live.png")
    yield from events.until(settled, 300)
    yield 0.5
    yield from photograph("overlay-none.png")
    seen["missing"]["baked"] = missing()
    overlay = bpy.context.window_manager.radiosity_overlay
    for name in OVERLAYS:
        overlay.show = name
        yield 0.2
        yield from photograph(f"overlay-{name.lower()}.png")
    overlay.show = "NONE"
    yield from photograph("overlay-again.png")
    yield from every_panel(overlay)

    overlay.show = "FALSE_COLOR"
    path = events.ANSWER.with_name("baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    yield 1.0
    seen["missing"]["reloaded"] = missing()
    bpy.context.window_manager.radiosity_overlay.show = "FALSE_COLOR"
    yield 0.2
    yield from photograph("overlay-reloaded.png")
    bpy.context.window_manager.radiosity_overlay.show = "NONE"

    bpy.ops.radiosity.restore()
    yield 0.5
    seen["missing"]["restored"] = missing()
    seen["kept"] = kept_details.details_of(bpy.context.scene) is not None
    yield from photograph("overlay-restored.png")
    seen["after_restore"] = differences(before, dump_file())


bpy.context.preferences.system.viewport_aa = "OFF"
texel_pictures.SECONDS = 0.0
texel_pictures.SHARE = 1.0
remember_texels()
events.drive(script(), seen)
