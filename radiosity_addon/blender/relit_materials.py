"""Emission of the materials that show lightmaps, brought up to that of the originals."""

from __future__ import annotations

from collections.abc import Collection

import bpy

from ..solver.radiometry import radiance_of_radiosity
from .bake_record import is_made
from .lightmap_materials import ORIGINAL, LightmapMaterials, set_lightmap_only
from .materials import read_material
from .node_group import EMISSION


def remake(scene: bpy.types.Scene, names: Collection[str], quantity: str) -> None:
    """Make the lightmap copies of some materials anew, in place of those that objects have.

    Parameters
    ----------
    names : collection of str
        Of the originals whose emission has changed.
    quantity : str
        See `BakeSettings`.
    """
    made = LightmapMaterials(quantity)
    changed = False
    for copy, original in lightmap_copies(names):
        image = _image_of(copy)
        if image is None:
            continue
        new, name = made.copy_of(original, image, _is_pinned(copy)), copy.name
        copy.user_remap(new)
        bpy.data.materials.remove(copy)
        new.name, changed = name, True
    if changed and scene.radiosity.lightmap_only:
        set_lightmap_only(True)


def show_emission(names: Collection[str]) -> None:
    """Have the copies of some materials glow as their originals do, as far as a constant can say it: fast."""
    for copy, original in lightmap_copies(names):
        radiance = radiance_of_radiosity(read_material(original).emission)
        for node in copy.node_tree.nodes:
            if node.type == "GROUP" and EMISSION in node.inputs and not node.inputs[EMISSION].is_linked:
                node.inputs[EMISSION].default_value = (*radiance.tolist(), 1.0)


def lightmap_copies(names: Collection[str]) -> list[tuple[bpy.types.Material, bpy.types.Material]]:
    """Return the lightmap copies of the materials of these names, and the originals."""
    pairs = [(copy, copy.get(ORIGINAL)) for copy in bpy.data.materials if is_made(copy) and copy.node_tree]
    return [(copy, original) for copy, original in pairs if original is not None and original.name in names]


def _image_of(copy: bpy.types.Material) -> bpy.types.Image | None:
    """Return the lightmap that a copy shows."""
    images = [node.image for node in copy.node_tree.nodes if node.type == "TEX_IMAGE" and node.image]
    return next((image for image in images if is_made(image)), None)


def _is_pinned(copy: bpy.types.Material) -> bool:
    """Tell whether the objects that show a copy had no UV layer of their own."""
    shown = [mesh for mesh in bpy.data.meshes if is_made(mesh) and mesh.materials.find(copy.name) >= 0]
    return bool(shown) and len(shown[0].uv_layers) == 1
