"""Save the bundled Cornell box, its viewport looking through the camera, as the given .blend."""

import sys

import bpy

path = sys.argv[sys.argv.index("--") + 1]

others = list(bpy.data.scenes)
bpy.ops.radiosity.add_cornell_box()
scene = next(scene for scene in bpy.data.scenes if scene not in others)
bpy.context.window.scene = scene
for other in others:
    bpy.data.scenes.remove(other)
bpy.data.orphans_purge(do_recursive=True)

scene.radiosity.resolution = 128
for screen in bpy.data.screens:
    for area in screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.region_3d.view_perspective = "CAMERA"

bpy.ops.wm.save_as_mainfile(filepath=path)
