"""A case's scene as its camera sees it: lit by a lightmap alone, or traced by Cycles."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from radiosity_addon.lightmap.images.dilate import dilate
from radiosity_addon.scene.bake_scene import LIGHTMAP_UV_LAYER

from .cases import Case
from .prepare import TEXELS, open_prepared

SHOWN_SAMPLES, TRACED_SAMPLES = 16, 64
"""Samples a pixel of a lightmap's picture, which has no noise, and of the scene's, which is denoised."""

HEIGHT = 600
"""Of a picture [px]."""

MEAN_SHOWN = 0.35
"""What the mean of a lightmap is exposed to."""


def render(case: Case, folder: Path, mean: float, lightmap: Path | None, picture: Path) -> None:
    """Write a PNG of a prepared case.

    Parameters
    ----------
    mean : float
        Of the references [W/m²/sr], which the exposure depends on.
    lightmap : path of (n, n, 3) float32 or None
        H/π [W/m²/sr] by texels. None traces the scene itself.
    """
    scene = open_prepared(folder)
    if scene.camera is None:
        _take_camera(scene, case)
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.use_adaptive_sampling = "CPU", False
    cycles.samples, cycles.use_denoising = TRACED_SAMPLES, True
    if lightmap is not None:
        cycles.samples, cycles.use_denoising, cycles.diffuse_bounces = SHOWN_SAMPLES, False, 0
        _show(np.load(lightmap), np.load(folder / TEXELS)["compared"])
    scene.view_settings.exposure = float(np.log2(MEAN_SHOWN / mean))
    width = HEIGHT * scene.render.resolution_x // scene.render.resolution_y
    scene.render.resolution_x, scene.render.resolution_y = width, HEIGHT
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(picture)
    bpy.ops.render.render(write_still=True)


def _take_camera(scene: bpy.types.Scene, case: Case) -> None:
    """Give a flattened scene the camera and picture of the file it is from."""
    assert case.file is not None
    with bpy.data.libraries.load(str(case.file)) as (there, here):
        here.scenes = there.scenes[:1]
    original = here.scenes[0]
    scene.collection.objects.link(original.camera)
    scene.camera = original.camera
    scene.render.resolution_x = original.render.resolution_x
    scene.render.resolution_y = original.render.resolution_y
    scene.view_settings.view_transform = original.view_settings.view_transform


def _show(lightmap: np.ndarray, compared: np.ndarray) -> None:
    """Let every surface shine with what its lightmap says it reflects."""
    size = len(lightmap)
    pixels = np.ones((size, size, 4), dtype=np.float32)
    pixels[..., :3] = dilate(lightmap, compared | (lightmap.max(axis=2) > 0))
    image = bpy.data.images.new("Shown", size, size, float_buffer=True, is_data=True)
    image.pixels.foreach_set(pixels.ravel())
    for material in bpy.data.materials:
        for node in list(material.node_tree.nodes) if material.node_tree else ():
            if node.type == "BSDF_DIFFUSE":
                _replace(material.node_tree, node, image)


def _replace(tree: bpy.types.NodeTree, surface: bpy.types.Node, image: bpy.types.Image) -> None:
    """Put an emission of color times lightmap where a diffuse surface is."""
    kinds = ("UVMap", "TexImage", "VectorMath", "Emission")
    place, texture, product, glow = (tree.nodes.new(f"ShaderNode{kind}") for kind in kinds)
    place.uv_map, texture.image, product.operation = LIGHTMAP_UV_LAYER, image, "MULTIPLY"
    product.inputs[1].default_value = surface.inputs["Color"].default_value[:3]
    tree.links.new(place.outputs["UV"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], product.inputs[0])
    tree.links.new(product.outputs[0], glow.inputs["Color"])
    for link in list(surface.outputs[0].links):
        tree.links.new(glow.outputs[0], link.to_socket)
