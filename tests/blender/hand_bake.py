"""A bake without a solver: a result made by hand, to test what Blender is told to do with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from radiosity_addon.bake.result.result import BakedObject, BakeResult
from radiosity_addon.blender.apply.apply import apply_lightmaps
from radiosity_addon.blender.apply.rebake import originals_shown, replacing_earlier
from radiosity_addon.blender.images.images import write_pages
from radiosity_addon.blender.material_copies.lightmap_materials import show_lightmaps
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.blender.scene_records.export_sources import Export
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings

TEXEL = (0.25, 0.5, 3.0)
BASE = (0.5, 0.25, 0.75)
"""The base color of `principled_material`."""

SMALL = 32
"""Default resolution: evaluated materials get pictures of a few times its size, pages made by hand do not."""

SOLVER = {
    "elements": 8, "links": 12, "rays": 345, "iterations": 3, "residual": 1e-4,
    "power_W": {"emitted": 1.0, "absorbed": 0.75, "escaped": 0.25}, "closure_area_mean": 0.998,
}  # fmt: skip


def hand_result(export: Export, colors: Sequence[Sequence[float]] = ((0.25, 0.5, 0.75),)) -> BakeResult:
    """Give the baked objects random UVs and pages of one color each, dealt in turn."""
    rng = np.random.default_rng(1)
    baked = [
        BakedObject(target, rng.random((target.count, 3, 2), dtype=np.float32), i % len(colors))
        for i, target in enumerate(t for t in export.bake_scene.objects if t.bake)
    ]
    pages = [
        LightmapPage(np.broadcast_to(np.array(color, np.float32), (4, 8, 3)).copy(), np.ones((4, 8), bool))
        for color in colors
    ]
    return BakeResult(tuple(pages), tuple(baked), SOLVER, (), {"solve": 0.5})


def bake_by_hand(
    colors: Sequence[Sequence[float]] = (TEXEL,),
    folder: Path | None = None,
    failing: Exception | None = None,
    show: str = "matte",
    **settings: object,
) -> BakeResult:
    """Export the open scene, pretend to bake it, and show the result, in place of any bake that is shown.

    `failing` is raised once the lightmaps are shown.
    show: How; a matte surface sends the same to all sides.
    """
    wanted = BakeSettings(**{"resolution": SMALL, **settings})
    with originals_shown(bpy.context):
        export = export_scene(bpy.context, wanted)
    result = hand_result(export, colors)
    with replacing_earlier(bpy.context) as earlier:
        images = write_pages(result, wanted, folder)
        behind = apply_lightmaps(bpy.context, export, result, images, wanted, earlier=earlier)
        show_lightmaps(show)
        if failing is not None:
            raise failing
    return replace(result, warnings=behind)


def add_plane(name: str = "Plane", material: bpy.types.Material | None = None) -> bpy.types.Object:
    """A square of side 2 that faces up."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    if material is not None:
        mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def principled_material(*, name: str = "Paint", **inputs: object) -> bpy.types.Material:
    """A Principled material; keywords are its inputs, with _ for a space."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    principled = material.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value = (*BASE, 1.0)
    for key, value in inputs.items():
        principled.inputs[key.replace("_", " ")].default_value = value
    return material


def add_shader(material: bpy.types.Material, kind: str, **inputs: object) -> bpy.types.Node:
    """Add a shader node; keywords are its inputs."""
    node = material.node_tree.nodes.new(f"ShaderNode{kind}")
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    return node


def link_surface(material: bpy.types.Material, socket: bpy.types.NodeSocket) -> None:
    tree = material.node_tree
    tree.links.new(socket, tree.nodes["Material Output"].inputs["Surface"])


def seen_from_above(folder: Path, size: int = 2, engine: str = "CYCLES", samples: int = 16) -> np.ndarray:
    """Render the square [-1, 1]² from above: (size, size, 3) radiance, bottom row first."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    camera.location.z = 5.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = engine
    scene.cycles.samples, scene.cycles.use_denoising = samples, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(folder / "seen.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    return np.array(image.pixels[:]).reshape(size, size, -1)[..., :3]
