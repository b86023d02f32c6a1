"""What of a picture of the solution the viewports show, and in what colors."""

from __future__ import annotations

import bpy
import numpy as np

from ..bake_scene import Picture
from ..solver.arrays import Array
from ..solver.radiometry import radiance_of_radiosity
from .export_sources import Export, ExportSource

_SEEN_THROUGH = frozenset({"WIRE", "BOUNDS"})


def seen_triangles(context: bpy.types.Context, export: Export) -> Array:
    """Tell which of the scene's triangles the viewports show as surfaces.

    What is hidden there, so that one can look into a room, is baked but stays hidden.

    Parameters
    ----------
    context : bpy.types.Context
        Its viewport, if it is one, decides, and its view layer.
    export : Export

    Returns
    -------
    seen : (t,) bool
    """
    seen = np.zeros(len(export.bake_scene.scene), dtype=bool)
    space = context.space_data if isinstance(context.space_data, bpy.types.SpaceView3D) else None
    for item, source in zip(export.bake_scene.objects, export.sources, strict=True):
        seen[item.rows] = _is_seen(source, space)
    return seen


def _is_seen(source: ExportSource, space: bpy.types.SpaceView3D | None) -> bool:
    obj = bpy.data.objects.get(source.instancer or source.object_name)
    if obj is None or obj.display_type in _SEEN_THROUGH:
        return False
    return bool(obj.visible_get() if space is None else obj.visible_get(viewport=space))


def corner_arrays(picture: Picture, exposure: float, white: float) -> tuple[Array, Array]:
    """Return what a graphics card draws of the elements' corners.

    Parameters
    ----------
    picture : Picture
        Of n elements.
    exposure, white : float
        As `display_colors` takes them.

    Returns
    -------
    positions : (3n, 3) float32
    colors : (3n, 4) float32
        Opaque, the same at the three corners of an element.
    """
    colors = np.ones((len(picture), 3, 4), dtype=np.float32)
    colors[:, :, :3] = display_colors(picture.radiosity, exposure, white)[:, None]
    return picture.corners.reshape(-1, 3), colors.reshape(-1, 4)


def display_colors(radiosity: Array, exposure: float, white: float) -> Array:
    """Return the colors a screen shows for diffuse surfaces.

    A surface of radiosity B has the radiance L = B/π in every direction. Radiances up to `white`
    are compressed to L (1 + L/white²)/(1 + L) (Reinhard et al., Photographic tone reproduction
    for digital images, 2002, eq. 4), which leaves them as they are if white is 1.

    Parameters
    ----------
    radiosity : (n, 3) float [W/m²]
        Linear RGB.
    exposure : float
        Factor on the radiance.
    white : float
        The exposed radiance that is shown as white.

    Returns
    -------
    colors : (n, 3) float32
        sRGB, in [0, 1].
    """
    radiance = np.clip(exposure * radiance_of_radiosity(radiosity), 0.0, white)
    linear = radiance * (1.0 + radiance / white**2) / (1.0 + radiance)
    colors = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return colors.astype(np.float32)
