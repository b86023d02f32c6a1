"""Lightmaps as a sum over their sources: after one relighting a source, any strength costs a product.

What a lightmap holds is linear in the strengths, channel by channel. So from exact pages, and what each
changed source adds for itself, those of other strengths follow at once. Stitching and clamps at 0 are not
quite linear: who stops changing things wants exact pages again.
"""

from __future__ import annotations

import numpy as np

from ...base import SILENT, Progress, SceneError
from ...lightmap.images import LightmapPage
from ...numerics import Array
from .kept_bake import KeptBake, relight_pages

MAX_RESPONSE_BYTES = 1 << 28
"""Bytes that responses may take when lightmaps are exact; the last ones are kept, and four in any case."""


class Responses:
    """Pages of a kept bake for strengths near those of exact ones.

    strengths (s, 3).
    pages: Lit exactly by these strengths.
    """

    def __init__(self, kept: KeptBake, strengths: Array, pages: tuple[LightmapPage, ...]) -> None:
        self._kept = kept
        self._of: dict[int, tuple[Array, tuple[Array, ...]]] = {}
        self.set_exact(strengths, pages)

    def set_exact(self, strengths: Array, pages: tuple[LightmapPage, ...]) -> None:
        """Start from other pages, lit exactly."""
        self.strengths = strengths.copy()
        self._pages = tuple(page.pixels for page in pages)
        self.room = max(MAX_RESPONSE_BYTES // max(sum(page.nbytes for page in self._pages), 1), 4)
        """So many sources' responses are kept."""
        self._of = dict(list(self._of.items())[-self.room :])

    def missing(self, strengths: Array) -> list[int]:
        """Return the sources that have changed and whose response is not known."""
        changed = np.flatnonzero((strengths != self.strengths).any(axis=1))
        return [int(source) for source in changed if source not in self._of]

    def unknown(self) -> list[int]:
        """Return all sources whose response is not known."""
        return [source for source in range(len(self.strengths)) if source not in self._of]

    def find(self, source: int, progress: Progress = SILENT) -> None:
        """Find out what a source adds to the lightmaps."""
        unit = self._unit(source)
        only = np.zeros_like(self.strengths)
        only[source] = unit
        pages = relight_pages(self._kept, only, progress)
        # Laid out as the pixels of images are: one after the other, each channel scaled apart.
        self._of[source] = unit, tuple(page.pixels for page in pages)

    def pages(self, strengths: Array) -> tuple[Array, ...]:
        """Return the pages, (h, w, 3) float32 each, for strengths none of whose sources are `missing`."""
        result = [page.copy() for page in self._pages]
        for source in np.flatnonzero((strengths != self.strengths).any(axis=1)):
            unit, response = self._of[int(source)]
            change = strengths[source] - self.strengths[source]
            share = np.where(unit > 0, change / np.where(unit > 0, unit, 1.0), 0.0).astype(np.float32)
            for page, of_unit in zip(result, response, strict=True):
                page += of_unit * share
        for page in result:
            np.maximum(page, 0.0, out=page)
        return tuple(result)

    def _unit(self, source: int) -> Array:
        """Return (3,) a strength for the source in every channel it can have one in."""
        known = self._kept.strengths[source]
        size = float(max(known.max(initial=0.0), self.strengths[source].max(initial=0.0))) or 1.0
        wanted = np.zeros_like(self._kept.strengths)
        wanted[source] = size
        try:
            self._kept.sources.checked(wanted)
        except SceneError:
            return np.asarray(known)
        return np.asarray(wanted[source])
