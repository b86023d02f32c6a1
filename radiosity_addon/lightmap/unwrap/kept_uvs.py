"""What is wrong with lightmap coordinates that a user wants to keep."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...numerics import signed_double_areas
from ..texels import coverage_sum

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]

_OVERLAP = 1.01
"""A texel filled to more than this holds triangles that lie over each other."""

_COLLAPSED = 1e-6
"""Kept UVs whose area is less than this share of their extent, squared, are a line except for rounding."""

_OFF_CENTER = 1e-2
"""Single precision puts coordinates at most this far [texels] off a texel's center."""


def overlaps(coverage: Float) -> bool:
    """Return whether triangles lie over each other, by the sum of what they cover of each texel."""
    return bool((coverage > _OVERLAP).any())


def has_area(uv: Float) -> bool:
    """Whether (n, 3, 2) UVs cover more than rounding leaves of a line or a point."""
    area = np.abs(signed_double_areas(uv)).sum()
    return bool(area > _COLLAPSED * (np.ptp(uv.reshape(-1, 2), axis=0) ** 2).sum())


def is_collapsed(uv: Float, resolution: int) -> bool:
    """Whether all of (n, 3, 2) UVs are points or lines on texel centers, as `chart_places` makes."""
    spots = uv * resolution - 0.5
    on_center = np.abs(spots - np.rint(spots)).max(axis=1) < _OFF_CENTER
    return bool((on_center & (np.ptp(spots, axis=1) < _OFF_CENTER)).any(axis=1).all())


def are_apart(layouts: list[Float32], resolution: int) -> bool:
    """Return whether no object's UVs lie over another's (nor wholly outside the page)."""
    taken = np.zeros((resolution, resolution))
    for uv in layouts:
        if uv.min() < -1e-6 or uv.max() > 1 + 1e-6:
            return False
        # An object that overlaps itself is its own affair.
        taken += np.minimum(coverage_sum(uv, resolution), 1.0)
    return not overlaps(taken)
