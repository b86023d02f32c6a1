"""Makes docs/images/light-groups.png: one bake of three light groups, mixed in four ways.

    python -m docs.pictures.light_groups

Asserts that light adds up: the picture of all groups is the sum of those of each alone.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import bpy
import numpy as np
from PIL import Image

import radiosity_addon
from radiosity_addon.blender.datablocks.png import render_png
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.images.light_mixer import mixers, sliders_of
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.options.bake_settings import BakeSettings

ROOT = Path(__file__).resolve().parents[2]

SIDE, BORDER = 252, 8
WHITE = (1.0, 1.0, 1.0)

Mix = Mapping[str, tuple[float, tuple[float, float, float]]]
"""Strength and color of each group."""

MIXES: tuple[Mix, ...] = (
    {"Ceiling": (1.0, WHITE), "Cube": (1.0, WHITE), "Sky": (1.0, WHITE)},
    {"Ceiling": (1.0, WHITE), "Cube": (0.0, WHITE), "Sky": (0.0, WHITE)},
    {"Ceiling": (0.05, (1.0, 0.6, 0.3)), "Cube": (1.5, WHITE), "Sky": (0.3, (0.3, 0.5, 1.0))},
    {"Ceiling": (0.0, WHITE), "Cube": (2.5, (0.2, 1.0, 0.8)), "Sky": (0.6, (1.0, 0.4, 0.7))},
)


def build() -> bpy.types.Scene:
    """Put an emissive cube and a sky into the Cornell box, each in a light group as the lamp is."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = build_cornell_box()
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.objects["Lamp"].radiosity_light_group = "Ceiling"
    bpy.ops.mesh.primitive_cube_add(size=0.7, location=(0.93, 1.69, 2.05), rotation=(0.0, 0.0, 0.3))
    glow = bpy.data.materials.new("Glow")
    if bpy.app.version < (5, 0):
        glow.use_nodes = True
    shader = glow.node_tree.nodes["Principled BSDF"]
    shader.inputs["Emission Color"].default_value = (1.0, 0.45, 0.12, 1.0)
    shader.inputs["Emission Strength"].default_value = 3.0
    glow.radiosity_light_group = "Cube"
    bpy.context.object.data.materials.append(glow)
    world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.35, 0.55, 1.0, 1.0)
    background.inputs["Strength"].default_value = 0.6
    world.radiosity_light_group = "Sky"
    scene.world = world
    return scene


def mix(wanted: Mix) -> None:
    """Set the sliders."""
    (mixer,) = mixers()
    for sliders in sliders_of(mixer):
        strength, color = wanted[sliders.name]
        sliders.strength.default_value, sliders.color.default_value = strength, (*color, 1.0)


def seen(scene: bpy.types.Scene, folder: Path) -> np.ndarray:
    """Render the scene: its inner (h, w, 3) uint8."""
    path = folder / "seen.png"
    render_png(scene, path, samples=16)
    # At the border the camera sees the sky itself, which no slider changes.
    return np.asarray(Image.open(path).convert("RGB"))[BORDER:-BORDER, BORDER:-BORDER]


def linear(picture: np.ndarray) -> np.ndarray:
    """Undo the standard view transform's curve."""
    value = picture / 255.0
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def main() -> None:
    """Bake, mix, and write the pictures side by side."""
    radiosity_addon.register()
    scene = build()
    list(run_bake(bpy.context, BakeSettings(resolution=256, light_groups=True), None))
    scene.radiosity.show = "matte"  # no slider changes what else shines on surfaces
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        pictures = []
        for wanted in MIXES:
            mix(wanted)
            pictures.append(seen(scene, folder))
        alone = []
        for group in MIXES[0]:
            mix({other: (float(other == group), WHITE) for other in MIXES[0]})
            alone.append(linear(seen(scene, folder)))
    total, whole = sum(alone), linear(pictures[0])
    dark = whole.max(axis=2) < 0.9  # brighter ones are cut off
    error = float(np.abs(total - whole)[dark].mean() / whole[dark].mean())
    assert error < 0.02, f"the groups' pictures miss their sum by {error:.2%}"
    gap = np.full((len(pictures[0]), 6, 3), 255, dtype=np.uint8)
    row = [part for picture in pictures for part in (picture, gap)][:-1]
    Image.fromarray(np.concatenate(row, axis=1)).save(
        ROOT / "docs" / "images" / "light-groups.png", optimize=True
    )


if __name__ == "__main__":
    main()
