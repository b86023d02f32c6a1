"""Writes `baked_by_0_1.blend`: run it with the code of commit d331b48 on the path, and the file's path."""

from __future__ import annotations

import os
import sys

import bpy

import radiosity_addon
from radiosity_addon.blender.apply import rebake
from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material

radiosity_addon.register()
bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
link = bpy.context.scene.collection.objects.link

own = add_plane("Own", principled_material(name="Paint"))
for layer in ("UVMap", "Lightmap"):
    own.data.uv_layers.new(name=layer)
own.data.uv_layers["Lightmap"].uv[0].vector = (0.25, 0.75)
edited = add_plane("Edited", principled_material(name="Edited Paint"))
edited.location.x = 3
shared = add_plane("Shared", bpy.data.materials["Paint"])
shared.location.x = 6
twin = bpy.data.objects.new("Twin", shared.data)
twin.location.x = 9
link(twin)
twin.material_slots[0].link = "OBJECT"
twin.material_slots[0].material = principled_material(name="Of Twin")
solid = add_plane("Solid", bpy.data.materials["Paint"])
solid.location.x = 12
solid.modifiers.new("Solidify", "SOLIDIFY")
solid.modifiers.new("Off", "BEVEL").show_viewport = False
group, part = bpy.data.collections.new("Group"), add_plane("Part")
bpy.context.scene.collection.objects.unlink(part)
group.objects.link(part)
here = bpy.data.objects.new("Here", None)
here.instance_type, here.instance_collection, here.location.y = "COLLECTION", group, 5
link(here)

bake_by_hand()
rebake.seal()
edited.data.vertices[0].co.z = 0.5
edited.data.attributes.new("Tint", "FLOAT", "POINT")
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1], compress=True)
sys.stdout.flush()
os._exit(0)
