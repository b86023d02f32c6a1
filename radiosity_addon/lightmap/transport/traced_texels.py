"""What has to be known of how texels were lit to light them after something moved, and keep most of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...numerics import Array
from .gather_settings import GatherSettings
from .hit_table import HitTable, TableRows


@dataclass(frozen=True, eq=False)
class GatherPointLayout:
    """Where gather points were chosen, level by level (see `GatherPoints`): of g runs of rays in turn.

    Attributes
    ----------
    texel, level : (g,) int32, int8
        Of the point that takes the run.
    run : (g,) int16
        Which of the point's it is, from 0.
    closeness : (g,) float64 [1/m]
        What the run itself saw.
    farthest : (n,) float64 [m]
    """

    texel: Array
    level: Array
    run: Array
    closeness: Array
    farthest: Array

    def runs(self, times_rays: Sequence[float]) -> float:
        """Return how many runs a point takes in the mean, where levels take `times_rays` as many."""
        relative = np.bincount(self.level, minlength=len(times_rays)) / np.array(times_rays)
        return float(relative.sum()) / max(int((self.run == 0).sum()), 1)


@dataclass(frozen=True, eq=False)
class LightingRecord:
    """How n texels were lit.

    Attributes
    ----------
    settings : GatherSettings
    table : HitTable
        What hits were numbered by.
    points : GatherPointLayout
        Parallel to the stored links' rows.
    rows : TableRows
        Of the table of radiosity.
    bright : (e,) bool
        The elements that rays were aimed at.
    error : float
        Estimate of the light's relative RMS error (see `TexelLight`). Rays traced again are as many.
    """

    settings: GatherSettings
    table: HitTable
    points: GatherPointLayout
    rows: TableRows
    bright: Array
    error: float
