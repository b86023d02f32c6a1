"""The UV layer `Lightmap` of a mesh: room for it, its coordinates, and the layers beside it."""

from __future__ import annotations

import bpy
import numpy as np

from ..bake_scene import LIGHTMAP_UV_LAYER
from ..errors import BakeError, SceneError

MAX_UV_LAYERS = 8
"""Blender keeps no ninth."""


def check_room(mesh: bpy.types.Mesh, object_name: str) -> None:
    """Refuse a mesh that cannot take the layer.

    Raises
    ------
    SceneError
        If it has eight other UV layers, or something else of the layer's name.
    """
    if LIGHTMAP_UV_LAYER in mesh.uv_layers:
        return
    if len(mesh.uv_layers) >= MAX_UV_LAYERS:
        raise SceneError(
            f"object '{object_name}' has {len(mesh.uv_layers)} UV layers and Blender allows no ninth: "
            f"remove one to make room for '{LIGHTMAP_UV_LAYER}'"
        )
    if LIGHTMAP_UV_LAYER in mesh.attributes:
        raise SceneError(
            f"object '{object_name}' has an attribute '{LIGHTMAP_UV_LAYER}' that is not a UV layer: rename it"
        )


def write_layer(mesh: bpy.types.Mesh, loops: np.ndarray, uv: np.ndarray, object_name: str) -> None:
    """Write the layer `Lightmap`, new or over an old one; which layers are active stays.

    Parameters
    ----------
    mesh : Mesh
        `check_room` has passed it.
    loops : (n, 3) int32
        The mesh corner of each triangle corner.
    uv : (n, 3, 2) float32
        Its coordinates; corners of no triangle get (0, 0).
    object_name : str
        For the error.

    Raises
    ------
    BakeError
        If the mesh has fewer corners than `loops` speaks of.
    """
    if loops.size and int(loops.max()) >= len(mesh.loops):
        raise BakeError(f"object '{object_name}' changed while it was being baked: bake again")
    layers = mesh.uv_layers
    active = layers.active.name if layers.active else None
    rendered = next((layer.name for layer in layers if layer.active_render), None)
    if LIGHTMAP_UV_LAYER not in layers:
        layers.new(name=LIGHTMAP_UV_LAYER, do_init=False)

    coordinates = np.zeros((len(mesh.loops), 2), dtype=np.float32)
    coordinates[loops.ravel()] = np.asarray(uv, dtype=np.float32).reshape(-1, 2)
    # Not through layers[...].uv: before Blender 5.2 that writes into the array which a
    # copied mesh still shares with its original, and so changes both.
    mesh.attributes[LIGHTMAP_UV_LAYER].data.foreach_set("vector", coordinates.ravel())

    if active is not None:
        layers.active = layers[active]
    if rendered is not None:
        layers[rendered].active_render = True
