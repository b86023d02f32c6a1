"""A picture of the baked scene: Cycles on the CPU, in a scene of its own that is then removed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ..errors import BakeError
from ..settings import BakeSettings
from .bake_record import is_made

SAMPLES = 32
MAX_SIDE = 960
"""Pixels."""

_VIEW_FROM = Vector((1.0, -1.6, 0.9)).normalized()


def render_preview(context: bpy.types.Context, path: Path, settings: BakeSettings) -> None:
    """Render the scene's camera, or a framed view of the baked objects, to a PNG file.

    The scene and its render settings stay as they are.

    Parameters
    ----------
    context : Context
    path : Path
        Lightmaps that are not where their images say yet are looked for beside it.
    settings : BakeSettings
        Its seed and threads.

    Raises
    ------
    BakeError
        If the picture could not be rendered or written.
    """
    had_result = "Render Result" in bpy.data.images
    scene = context.scene.copy()
    camera = None
    try:
        if scene.camera is None or scene.camera.type != "CAMERA":
            camera = _framing_camera(context, scene)
        _set_up(scene, path, settings)
        with _lightmaps_at(path.parent):
            bpy.ops.render.render(write_still=True, scene=scene.name)
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
    path.write_bytes(_without_notes(path.read_bytes()))


def _set_up(scene: bpy.types.Scene, path: Path, settings: BakeSettings) -> None:
    """Set the preview scene's render settings."""
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.seed = settings.seed
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    render = scene.render
    if settings.threads:
        render.threads_mode = "FIXED"
        render.threads = settings.threads
    share = min(1.0, MAX_SIDE / max(render.resolution_x, render.resolution_y))
    render.resolution_x = max(4, round(render.resolution_x * share))
    render.resolution_y = max(4, round(render.resolution_y * share))
    render.resolution_percentage = 100
    render.use_border = render.use_multiview = render.use_stamp = False
    render.use_compositing = render.use_sequencer = render.use_simplify = False
    render.use_motion_blur = render.film_transparent = False
    render.filepath = str(path)
    render.use_file_extension = False
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGB"
    render.image_settings.color_depth = "8"


def _framing_camera(context: bpy.types.Context, scene: bpy.types.Scene) -> bpy.types.Camera:
    """Give the preview scene a camera that sees all baked objects from above a corner."""
    corners = _bounds(context)
    data = bpy.data.cameras.new("Radiosity Preview")
    camera = bpy.data.objects.new("Radiosity Preview", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
    radius = max(float(np.linalg.norm(corners - centre, axis=1).max()), 1e-3)
    aspect = scene.render.resolution_x / scene.render.resolution_y
    narrow = 2 * math.atan(math.tan(data.angle / 2) / max(aspect, 1 / aspect))
    distance = 1.05 * radius / math.sin(narrow / 2)
    camera.location = Vector(centre) + distance * _VIEW_FROM
    camera.rotation_euler = _VIEW_FROM.to_track_quat("Z", "Y").to_euler()
    data.clip_start = max(distance - 1.1 * radius, 1e-3 * distance)
    data.clip_end = distance + 1.1 * radius
    return data


def _bounds(context: bpy.types.Context) -> np.ndarray:
    """Corners of the boxes around what shows a lightmap, (n, 3) [m]."""
    baked = _showing([obj for obj in context.scene.objects if obj.type == "MESH" and is_made(obj.data)])
    objects = baked or _showing([obj for obj in context.scene.objects if obj.type == "MESH"])
    corners = [obj.matrix_world @ Vector(corner) for obj in objects for corner in obj.bound_box]
    return np.array(corners or [(-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)])


def _showing(objects: Sequence[bpy.types.Object]) -> list[bpy.types.Object]:
    """Those of the objects that a render shows."""
    return [obj for obj in objects if not obj.hide_render]


def _without_notes(png: bytes) -> bytes:
    """Drop a PNG's text chunks: Blender's tell dates and render times, so no two files are the same."""
    kept, start = [png[:8]], 8
    while start < len(png):
        length = int.from_bytes(png[start : start + 4], "big") + 12  # size, type and checksum
        if png[start + 4 : start + 8] not in (b"tEXt", b"zTXt", b"iTXt", b"tIME"):
            kept.append(png[start : start + length])
        start += length
    return b"".join(kept)


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
