"""Baking with Cycles: Diffuse, Direct and Indirect, Color off, without what makes it less exact."""

from __future__ import annotations

import bpy
import numpy as np

from radiosity_addon.scene.bake_scene import LIGHTMAP_UV_LAYER

from .layout import objects_with_layout

BOUNCES = 128


def set_up(scene: bpy.types.Scene, threads: int = 0) -> None:
    """Prepare the open scene for baking.

    Parameters
    ----------
    threads : int
        0 means all cores.
    """
    scene.render.engine = "CYCLES"
    scene.render.threads_mode = "FIXED" if threads else "AUTO"
    if threads:
        scene.render.threads = threads
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = BOUNCES
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    meshes = objects_with_layout(scene)
    for obj in scene.objects:
        obj.select_set(obj in meshes)
    for obj in meshes:
        obj.data.uv_layers[LIGHTMAP_UV_LAYER].active = True
    bpy.context.view_layer.objects.active = meshes[0]
    if len(meshes) > 1:
        # Cycles prepares the whole scene again for each object it bakes.
        bpy.ops.object.join()


def bake_light(scene: bpy.types.Scene, resolution: int, samples: int, seed: int) -> np.ndarray:
    """Return (n, n, 3) float32 H/π [W/m²/sr]; row 0 is v = 0, what no triangle covers is 0."""
    scene.cycles.samples, scene.cycles.seed = samples, seed
    return _bake(scene, resolution, "DIFFUSE", {"DIRECT", "INDIRECT"})


def covered(scene: bpy.types.Scene, resolution: int) -> np.ndarray:
    """Return (n, n) bool: the texels Cycles writes, found by letting every surface glow for good."""
    for material in _materials(scene):
        nodes, links = material.node_tree.nodes, material.node_tree.links
        glow = nodes.new("ShaderNodeEmission")
        output = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
        links.new(glow.outputs["Emission"], output.inputs["Surface"])
    scene.cycles.samples = 1
    return _bake(scene, resolution, "EMIT", set())[..., 0] > 0


def _bake(scene: bpy.types.Scene, resolution: int, kind: str, passes: set[str]) -> np.ndarray:
    """Bake the selected objects into one image and return its pixels."""
    image = bpy.data.images.new(kind, resolution, resolution, float_buffer=True, is_data=True)
    for material in _materials(scene):
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.nodes.active = node
    status = bpy.ops.object.bake(
        type=kind, pass_filter=passes, margin=0, use_clear=True, uv_layer=LIGHTMAP_UV_LAYER
    )
    if status != {"FINISHED"}:
        raise RuntimeError(f"Cycles' bake ended with {status}")
    pixels = np.empty(resolution * resolution * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(resolution, resolution, 4)[..., :3].copy()


def _materials(scene: bpy.types.Scene) -> set[bpy.types.Material]:
    return {slot.material for obj in objects_with_layout(scene) for slot in obj.material_slots}
