"""What Cycles shows of a baked scene at the centers of pixels, and where pixels are away from silhouettes."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from radiosity_addon.blender.datablocks.mesh_arrays import read_mesh, world_from_object
from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps
from radiosity_addon.rays.embree import EmbreeCaster

SAMPLES = 16
"""Cycles' smallest filter is a hundredth of a pixel wide, in which images with fine detail already differ."""


def rendered(folder: Path, width: int, height: int, *, lightmap_only: bool) -> np.ndarray:
    """Render the open scene, whose materials emit; (height, width, 4) float32, row 0 at the bottom."""
    show_lightmaps("lightmap" if lightmap_only else "matte")
    _decode_images()
    scene = bpy.context.scene
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
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


def _decode_images() -> None:
    """Have nodes read images of 8 bits as floats: Cycles filters encoded values, engines linear ones."""
    linear: dict[bpy.types.Image, bpy.types.Image] = {}
    trees = [material.node_tree for material in bpy.data.materials if material.node_tree]
    for node in [node for tree in (*trees, *bpy.data.node_groups) for node in tree.nodes]:
        image = node.image if node.type == "TEX_IMAGE" else None
        if image is None or image.is_float or image.colorspace_settings.name != "sRGB" or not all(image.size):
            continue
        if image not in linear:
            pixels = np.empty(len(image.pixels), dtype=np.float32)
            image.pixels.foreach_get(pixels)
            colors = pixels.reshape(-1, 4)[:, :3]
            colors[:] = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
            made = bpy.data.images.new(image.name, *image.size, alpha=True, float_buffer=True, is_data=True)
            made.alpha_mode = "CHANNEL_PACKED"
            made.pixels.foreach_set(pixels)
            made.update()
            linear[image] = made
        node.image = linear[image]


def inner_pixels(width: int, height: int) -> np.ndarray:
    """Return (height, width) where a pixel and its neighbors show one plane of one object."""
    origin, directions = _camera_rays(width, height)
    triangles, objects = _rendered_triangles()
    hits = EmbreeCaster(triangles).intersect(np.broadcast_to(origin, directions.shape), directions)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    planes = np.concatenate([objects[:, None], np.rint(100 * normals)], axis=1)
    _, label = np.unique(planes, axis=0, return_inverse=True)
    labels = np.where(hits.triangle >= 0, label.reshape(-1)[hits.triangle] + 1, 0).reshape(height, width)
    inner = labels > 0
    for rows in (-1, 0, 1):
        for columns in (-1, 0, 1):
            inner &= np.roll(labels, (rows, columns), (0, 1)) == labels
    inner[[0, -1], :] = inner[:, [0, -1]] = False
    return inner


def _camera_rays(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the camera's place (3,), and unit directions (height * width, 3) through centers of pixels."""
    scene, camera = bpy.context.scene, bpy.context.scene.camera
    corners = np.array([camera.matrix_world @ corner for corner in camera.data.view_frame(scene=scene)])
    _, lower_right, lower_left, upper_left = corners
    column = (np.arange(width) + 0.5) / width
    row = (np.arange(height) + 0.5) / height
    target = (
        lower_left
        + column[None, :, None] * (lower_right - lower_left)
        + row[:, None, None] * (upper_left - lower_left)
    )
    origin = np.array(camera.matrix_world.translation)
    along = (target - origin).reshape(-1, 3)
    return origin, along / np.linalg.norm(along, axis=1, keepdims=True)


def _rendered_triangles() -> tuple[np.ndarray, np.ndarray]:
    """Return world-space triangles (t, 3, 3) of what renders show, and the number of the object of each."""
    triangles, objects = [], []
    for number, instance in enumerate(bpy.context.evaluated_depsgraph_get().object_instances):
        obj = instance.object
        if obj.type != "MESH" or obj.original.hide_render:
            continue
        found = read_mesh(obj.data)
        if found is None:
            continue
        corners, _, _ = world_from_object(found, np.array(instance.matrix_world))
        triangles.append(corners)
        objects.append(np.full(len(corners), number))
    return np.concatenate(triangles), np.concatenate(objects)
