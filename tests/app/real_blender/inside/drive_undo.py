"""Bake twice, relight and restore; undo and redo that in several orders; edit stand-ins; note what is seen.

Usage: blender cornell.blend --enable-event-simulate --python drive_undo.py -- ANSWER.json
"""

import hashlib
import importlib
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import events

MODULE = "bl_ext.user_default.radiosity_addon.blender"
STEPS = [-1, -1, 1, 1, -1, -1, -1, 1, -1, -1, 1, 1, 1, 1]
"""Undo and redo, one after the other, from the last of five states on."""

runtime = importlib.import_module(f"{MODULE}.session.state").session
versions = importlib.import_module(f"{MODULE}.relight.lightmap_versions")

seen = {"walk": []}


def idle():
    """No bake or relight runs, and no file is on its way."""
    return not runtime.running.active and not versions.is_at_work()


def invoke(operator):
    area, region = events.area_3d(), events.region("WINDOW")
    with bpy.context.temp_override(window=events.window(), area=area, region=region):
        operator("INVOKE_DEFAULT", True)  # an undo step, as if a button had been pressed
    yield 0.3
    yield from events.until(idle, 240)
    yield 0.3


def digest(values):
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()[:12]


def layers():
    """Digest of all UV layers Lightmap; None if there are none."""
    found = []
    for obj in sorted(bpy.data.objects, key=lambda obj: obj.name):
        if obj.type == "MESH" and "Lightmap" in obj.data.uv_layers:
            values = np.empty((len(obj.data.loops), 2), dtype=np.float32)
            obj.data.attributes["Lightmap"].data.foreach_get("vector", values.ravel())
            found.append(values)
    return digest(np.concatenate(found)) if found else None


def picture():
    """Digests of the lightmap's pixels as they are shown, and of its file; None if there is none."""
    shown = [image for image in bpy.data.images if "radiosity_version" in image]
    if not shown:
        return None
    (image,) = shown
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return [
        digest(pixels),
        hashlib.sha256(Path(bpy.path.abspath(image.filepath)).read_bytes()).hexdigest()[:12],
    ]


def state():
    return [layers(), picture()]


def hit(*keys, **modifiers):
    yield from events.key(*keys, *events.center("WINDOW"), **modifiers)
    yield 0.7
    yield from events.until(idle, 60)
    yield 0.3


def script():
    settings = bpy.context.scene.radiosity
    settings.show_result = False
    settings.resolution, settings.quality = 32, "sketch"
    stand_ins()
    bpy.ops.radiosity.check()  # or it would come up before the first bake
    bpy.ops.ed.undo_push(message="Before")

    states = [state()]
    yield from invoke(bpy.ops.radiosity.bake)
    states.append(state())
    # One undo step each: what is set here is part of the operator's.
    bpy.context.scene.radiosity.resolution = 48
    yield from invoke(bpy.ops.radiosity.bake)
    states.append(state())
    bpy.data.objects["Lamp"].data.energy *= 0.5
    yield from invoke(bpy.ops.radiosity.relight)
    states.append(state())
    yield from invoke(bpy.ops.radiosity.restore)
    states.append(state())
    seen["states"] = states

    place = len(states) - 1
    for step in STEPS:
        yield from hit("Z", ctrl=True, shift=step > 0)
        place += step
        seen["walk"].append([place, state()])

    # From the restored state two steps back, saved and opened again.
    for _ in range(2):
        yield from hit("Z", ctrl=True)
    seen["before_saving"] = state()
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    yield 1.0
    yield from events.until(idle, 60)
    seen["opened"] = state()

    yield from guard()


def stand_ins():
    """Give an object a modifier that makes other polygons, and the scene an instance."""
    bpy.data.objects["Short Block"].modifiers.new("Bevel", "BEVEL").width = 0.01
    collection = bpy.data.collections.new("Instanced")
    mesh = bpy.data.meshes.new("Leaf")
    mesh.from_pydata([(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0), (0, 0.1, 0)], [], [(0, 1, 2, 3)])
    collection.objects.link(bpy.data.objects.new("Leaf", mesh))
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    empty.location = 0.2, -0.2, 0.3
    bpy.context.scene.collection.objects.link(empty)


def refused():
    """The edit mode of a stand-in was left."""
    return bpy.data.objects["Short Block"].mode == "OBJECT"


def guard():
    """Edit what stands in for the results of modifiers and instances."""
    if layers() is None:
        yield from invoke(bpy.ops.radiosity.bake)
    baked = layers()
    block = bpy.data.objects["Short Block"]
    block.select_set(True)
    bpy.context.view_layer.objects.active = block
    with bpy.context.temp_override(
        window=events.window(), area=events.area_3d(), region=events.region("WINDOW")
    ):
        bpy.ops.object.mode_set(mode="EDIT")
        seen["entered"] = block.mode
    yield from events.until(refused, 20)
    yield 0.5
    events.screenshot(events.ANSWER.with_name("undo-guard.png"))
    stand_in = bpy.data.objects["Empty/Leaf (Lightmap)"]
    before = [list(row) for row in stand_in.matrix_basis]
    stand_in.location.x += 1.0

    def back():
        """The stand-in is at its place again."""
        return [list(row) for row in bpy.data.objects["Empty/Leaf (Lightmap)"].matrix_basis] == before

    assert not back()
    yield from events.until(back, 20)
    seen["same_layers"] = layers() == baked


events.drive(script(), seen)
