"""Links at the finest level: what the gather points saw, kept."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, tiles
from ...solver.gather import AimedRays
from ..points import Interpolation
from .source_means import mean_of_sources

AIMED_ROWS = 1 << 14
"""Points whose aimed rays are looked up at once; bounds the temporaries to a few MB."""


@dataclass(frozen=True)
class GatherLinks:
    """What the gather points saw, run by run of their rays, and how these speak for the texels.

    Attributes
    ----------
    sources : (g, rays) int32
        Rows of the table of radiosity: texels by number, parts of elements and cells of texels after them
        (see `HitTable` for what they are before the table is made); NOTHING and the sky negative.
    spread : Interpolation
    aimed : AimedRays
        What some of the points ask apart.
    tints : (g, rays, 3) float16 or None
        What the light of each ray is multiplied with on its way through glass; None where there is none.
    run : (g,) int16 or None
        Which of its point's runs of rays each row is, one after the other from 0; None if all have one.
    """

    STORED = ("sources", "spread", "aimed", "tints")

    sources: Array
    spread: Interpolation
    aimed: AimedRays = field(default_factory=AimedRays.none)
    tints: Array | None = None
    run: Array | None = None

    def irradiance(
        self,
        table: Array,
        threads: int = 0,
        scratch: Scratch | None = None,
        progress: Progress = SILENT,
    ) -> Array:
        """Return (n, 3) what a table of radiosity sends to the texels."""
        mean = mean_of_sources(
            table, self.sources, threads, scratch=scratch, tints=self.tints, progress=progress
        )
        return self.spread_out(table, mean, threads, scratch)

    def spread_out(
        self, table: Array, mean: Array, threads: int = 0, scratch: Scratch | None = None
    ) -> Array:
        """Add what aimed rays brought to (g, 3) `mean`, and carry it from the gather points to the texels."""
        aimed = self.aimed
        for rows in tiles(len(aimed.row), AIMED_ROWS):
            row, sources, weights = aimed.row[rows], aimed.sources[rows], aimed.weights[rows]
            for channel in range(table.shape[1]):
                values = table[:, channel][sources]
                values[sources < 0] = 0.0
                of_channel = weights if weights.ndim == 2 else weights[..., channel]
                mean[row, channel] += np.einsum("ak,ak->a", values, of_channel)
        return self.spread(mean, threads, scratch)

    def mark_aims(self, aims: Array, marked: Array) -> None:
        """Mark in (g,) bool the points whose aimed rays met a marked row of the table, (rows,) bool."""
        aimed = self.aimed
        for rows in tiles(len(aimed.row), AIMED_ROWS):
            aims[aimed.row[rows][marked[aimed.sources[rows]].any(axis=1)]] = True
