"""Reflectance and emission at lightmap texels: constants of their triangles, or means of images."""

from __future__ import annotations

import numpy as np

from ...numerics import Array, marked, row_numbers, stratified_square, tiles, trim
from ...scene import CHANNELS, Scene, where_there
from .rasterization import FOOTPRINT
from .texel_geometry import TexelGeometry

SAMPLES = 16
"""Points of a texel at which images are looked up."""

CHUNK = 1 << 14
"""Texels looked up at once; their temporaries take about 60 MB."""

WHOLE_TEXEL = 1.0
"""The width of whole texels, whose mean reflectance counts where other surfaces see them."""

__all__ = ["FOOTPRINT", "WHOLE_TEXEL", "texel_materials"]


def texel_materials(scene: Scene, geometry: TexelGeometry, width: float = WHOLE_TEXEL) -> tuple[Array, Array]:
    """Average reflectance and emission over the middle `width` of every texel.

    Returns reflectance, emission (n, 3): Of the existing part of the surface; emission in W/m².
    """
    reflectance, emission = (geometry.scratch.empty((len(geometry), 3)) for _ in range(2))
    for tile in tiles(len(geometry)):
        triangle = geometry.triangle[tile]
        reflectance[tile], emission[tile] = scene.reflectance[triangle], scene.emission[triangle]
    if scene.images is None:
        return reflectance, emission
    images = scene.images
    textured = row_numbers(marked(len(geometry), lambda tile: images.textured[geometry.triangle[tile]]))
    for first in range(0, len(textured), CHUNK):
        rows = textured[first : first + CHUNK]
        weights = geometry.sample_weights(rows, stratified_square(rows, SAMPLES, 0), width)
        triangle = np.repeat(geometry.triangle[rows], SAMPLES)
        found = scene.images.at(triangle, weights[:, :, 1:].reshape(-1, 2))
        mean = found.reshape(len(rows), SAMPLES, CHANNELS).mean(axis=1, dtype=np.float64)
        reflectance[rows], emission[rows] = where_there(mean)
        trim()
    return reflectance, emission
