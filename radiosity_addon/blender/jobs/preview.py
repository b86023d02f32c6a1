"""A matte picture of the baked scene: Cycles on the CPU, in a scene of its own that is then removed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ...base import BakeError
from ...options import BakeSettings
from ..datablocks.bake_record import is_made, shows_lightmap
from ..datablocks.png import render_png
from ..images.node_group import matte_groups

SAMPLES = 8
"""A pixel's. Lightmapped surfaces have no noise, so these only smooth edges: 99 % of all pixels are
within 4 of 255 levels of a picture with 256 samples."""

QUICK_SAMPLES = 4
"""For relighting: edges are rougher, but the picture costs no more than the light."""

MAX_SIDE = 640
"""Pixels."""

_VIEW_FROM = Vector((1.0, -1.6, 0.9)).normalized()


def render_preview(
    context: bpy.types.Context, path: Path, settings: BakeSettings, samples: int = SAMPLES
) -> None:
    """Render the scene's camera, or a framed view of the baked objects, to a PNG file.

    The scene and its render settings stay as they are.

    path: Lightmaps that are not yet where their images say are looked for next to it.
    settings: Its seed and threads.
    samples: A pixel's.
    Raises BakeError if the picture could not be rendered or written.
    """
    had_result = "Render Result" in bpy.data.images
    scene = context.scene.copy()
    camera = None
    try:
        if scene.camera is None or scene.camera.type != "CAMERA":
            camera = _framing_camera(context, scene)
        _fit(scene.render)
        with _lightmaps_at(path.parent), matte_groups():
            render_png(scene, path, samples, settings.seed, settings.threads)
    except (RuntimeError, TypeError) as error:
        raise BakeError(f"cannot render the preview '{path}': {' '.join(str(error).split())}") from error
    finally:
        # scenes.remove() asks the window for its scene, and Blender's --command has none: it crashes.
        bpy.data.batch_remove([scene])
        if camera is not None:
            bpy.data.cameras.remove(camera)
        if not had_result and "Render Result" in bpy.data.images:
            bpy.data.images.remove(bpy.data.images["Render Result"])
    if not path.is_file():
        raise BakeError(f"cannot write the preview '{path}'")


def _fit(render: bpy.types.RenderSettings) -> None:
    """Scale the picture down where it is larger than a preview needs."""
    share = min(1.0, MAX_SIDE / max(render.resolution_x, render.resolution_y))
    render.resolution_x = max(4, round(render.resolution_x * share))
    render.resolution_y = max(4, round(render.resolution_y * share))


def _framing_camera(context: bpy.types.Context, scene: bpy.types.Scene) -> bpy.types.Camera:
    """Give the preview scene a camera that sees all baked objects from above a corner."""
    corners = _bounds(context)
    data = bpy.data.cameras.new("Radiosity Preview")
    camera = bpy.data.objects.new("Radiosity Preview", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    center = (corners.min(axis=0) + corners.max(axis=0)) / 2
    radius = max(float(np.linalg.norm(corners - center, axis=1).max()), 1e-3)
    aspect = scene.render.resolution_x / scene.render.resolution_y
    narrow = 2 * math.atan(math.tan(data.angle / 2) / max(aspect, 1 / aspect))
    distance = 1.05 * radius / math.sin(narrow / 2)
    camera.location = Vector(center) + distance * _VIEW_FROM
    camera.rotation_euler = _VIEW_FROM.to_track_quat("Z", "Y").to_euler()
    data.clip_start = max(distance - 1.1 * radius, 1e-3 * distance)
    data.clip_end = distance + 1.1 * radius
    return data


def _bounds(context: bpy.types.Context) -> np.ndarray:
    """Corners of the boxes around what shows a lightmap, (n, 3) [m]."""
    baked = _showing([obj for obj in context.scene.objects if shows_lightmap(obj)])
    objects = baked or _showing([obj for obj in context.scene.objects if obj.type == "MESH"])
    corners = [obj.matrix_world @ Vector(corner) for obj in objects for corner in obj.bound_box]
    return np.array(corners or [(-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)])


def _showing(objects: Sequence[bpy.types.Object]) -> list[bpy.types.Object]:
    """Those of the objects that a render shows."""
    return [obj for obj in objects if not obj.hide_render]


@contextmanager
def _lightmaps_at(folder: Path) -> Iterator[None]:
    """Have Cycles, which reads image files itself, find lightmaps that are still staged."""
    before = []
    for image in bpy.data.images:
        staged = folder / Path(bpy.path.abspath(image.filepath_raw)).name
        if is_made(image) and image.packed_file is None and image.filepath_raw and staged.is_file():
            before.append((image, image.filepath_raw))
            image.filepath_raw = str(staged)
    try:
        yield
    finally:
        for image, stored in before:
            image.filepath_raw = stored
