"""Statistics of the light on a surface: minimum, mean, maximum and uniformity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics import Array, tiles
from ..texels import TOUCHED


@dataclass(frozen=True)
class LightStatistics:
    """Of one surface.

    minimum, mean, maximum: In the unit of what was given; the mean is by area.
    """

    minimum: float
    mean: float
    maximum: float

    @property
    def uniformity(self) -> float | None:
        """U₀, the minimum over the mean, as in EN 12464-1; None without light."""
        return self.minimum / self.mean if self.mean > 0 else None

    def as_dict(self) -> dict[str, float | None]:
        """The numbers as the report names them."""
        return {
            "minimum": self.minimum,
            "mean": self.mean,
            "maximum": self.maximum,
            "uniformity": self.uniformity,
        }


def light_statistics(values: Array, areas: Array) -> LightStatistics | None:
    """Sum up (n,) values of texels that show (n,) float of the surface each; None without any area."""
    total = weighed = 0.0
    least, largest = np.inf, -np.inf
    for rows in tiles(len(values)):
        counted = values[rows][areas[rows] > 0]
        total += float(areas[rows].sum())
        weighed += float(values[rows] @ areas[rows])
        least = min(least, float(counted.min(initial=np.inf)))
        largest = max(largest, float(counted.max(initial=-np.inf)))
    return LightStatistics(least, weighed / total, largest) if total > 0 else None


def lit_texels(state: Array) -> Array:
    """Return which of (n,) texels show the visible surface: those that are not divided, hidden or enclosed.

    The others show a mean over two sides, or light that nobody sees. All texels, if there are no others.
    """
    whole = (state == 0) | (state == TOUCHED)
    return whole if whole.any() else np.ones(len(state), dtype=bool)
