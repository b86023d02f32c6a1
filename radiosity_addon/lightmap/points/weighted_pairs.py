"""What gather points weigh for texels, kept until all texels are weighed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics import Array


@dataclass(frozen=True)
class WeightedPairs:
    """What was weighed when the first `levels` levels of points were there.

    texels (n,) int: Ascending; they were no points themselves.
    texel, point, weight (p,) int, int32, float32: Pairs with a weight above 0, sorted by texel.
    """

    levels: int
    texels: Array
    texel: Array
    point: Array
    weight: Array

    @staticmethod
    def nothing() -> WeightedPairs:
        """Return what is known before anything is weighed."""
        none = np.zeros(0, dtype=np.int32)
        return WeightedPairs(0, none, none, none, np.zeros(0, dtype=np.float32))

    def pairs_of(self, texels: slice) -> tuple[Array, Array, Array]:
        """Return texels, points and weights of a run of texels."""
        part = run_of(self.texel, texels)
        return self.texel[part], self.point[part], self.weight[part]


def run_of(ascending: Array, texels: slice) -> slice:
    """Return where a run of texels is in an ascending array of them."""
    # Bounds of another type would have the whole array converted.
    bounds = np.array([texels.start, texels.stop], dtype=ascending.dtype)
    return slice(*np.searchsorted(ascending, bounds))
