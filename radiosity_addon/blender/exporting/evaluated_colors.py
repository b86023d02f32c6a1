"""Colors of materials as images in the lightmap's UVs, evaluated by Cycles: exact, at one sample a texel."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from ...base import BakeError
from ...exports import srgb_of_linear
from ...lightmap.images import fill_uncovered
from ...numerics import Array
from ...scene import LIGHTMAP_UV_LAYER
from ..datablocks.bake_record import remove_datablocks
from ..material_copies.surface_nodes import feed_color
from ..materials.shader_nodes import output_node
from .bake_units import alone
from .export_materials import ALPHA, BASE, EMISSION, ExportMaterial
from .export_scene import ExportScene

MAX_SIDE = 4096
"""Of images: larger ones have as many texels as the lightmap."""


def side_factor(side: int) -> int:
    """Return how many texels an evaluated image has for one of a lightmap of this size."""
    return 2 if 2 * side <= MAX_SIDE else 1


def evaluate_channel(
    context: bpy.types.Context,
    made: ExportScene,
    objects: Sequence[bpy.types.Object],
    sizes: Sequence[tuple[int, int]],
    channel: str,
) -> list[Array]:
    """Return one channel of all materials on each page, (height, width, 3) float32.

    objects: Those that stand for all baked ones, see `bake_units`.
    sizes: Width and height of each page's image.
    Raises BakeError if Cycles did not bake.
    """
    images = [
        bpy.data.images.new("Radiosity Export", *size, alpha=True, float_buffer=True, is_data=True)
        for size in sizes
    ]
    for image in images:
        image.pixels.foreach_set(np.zeros(len(image.pixels), dtype=np.float32))
    wired = [_Emitting(material, channel, images[material.page]) for material in made.materials]
    try:
        _as_cycles(made.scene)
        for obj in objects:
            with alone(made, obj):
                _bake(context, made.scene, obj)
        return [_pixels(image) for image in images]
    except RuntimeError as error:
        raise BakeError(f"Cycles could not evaluate the materials: {' '.join(str(error).split())}") from error
    finally:
        for each in wired:
            each.undo()
        remove_datablocks(images)


def _bake(context: bpy.types.Context, scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """Let Cycles bake an object's emission into its materials' active images."""
    with context.temp_override(
        scene=scene,
        view_layer=scene.view_layers[0],
        object=obj,
        active_object=obj,
        selected_objects=[obj],
        selected_editable_objects=[obj],
    ):
        done = bpy.ops.object.bake(
            type="EMIT",
            margin=0,  # that of an object would cover others next to it
            use_clear=False,
            target="IMAGE_TEXTURES",
            save_mode="INTERNAL",
            use_selected_to_active=False,
            uv_layer=LIGHTMAP_UV_LAYER,
        )
    if done != {"FINISHED"}:
        raise BakeError("Cycles could not evaluate the materials for the export")


class _Emitting:
    """A material that emits a channel for a while, into an image."""

    def __init__(self, material: ExportMaterial, channel: str, image: bpy.types.Image) -> None:
        self._tree = tree = material.tree
        self._principled = material.principled
        output = output_node(tree)
        assert output is not None
        self._surface = output.inputs["Surface"]
        self._emission = tree.nodes.new("ShaderNodeEmission")
        source = material.sources[channel]
        if channel == ALPHA and not isinstance(source, bpy.types.NodeSocket):
            source = (source,) * 3
        color = self._emission.inputs["Color"]
        self._scaled = tree.nodes.new("ShaderNodeVectorMath")
        self._scaled.operation = "MULTIPLY"
        self._scaled.inputs[1].default_value = material.factor if channel == EMISSION else (1.0, 1.0, 1.0)
        feed_color(tree, self._scaled.inputs[0], source)
        tree.links.new(self._scaled.outputs["Vector"], color)
        self._links = [(link.from_socket, link.to_socket) for link in self._surface.links]
        tree.links.new(self._emission.outputs[0], self._surface)
        self._target = tree.nodes.new("ShaderNodeTexImage")
        self._target.image = image
        self._active, tree.nodes.active = tree.nodes.active, self._target

    def undo(self) -> None:
        """Put the material back."""
        self._tree.nodes.remove(self._emission)
        self._tree.nodes.remove(self._scaled)
        self._tree.nodes.remove(self._target)
        for source, target in self._links:
            self._tree.links.new(source, target)


def image_of(
    channels: dict[str, Array], name: str
) -> tuple[dict[str, tuple[bpy.types.Image, float]], list[bpy.types.Image]]:
    """Make the images of a page's evaluated channels: base with alpha in one, emission in another.

    Returns images: By channel, each with the value of its white.
    Returns made: Each image once.
    """
    found: dict[str, tuple[bpy.types.Image, float]] = {}
    made = []
    if BASE in channels or ALPHA in channels:
        alpha = channels[ALPHA][..., 0] if ALPHA in channels else None
        base = channels.get(BASE)
        if base is None:
            base = np.zeros_like(channels[ALPHA])
        made.append(_encoded(base, alpha, f"{name} Color"))
        found |= {channel: (made[-1], 1.0) for channel in (BASE, ALPHA) if channel in channels}
    if EMISSION in channels:
        white = max(1.0, float(channels[EMISSION].max()))
        made.append(_encoded(channels[EMISSION] / white, None, f"{name} Emission"))
        found[EMISSION] = made[-1], white
    return found, made


def _encoded(colors: Array, alpha: Array | None, name: str) -> bpy.types.Image:
    height, width = colors.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=alpha is not None)
    if alpha is not None:
        image.alpha_mode = "CHANNEL_PACKED"
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :3] = srgb_of_linear(np.clip(colors, 0.0, 1.0))
    if alpha is not None:
        pixels[..., 3] = np.clip(alpha, 0.0, 1.0)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def _as_cycles(scene: bpy.types.Scene) -> None:
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 1
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False


def _pixels(image: bpy.types.Image) -> Array:
    """Return an image (height, width, 3), dilated from the texels that were evaluated."""
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    pixels = np.nan_to_num(pixels.reshape(height, width, 4), posinf=0.0, neginf=0.0)
    colors, known = np.ascontiguousarray(pixels[..., :3]), pixels[..., 3] > 0.0
    colors[~known] = 0.0
    fill_uncovered(colors, known)
    return colors
