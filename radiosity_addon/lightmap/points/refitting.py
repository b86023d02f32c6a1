"""An interpolation of which some texels are weighed again."""

from __future__ import annotations

import numpy as np

from ...numerics import Array, run_numbers, run_starts
from ..texels import TexelGeometry
from .interpolation import CHUNK, GatherPoints, Interpolation, linear_weights


def refit(
    points: GatherPoints, geometry: TexelGeometry, before: Interpolation, number: Array, unsure: Array
) -> Interpolation:
    """Weigh the gather points around some texels as `fit` does; the others keep their weights.

    Parameters
    ----------
    before : Interpolation
        Of earlier points.
    number : (g,) int
        What each of these is numbered among `points`.
    unsure : (n,) bool
        The texels to weigh again.

    Raises
    ------
    ValueError
        If nothing speaks for a texel.
    """
    count = np.diff(np.append(before.first, len(before.point)))
    stays = np.repeat(~unsure, count)
    kept = number[before.point[stays]], before.weight[stays]
    count[unsure], *found = _weights_around(points, geometry, np.flatnonzero(unsure))
    first = run_starts(count)
    point, weight = np.empty(int(count.sum()), np.int32), np.empty(int(count.sum()), np.float32)
    for texels, values in ((~unsure, kept), (unsure, found)):
        place = run_numbers(count[texels], first[texels])
        point[place], weight[place] = values
    return Interpolation(first, point, weight)


def _weights_around(
    points: GatherPoints, geometry: TexelGeometry, texels: Array
) -> tuple[Array, Array, Array]:
    """Return how many entries each of (k,) ascending texels has, and their points and weights in order."""
    counts, numbers, weights = [np.zeros(0, np.int64)], [np.zeros(0, np.int32)], [np.zeros(0, np.float32)]
    for start in range(0, len(texels), CHUNK):
        chunk = texels[start : start + CHUNK]
        texel, point, kernel = points.weighed(chunk)
        count = np.bincount(np.searchsorted(chunk, texel), minlength=len(chunk))
        if not count.all():
            raise ValueError("a texel has no gather point in reach: it should have become one")
        along = geometry.position[points.texel[point]] - geometry.position[texel]
        counts.append(count)
        numbers.append(point.astype(np.int32))
        weights.append(linear_weights(along, kernel, count))
    return np.concatenate(counts), np.concatenate(numbers), np.concatenate(weights)
