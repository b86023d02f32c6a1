"""Instanced trees on a ground: what `--pack rectangles` is for."""

from __future__ import annotations

import math

import bpy
import numpy as np

from tests.app.conftest import painted


def build_trees(count: int) -> None:
    """Add a ground with trees of two materials, turned and scaled, a lamp and a camera."""
    side = math.isqrt(count)
    bpy.ops.mesh.primitive_plane_add(size=2 * side + 2)
    bpy.context.object.name = "Ground"
    bpy.ops.mesh.primitive_cone_add(vertices=6, radius1=0.8, depth=2)
    tree = bpy.context.object
    tree.data.materials.append(painted("Leaves", (0.1, 0.5, 0.1, 1)))
    tree.data.materials.append(painted("Bark", (0.3, 0.2, 0.1, 1)))
    for polygon in tree.data.polygons[:3]:
        polygon.material_index = 1
    rng = np.random.default_rng(4)
    for number in range(count):
        obj = tree if number == 0 else bpy.data.objects.new("Tree", tree.data)
        if number:
            bpy.context.scene.collection.objects.link(obj)
        obj.name = f"Tree {number}"
        obj.location = (2 * (number % side) - side + 1, 2 * (number // side) - side + 1, 1)
        obj.rotation_euler = (0, 0, rng.uniform(0, 6))
        obj.scale = (rng.uniform(0.8, 1.1),) * 3
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "SUN"))
    lamp.data.energy, lamp.rotation_euler = 3.0, (0.6, 0.3, 0)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -2.6 * side, 2.2 * side), (0.85, 0, 0)
    for obj in (lamp, camera):
        bpy.context.scene.collection.objects.link(obj)
    scene = bpy.context.scene
    scene.camera, scene.render.resolution_x, scene.render.resolution_y = camera, 320, 240
    scene.world = bpy.data.worlds.new("Sky")
    scene.world.color = (0.3, 0.4, 0.5)
