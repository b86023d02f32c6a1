"""A view of a row: what has a lightmap shows it, and everything else stands in Cycles' own light."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from radiosity_addon.blender.datablocks.png import render_png
from radiosity_addon.scene.bake_scene import LIGHTMAP_UV_LAYER
from tests.golden.rows.stage import emptied_nodes

SIZE = (168, 128)
"""Width and height [pixels]."""

SAMPLES = 64

EYE, TARGET, ANGLE = Vector((1.75, -5.6, 3.4)), Vector((0.0, 0.1, 0.72)), math.radians(41)
"""On the stage [m]."""

HIDDEN = 0.99
"""A layout from here on is a corner of the page without a texel's center (`rows.materials.NOWHERE`)."""


def render_view(page: np.ndarray, exposure: float, path: Path) -> np.ndarray:
    """Render the open, built row and return (h, w, 3) display values, row 0 at the bottom.

    Parameters
    ----------
    page : (n, n, 3) float32
        Its lightmap, H/π.
    exposure : float
    path : Path
        A PNG file for Cycles to write.
    """
    scene = bpy.context.scene
    paint = _showing(page)
    for obj in scene.objects:
        if obj.type == "MESH" and _has_place(obj.data):
            obj.data.materials.clear()
            obj.data.materials.append(paint)
    _place_camera(scene)
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.exposure = math.log2(exposure)
    render_png(scene, path, SAMPLES)
    return read_png(path)


def read_png(path: Path) -> np.ndarray:
    """Return (h, w, 3) display values, row 0 at the bottom."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, -1)[..., :3]


def _has_place(mesh: bpy.types.Mesh) -> bool:
    """Whether a mesh has texels to show."""
    layer = mesh.uv_layers.get(LIGHTMAP_UV_LAYER)
    if layer is None:
        return False
    uv = np.empty(2 * len(layer.data), dtype=np.float32)
    layer.data.foreach_get("uv", uv)
    return bool(len(uv)) and float(uv.min()) < HIDDEN


def _showing(page: np.ndarray) -> bpy.types.Material:
    """Make a material that glows as the lightmap says."""
    height, width, _ = page.shape
    image = bpy.data.images.new("Shown", width, height, float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.dstack([page, np.ones((height, width))]).astype(np.float32).ravel())
    image.pack()
    material = bpy.data.materials.new("Shown")
    tree = emptied_nodes(material)
    place, texture, glow, out = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("UVMap", "TexImage", "Emission", "OutputMaterial")
    )
    place.uv_map, texture.image = LIGHTMAP_UV_LAYER, image
    tree.links.new(place.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], glow.inputs["Color"])
    tree.links.new(glow.outputs[0], out.inputs["Surface"])
    return material


def _place_camera(scene: bpy.types.Scene) -> None:
    """Look at the stage from the front, wherever it is and however large."""
    floor = bpy.data.objects["Floor"]
    data = bpy.data.cameras.new("View")
    camera = bpy.data.objects.new("View", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    size = floor.scale.x
    camera.location = floor.location + size * EYE
    camera.rotation_euler = (EYE - TARGET).to_track_quat("Z", "Y").to_euler()
    data.angle, data.clip_start, data.clip_end = ANGLE, 0.01 * size, 100.0 * size
