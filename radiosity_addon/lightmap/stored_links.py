"""Links at the finest level: what the gather points saw, kept."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field

import numpy as np

from ..solver.aiming import AimedRays
from ..solver.arrays import Array
from ..solver.scratch import Scratch
from .interpolate import Interpolation
from .source_means import mean_steps


@dataclass(frozen=True)
class StoredLinks:
    """What the gather points saw, and how they speak for the texels.

    Attributes
    ----------
    sources : (g, rays) int32
        Rows of the table of radiosity: texels by number, parts of elements and cells of texels after them
        (see `HitNumbers` for what they are before the table is made); NOTHING and the sky negative.
    spread : Interpolation
    aimed : AimedRays
        What some of the points ask apart.
    """

    sources: Array
    spread: Interpolation
    aimed: AimedRays = field(default_factory=AimedRays.none)

    def irradiance_steps(
        self, table: Array, threads: int = 0, scratch: Scratch | None = None
    ) -> Generator[float, None, Array]:
        """Compute (n, 3) what a table of radiosity sends to the texels; yields the fraction done."""
        mean = yield from mean_steps(table, self.sources, threads)
        return self.spread_out(table, mean, threads, scratch)

    def spread_out(
        self, table: Array, mean: Array, threads: int = 0, scratch: Scratch | None = None
    ) -> Array:
        """Add what aimed rays brought to (g, 3) `mean`, and carry it from the gather points to the texels."""
        aimed = self.aimed
        for channel in range(table.shape[1] if len(aimed.row) else 0):
            values = table[:, channel][aimed.sources]
            values[aimed.sources < 0] = 0.0
            mean[aimed.row, channel] += np.einsum("ak,ak->a", values, aimed.weights)
        return self.spread(mean, threads, scratch)
