"""What of a picture of the solution the viewports show, and in what colors."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import bpy
import numpy as np

from ...bake.result import Picture, TexelPicture, TexelSurfaces
from ...numerics import Array, radiance_of_radiosity
from ..scene_records.export_sources import Export, ExportSource

HALF_MAX = 65504.0
"""The largest float16."""

_SEEN_THROUGH = frozenset({"WIRE", "BOUNDS"})


def seen_triangles(context: bpy.types.Context, export: Export) -> Array:
    """Return which of the scene's triangles the viewports show as surfaces.

    What is hidden there, so that one can look into a room, is baked but stays hidden.

    context: Its viewport, if it is one, decides, and its view layer.
    Returns seen (t,) bool.
    """
    seen = np.zeros(len(export.bake_scene.scene), dtype=bool)
    space = context.space_data if isinstance(context.space_data, bpy.types.SpaceView3D) else None
    for item, source in zip(export.bake_scene.objects, export.sources, strict=True):
        seen[item.rows] = _is_seen(source, space)
    return seen


class ViewportFilter:
    """Leaves out of pictures what the viewports do not show.

    triangles (t,) bool: From `seen_triangles`.
    """

    def __init__(self, triangles: Array) -> None:
        self._triangles = triangles
        self._surfaces: tuple[TexelSurfaces, TexelSurfaces] | None = None

    def of(self, picture: Picture | TexelPicture | None) -> Picture | TexelPicture | None:
        """Return the picture of the elements, or of the texels on surfaces, that are seen."""
        if isinstance(picture, Picture):
            return picture.only(self._triangles[picture.triangle])
        if picture is None:
            return None
        if self._surfaces is None or self._surfaces[0] is not picture.surfaces:
            self._surfaces = picture.surfaces, picture.surfaces.only(self._triangles)
        return replace(picture, surfaces=self._surfaces[1])


def without_texels(picture: Picture, surfaces: TexelSurfaces) -> Picture:
    """Return the part of a picture that texels do not show: backs, and surfaces without a lightmap."""
    lit = np.isin(picture.triangle, surfaces.triangle) & picture.front
    return picture.only(~lit)


def page_colors(picture: TexelPicture, exposure: float, white: float) -> list[Array]:
    """Return (height, width, 4) float32 the display colors of each page; nothing where no surface is."""
    half = np.minimum(picture.radiosity, HALF_MAX).astype(np.float16).view(np.uint16)
    colors = np.zeros((len(half) + 1, 4), dtype=np.float32)
    colors[:-1, :3] = _colors_of_halves(exposure, white)[half]
    colors[:-1, 3] = 1.0
    # The number of no texel, −1, is that of the last row.
    return [colors[index] for index in picture.surfaces.texels]


@lru_cache(maxsize=4)
def _colors_of_halves(exposure: float, white: float) -> Array:
    """Return (65536,) float32: `display_colors` of each float16, indexed by its bits; 0 below 0."""
    values = np.arange(1 << 16, dtype=np.uint16).view(np.float16).astype(np.float64)
    values = np.nan_to_num(values, nan=0.0, posinf=HALF_MAX, neginf=0.0)
    return display_colors(values, exposure, white)


def _is_seen(source: ExportSource, space: bpy.types.SpaceView3D | None) -> bool:
    obj = bpy.data.objects.get(source.instancer or source.object_name)
    if obj is None or obj.display_type in _SEEN_THROUGH:
        return False
    return bool(obj.visible_get() if space is None else obj.visible_get(viewport=space))


def corner_arrays(picture: Picture, exposure: float, white: float) -> tuple[Array, Array]:
    """Return what a graphics card draws of the elements' corners.

    picture: Of n elements.
    exposure, white: As `display_colors` takes them.
    Returns positions (3n, 3) float32.
    Returns colors (3n, 4) float32: Opaque, the same at the three corners of an element.
    """
    colors = np.ones((len(picture), 3, 4), dtype=np.float32)
    colors[:, :, :3] = display_colors(picture.radiosity, exposure, white)[:, None]
    return picture.corners.reshape(-1, 3), colors.reshape(-1, 4)


def display_colors(radiosity: Array, exposure: float, white: float) -> Array:
    """Return the colors a screen shows for diffuse surfaces.

    A surface of radiosity B has the radiance L = B/π in every direction. Radiances up to `white`
    are compressed to L (1 + L/white²)/(1 + L) (Reinhard et al., Photographic tone reproduction
    for digital images, 2002, eq. 4), which leaves them as they are if white is 1.

    radiosity (…) float [W/m²]: Channels of linear RGB.
    exposure: Factor on the radiance.
    white: The exposed radiance that is shown as white.
    Returns colors (…) float32: sRGB, in [0, 1].
    """
    radiance = np.clip(exposure * radiance_of_radiosity(radiosity), 0.0, white)
    linear = radiance * (1.0 + radiance / white**2) / (1.0 + radiance)
    colors = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return colors.astype(np.float32)
