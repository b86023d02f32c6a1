"""What has to be known of how texels were lit to light them after something moved, and keep most of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...numerics import Array
from ..points import GatherPoints
from ..texels import Crossings
from .part_links import HitNumbers

if TYPE_CHECKING:
    from .gather_settings import GatherSettings


@dataclass(frozen=True, eq=False)
class GatherPointLayout:
    """Where g gather points were chosen, level by level (see `GatherPoints`).

    Attributes
    ----------
    texel, level : (g,) int32, int8
    closeness : (g,) float64 [1/m]
    farthest : (n,) float64 [m]
    """

    texel: Array
    level: Array
    closeness: Array
    farthest: Array

    @staticmethod
    def of(points: GatherPoints) -> GatherPointLayout:
        """Keep what was chosen."""
        return GatherPointLayout(points.texel, points.level, points.closeness, points.farthest)


@dataclass(frozen=True, eq=False)
class LightingRecord:
    """How n texels were lit.

    Attributes
    ----------
    settings : GatherSettings
    crossings : Crossings
    numbers : HitNumbers
        What hits were numbered by.
    points : GatherPointLayout
        Parallel to the stored links' rows.
    small : (s,) int64
        The parts that the table's last rows are, see `Parts`.
    bright : (e,) bool
        The elements that rays were aimed at.
    error : float
        Estimate of the light's relative RMS error (see `TexelLight`). Rays traced again are as many.
    """

    settings: GatherSettings
    crossings: Crossings
    numbers: HitNumbers
    points: GatherPointLayout
    small: Array
    bright: Array
    error: float

    def numbered(self, rows: Array) -> Array:
        """Return the numbers that rows of the table had as hits; negative ones stay."""
        first = self.numbers.elements
        if len(self.small) == 0:
            return rows
        number = self.numbers.texel_count + self.small.take(np.maximum(rows - first, 0), mode="clip")
        return np.asarray(np.where(rows >= first, number, rows))

    @property
    def row_count(self) -> int:
        """Rows of the table: texels, elements and smaller parts."""
        return self.numbers.elements + len(self.small)
