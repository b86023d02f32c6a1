"""Texels' values on their pages: dilated past the charts' borders, and stitched at seams."""

from __future__ import annotations

import numpy as np

from ..bake_scene import LightmapPage
from ..solver.arrays import Array
from .dilate import dilate
from .seams import Seams
from .stitch import stitch_pages
from .texel_geometry import TexelGeometry


def texel_pages(
    geometry: TexelGeometry, values: Array, seams: Seams | None, rings: int
) -> tuple[LightmapPage, ...]:
    """Put texels' values on their pages, filled `rings` past the charts' borders, and stitch the seams.

    Parameters
    ----------
    values : (n, 3) float
    seams : Seams or None
        None stitches nothing.
    """
    pages = []
    for number, index in enumerate(geometry.index):
        pixels = np.zeros((*index.shape, 3), dtype=np.float32)
        coverage = index >= 0
        pixels[coverage] = values[geometry.page == number][index[coverage] - geometry.first(number)]
        pages.append(LightmapPage(dilate(pixels, coverage, rings), coverage))
    if seams is None or not len(seams):
        return tuple(pages)
    stitched = stitch_pages([page.pixels for page in pages], geometry, seams)
    return tuple(LightmapPage(pixels, page.coverage) for pixels, page in zip(stitched, pages, strict=True))
