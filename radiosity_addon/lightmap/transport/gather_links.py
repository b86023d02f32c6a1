"""Links at the finest level: what the gather points saw, kept."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, tiles
from ...solver.gather import AimedRays
from ..points import Interpolation
from .ray_runs import any_of_runs, mean_over_runs
from .source_means import mean_of_sources

AIMED_ROWS = 1 << 14
"""Runs whose aimed rays are looked up at once; bounds the temporaries to a few MB."""


@dataclass(frozen=True)
class GatherLinks:
    """What the gather points saw in g runs of rays, and how the points speak for the texels.

    Attributes
    ----------
    sources : (g, rays) int32
        Rows of the table of radiosity: texels by number, parts of elements and cells of texels after them
        (see `HitTable` for what they are before the table is made); NOTHING and the sky negative.
    spread : Interpolation
        Of the points, each the mean of its runs.
    aimed : AimedRays
        What some of the runs ask apart.
    tints : (g, rays, 3) float16 or None
        What the light of each ray is multiplied with on its way through glass; None where there is none.
    run : (g,) int16 or None
        Which of its point's runs each is, one after the other from 0; None if all points have one.
    """

    STORED = ("sources", "spread", "aimed", "tints", "run")

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
        """Add what aimed rays brought to (g, 3) `mean`, and carry it from the runs to the texels."""
        aimed = self.aimed
        for rows in tiles(len(aimed.row), AIMED_ROWS):
            row, sources, weights = aimed.row[rows], aimed.sources[rows], aimed.weights[rows]
            for channel in range(table.shape[1]):
                values = table[:, channel][sources]
                values[sources < 0] = 0.0
                of_channel = weights if weights.ndim == 2 else weights[..., channel]
                mean[row, channel] += np.einsum("ak,ak->a", values, of_channel)
        return self.from_runs(mean, threads, scratch)

    def from_runs(self, values: Array, threads: int = 0, scratch: Scratch | None = None) -> Array:
        """Carry (g, k) values of the runs to (n, k) of the texels."""
        of_points = values if self.run is None else mean_over_runs(values, self.run, scratch)
        return self.spread(of_points, threads, scratch)

    def any_of_runs(self, marked: Array) -> Array:
        """Return (n,) bool: which texels take from any of the marked runs, (g,) bool."""
        return self.spread.any_of(marked if self.run is None else any_of_runs(marked, self.run))

    def mark_aims(self, aims: Array, marked: Array) -> None:
        """Mark in (g,) bool the runs whose aimed rays met a marked row of the table, (rows,) bool."""
        aimed = self.aimed
        for rows in tiles(len(aimed.row), AIMED_ROWS):
            aims[aimed.row[rows][marked[aimed.sources[rows]].any(axis=1)]] = True
