"""Pictures of the texels while they are being lit, as often as costs next to nothing."""

from __future__ import annotations

import time

import numpy as np

from ...lightmap.lighting import LightSoFar
from ...lightmap.texels import NO_TEXEL, TexelGeometry
from ...numerics import Array
from .pictures import TexelPicture, TexelSurfaces

SECONDS = 0.25
"""Between two pictures, at least."""

SHARE = 0.01
"""Of the time at most goes into making pictures."""

MAX_PICTURE_WIDTH = 1024
"""Pages of more pixels are shown coarser: what is drawn live has to get to the graphics card each time."""


class TexelPictures:
    """Makes pictures of what is known so far."""

    def __init__(self, so_far: LightSoFar) -> None:
        self._so_far = so_far
        self._shown, self._next = 0, 0.0
        self._surfaces: TexelSurfaces | None = None

    def next(self, _: object = None) -> TexelPicture | None:
        """Return a picture if there is something new and it is time."""
        started = time.perf_counter()
        so_far = self._so_far
        if so_far.geometry is None or so_far.version == self._shown or started < self._next:
            return None
        if self._surfaces is None:
            self._surfaces = lit_surfaces(so_far.geometry)
        picture = TexelPicture(self._surfaces, so_far.radiosity())
        self._shown = so_far.version
        taken = time.perf_counter() - started
        self._next = started + max(SECONDS, taken / SHARE)
        return picture


def lit_surfaces(geometry: TexelGeometry) -> TexelSurfaces:
    """Return the triangles with a lightmap, and which texels lie on them."""
    triangle = np.flatnonzero(geometry.page_of_triangle >= 0).astype(np.int32)
    page = geometry.page_of_triangle[triangle]
    pages = [coarser(index, MAX_PICTURE_WIDTH) for index in geometry.index]
    stretch = np.array([stretch for _, stretch in pages], dtype=np.float32)
    return TexelSurfaces(
        geometry.triangles[triangle].astype(np.float32),
        geometry.uv[triangle] * stretch[page][:, None, None],
        page,
        triangle,
        tuple(index for index, _ in pages),
    )


def coarser(index: Array, widest: int) -> tuple[Array, float]:
    """Return numbers of texels on a page of at most `widest` pixels, of every block one texel's.

    And what UVs are to be multiplied with, for the last block may reach beyond the page.
    """
    every = -(-len(index) // widest)
    if every == 1:
        return index, 1.0
    count = -(-len(index) // every)
    padded = np.full((count * every, count * every), NO_TEXEL, dtype=index.dtype)
    padded[: len(index), : len(index)] = index
    blocks = padded.reshape(count, every, count, every).max(axis=(1, 3))
    return np.asarray(blocks), len(index) / (count * every)
