"""Look at a world as diffuse rays see it: Cycles renders it around, in a scene of its own."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...base import BakeError
from ...lights import WHOLE_SPHERE, Bounds

WIDTH, HEIGHT = 512, 256
SAMPLES = 16
"""Of each pixel, spread over all of it."""

_AS_DIFFUSE_RAYS = {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Length": 1e5, "Ray Depth": 1.0}
"""Outputs of a Light Path node for rays that light a surface; all others are 0."""


def world_pixels(
    world: bpy.types.World, window: Bounds = WHOLE_SPHERE, size: tuple[int, int] = (HEIGHT, WIDTH)
) -> np.ndarray:
    """Return the radiance of a world by direction.

    world: As the file has it, not evaluated.
    window (4,) [rad]: Latitudes and azimuths to look at (see `solver.environment`).
    size (h, w).
    Returns (h, w, 3): [W/m²/sr]; row 0 is the lowest latitude, azimuths fall from left to right. NaN and
        negative values are 0.
    Raises BakeError if Cycles could not render it.
    """
    with only_for_now():
        copy = world.copy()
        if hasattr(copy, "cycles"):
            # Nothing is lit here: a map of where to aim rays would take longer than the picture.
            copy.cycles.sampling_method = "NONE"
        _answer_light_paths(copy.node_tree, {})
        return look_around(panorama_scene(copy, window), size, f"world '{world.name}'")


def camera_pixels(world: bpy.types.World) -> np.ndarray:
    """Return the radiance of a world as cameras see it, see `world_pixels`; raises BakeError likewise."""
    with only_for_now():
        copy = world.copy()
        if hasattr(copy, "cycles"):
            copy.cycles.sampling_method = "NONE"
        return look_around(panorama_scene(copy), (HEIGHT, WIDTH), f"world '{world.name}'")


def panorama_scene(world: bpy.types.World | None, window: Bounds = WHOLE_SPHERE) -> bpy.types.Scene:
    """Make a scene that holds nothing but a world, and a camera that looks around."""
    scene = bpy.data.scenes.new("Radiosity World")
    scene.world = world
    data = bpy.data.cameras.new("Radiosity World")
    camera = bpy.data.objects.new("Radiosity World", data)
    low, high, left, right = window
    middle, half = 0.5 * (left + right), 0.5 * (right - left)
    # Turned so, it looks at the window's middle, with z up.
    camera.rotation_euler = (0.5 * np.pi, 0.0, middle - 0.5 * np.pi)
    scene.collection.objects.link(camera)
    scene.camera = camera
    data.type = "PANO"
    for name, value in {
        "panorama_type": "EQUIRECTANGULAR",
        "latitude_min": low,
        "latitude_max": high,
        "longitude_min": -half,
        "longitude_max": half,
    }.items():
        setattr(data if hasattr(data, name) else data.cycles, name, value)
    return scene


def look_around(scene: bpy.types.Scene, size: tuple[int, int], what: str) -> np.ndarray:
    """Render a `panorama_scene`: (h, w, 3) float64 radiance, as `world_pixels` returns it.

    Raises BakeError if Cycles could not render `what`.
    """
    with tempfile.TemporaryDirectory(prefix="radiosity-") as folder:
        path = Path(folder) / "seen.exr"
        _set_up(scene, size, path)
        try:
            bpy.ops.render.render(write_still=True, scene=scene.name)
            image = bpy.data.images.load(str(path))
        except RuntimeError as error:
            raise BakeError(f"{what} cannot be rendered: {' '.join(str(error).split())}") from error
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty(size[0] * size[1] * image.channels, dtype=np.float32)
        image.pixels.foreach_get(pixels)
    radiance = pixels.reshape(*size, -1)[..., :3].astype(np.float64)
    return np.maximum(np.nan_to_num(radiance, posinf=0.0), 0.0)


def _set_up(scene: bpy.types.Scene, size: tuple[int, int], path: Path) -> None:
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = SAMPLES
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    scene.view_settings.exposure = 0.0
    cycles.film_exposure = 1.0
    render = scene.render
    render.resolution_y, render.resolution_x = size
    render.resolution_percentage = 100
    render.use_compositing = render.use_sequencer = render.film_transparent = False
    render.filepath = str(path)
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode = "RGB"
    render.image_settings.color_depth = "32"


def _answer_light_paths(tree: bpy.types.NodeTree, copies: dict[str, bpy.types.NodeTree]) -> None:
    """Make every Light Path node of a tree, and of copies of its groups, act as for diffuse rays."""
    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree is not None:
            name = node.node_tree.name_full
            if name not in copies:
                copies[name] = node.node_tree.copy()
                _answer_light_paths(copies[name], copies)
            node.node_tree = copies[name]
        elif node.type == "LIGHT_PATH":
            for socket in node.outputs:
                _replace(tree, socket, _AS_DIFFUSE_RAYS.get(socket.name, 0.0))


def _replace(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, answer: float) -> None:
    targets = [link.to_socket for link in socket.links]
    if targets:
        value = tree.nodes.new("ShaderNodeValue")
        value.outputs[0].default_value = answer
        for target in targets:
            tree.links.new(value.outputs[0], target)


@contextmanager
def only_for_now() -> Iterator[None]:
    """Remove all datablocks that the block creates, including the render result."""
    kinds = (
        "scenes", "objects", "meshes", "materials", "lights", "cameras", "worlds", "node_groups",
        "images", "actions",
    )  # fmt: skip
    before: dict[str, set[Any]] = {kind: set(getattr(bpy.data, kind)) for kind in kinds}
    try:
        yield
    finally:
        made = [block for kind in kinds for block in getattr(bpy.data, kind) if block not in before[kind]]
        bpy.data.batch_remove(made)
