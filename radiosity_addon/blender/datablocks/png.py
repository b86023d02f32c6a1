"""PNG files that Blender writes: whole, and of a scene of our own the same bytes every time.

Pictures are rendered with Cycles on the CPU.
"""

from __future__ import annotations

import os
from pathlib import Path

import bpy

_END = b"\0\0\0\0IEND\xaeB`\x82"
"""The last chunk of every PNG file: without content, its type, its checksum."""


def render_png(scene: bpy.types.Scene, path: Path, samples: int, seed: int = 0, threads: int = 0) -> None:
    """Render a scene at its resolution; its other render settings are set here.

    scene: One made for this picture.
    samples: A pixel.
    seed, threads: 0 threads leaves their number to the scene.
    Raises RuntimeError if Blender could not render or write it.
    """
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.seed = seed
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    if threads:
        scene.render.threads_mode = "FIXED"
        scene.render.threads = threads
    _still_image(scene.render, path)
    bpy.ops.render.render(write_still=True, scene=scene.name)
    if path.is_file():
        check_whole(path)
        path.write_bytes(_without_notes(path.read_bytes()))


def check_whole(path: Path) -> None:
    """Check that a PNG file written by Blender is complete: Blender does not notice a full disk.

    Raises RuntimeError if it does not.
    """
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - len(_END)))
        if file.read() != _END:
            raise RuntimeError("only a part of the file could be written: is the disk full?")


def _still_image(render: bpy.types.RenderSettings, path: Path) -> None:
    """Set up Blender to write only the picture, as an 8-bit PNG."""
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


def _without_notes(png: bytes) -> bytes:
    """Drop a PNG's text chunks: Blender's contain dates and render times, so no two files would be equal."""
    kept, start = [png[:8]], 8
    while start < len(png):
        length = int.from_bytes(png[start : start + 4], "big") + 12  # size, type and checksum
        if png[start + 4 : start + 8] not in (b"tEXt", b"zTXt", b"iTXt", b"tIME"):
            kept.append(png[start : start + length])
        start += length
    return b"".join(kept)
