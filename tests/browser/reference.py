"""What Cycles shows of a baked scene at the centers of pixels, and where pixels are away from silhouettes."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps


def rendered(folder: Path, width: int, height: int, *, lightmap_only: bool) -> np.ndarray:
    """Render the open scene, whose materials emit; (height, width, 4) float32, row 0 at the bottom."""
    show_lightmaps("lightmap" if lightmap_only else "matte")
    scene = bpy.context.scene
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 1, False, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    scene.cycles.max_bounces = 8
    render.film_transparent = True
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.image_settings.color_mode = "RGBA"
    render.use_compositing = render.use_sequencer = False
    render.filepath = str(folder / f"reference_{lightmap_only}.exr")
    for lamp in [obj for obj in scene.objects if obj.type == "LIGHT"]:
        lamp.hide_render = True
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def inner_pixels(width: int, height: int) -> np.ndarray:
    """Return (height, width) where a pixel and its neighbors show one plane of one object."""
    scene, camera = bpy.context.scene, bpy.context.scene.camera
    graph = bpy.context.evaluated_depsgraph_get()
    corners = np.array([camera.matrix_world @ corner for corner in camera.data.view_frame(scene=scene)])
    right, _, left, upper_left = corners[0], corners[1], corners[2], corners[3]
    origin = camera.matrix_world.translation
    lower_right = corners[1]
    across, up = (lower_right - left), (upper_left - left)
    del right
    labels = np.zeros((height, width), dtype=np.int64)
    known: dict[tuple[str, tuple[float, ...]], int] = {}
    for row in range(height):
        for column in range(width):
            target = left + across * ((column + 0.5) / width) + up * ((row + 0.5) / height)
            hit, _, normal, _, obj, _ = scene.ray_cast(graph, origin, type(origin)(target) - origin)
            if hit:
                key = obj.name, tuple(round(value, 2) for value in normal)
                labels[row, column] = known.setdefault(key, len(known) + 1)
    inner = labels > 0
    for rows in (-1, 0, 1):
        for columns in (-1, 0, 1):
            inner &= np.roll(labels, (rows, columns), (0, 1)) == labels
    inner[[0, -1], :] = inner[:, [0, -1]] = False
    return inner
