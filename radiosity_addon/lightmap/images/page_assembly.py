"""Texels' values on their pages: dilated past the charts' borders, and stitched at seams."""

from __future__ import annotations

import numpy as np

from ...numerics import TILE, Array, tiles
from ..texels import TexelGeometry
from .dilate import fill
from .page import LightmapPage
from .seams import Seams
from .stitch import stitch_in_place


def texel_pages(
    geometry: TexelGeometry, values: Array, seams: Seams | None, rings: int
) -> tuple[LightmapPage, ...]:
    """Put texels' values on their pages, filled `rings` past the charts' borders, and stitch the seams.

    values (n, 3).
    seams: None stitches nothing.
    """
    pages = []
    for index in geometry.index:
        pixels = geometry.scratch.zeros((*index.shape, 3), np.float32)
        coverage = geometry.scratch.empty(index.shape, bool)
        for rows in tiles(len(index), max(TILE // len(index), 1)):
            coverage[rows] = index[rows] >= 0
            pixels[rows][coverage[rows]] = values[index[rows][coverage[rows]]]
        fill(pixels, coverage, rings)
        pages.append(LightmapPage(pixels, coverage))
    if seams is not None and len(seams):
        stitch_in_place([page.pixels for page in pages], geometry, seams)
    return tuple(pages)
