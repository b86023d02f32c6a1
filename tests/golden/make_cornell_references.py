"""Bake the bundled Cornell box in Cycles, twice, for the golden test to compare with.

    python -m tests.golden.make_cornell_references [--samples 2048] [--output FILE]

Takes some four minutes a bake on two quiet cores. The layout is the one our own bake makes
at 256 px, and is stored with the pixels: the test keeps it, so texels match one by one.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np

from radiosity_addon.bake_scene import LIGHTMAP_UV_LAYER
from radiosity_addon.blender.cornell import build_cornell_box
from radiosity_addon.blender.export import export_scene
from radiosity_addon.lightmap.atlas import AtlasInput, run_atlas
from radiosity_addon.settings import BakeSettings
from tests.golden.cornell_reference import FILE, Reference, write_layout

RESOLUTION = 256
SEEDS = (1, 2)
BOUNCES = 128


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=2048)
    parser.add_argument("--output", type=Path, default=FILE)
    options = parser.parse_args()

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = build_cornell_box()
    uv = lay_out()
    write_layout(uv)
    meshes = [obj for obj in scene.objects if obj.type == "MESH"]
    for obj in meshes:
        obj.data.uv_layers[LIGHTMAP_UV_LAYER].active = True
        obj.select_set(True)
    bpy.context.view_layer.objects.active = meshes[0]
    set_up_cycles(scene)
    materials = {slot.material for obj in meshes for slot in obj.material_slots}

    bakes = []
    for seed in SEEDS:
        started = time.perf_counter()
        scene.cycles.samples, scene.cycles.seed = options.samples, seed
        bakes.append(bake(materials, "DIFFUSE", {"DIRECT", "INDIRECT"}))
        say(f"seed {seed}: {time.perf_counter() - started:.0f} s")
    coverage = covered(materials, scene)
    about = (
        f"Cycles of Blender {bpy.app.version_string}, Diffuse, Direct and Indirect, Color off, "
        f"{options.samples} samples, {BOUNCES} bounces, seeds {SEEDS}"
    )
    Reference(uv, bakes[0], bakes[1], coverage).save(options.output, about)
    say(f"{options.output}: {options.output.stat().st_size / 1024:.0f} KiB, {coverage.sum()} texels")
    return 0


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def lay_out() -> dict[str, np.ndarray]:
    """Return each object's lightmap UVs by mesh corner, as a bake lays them out."""
    export = export_scene(bpy.context, BakeSettings(resolution=RESOLUTION))
    bake_scene = export.bake_scene
    inputs = [
        AtlasInput(item.name, bake_scene.scene.triangles[item.rows], item.polygon)
        for item in bake_scene.objects
    ]
    layout = {}
    for item, placed in zip(bake_scene.objects, run_atlas(inputs, RESOLUTION).objects, strict=True):
        corners = np.zeros((len(bpy.data.objects[item.name].data.loops), 2), dtype=np.float32)
        corners[item.loops] = placed.uv
        layout[item.name] = corners
    return layout


def set_up_cycles(scene: bpy.types.Scene) -> None:
    """Switch off all that makes Cycles faster and less exact."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = BOUNCES
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0


def bake(materials: set[bpy.types.Material], kind: str, passes: set[str]) -> np.ndarray:
    """Bake the selected objects into one image and return its (n, n, 3) float32 pixels."""
    image = bpy.data.images.new(kind, RESOLUTION, RESOLUTION, float_buffer=True, is_data=True)
    for material in materials:
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.nodes.active = node
    status = bpy.ops.object.bake(
        type=kind, pass_filter=passes, margin=0, use_clear=True, uv_layer=LIGHTMAP_UV_LAYER
    )
    if status != {"FINISHED"}:
        raise RuntimeError(f"the bake ended with {status}")
    pixels = np.empty(RESOLUTION * RESOLUTION * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(RESOLUTION, RESOLUTION, 4)[..., :3].copy()


def covered(materials: set[bpy.types.Material], scene: bpy.types.Scene) -> np.ndarray:
    """Return (n, n) bool: the texels Cycles writes, found by letting every surface glow."""
    for material in materials:
        nodes, links = material.node_tree.nodes, material.node_tree.links
        glow = nodes.new("ShaderNodeEmission")
        output = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
        links.new(glow.outputs["Emission"], output.inputs["Surface"])
    scene.cycles.samples = 1
    return bake(materials, "EMIT", set())[..., 0] > 0


if __name__ == "__main__":
    os._exit(main())  # some versions of Blender's module hang or crash at the interpreter's own exit
