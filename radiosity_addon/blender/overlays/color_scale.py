"""False colors: numbers as colors, and the numbers next to the scale."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...base import linear_ticks, tick_label
from ...numerics import Array

_DARK_TO_BRIGHT = (
    (0.10, 0.05, 0.35),
    (0.12, 0.30, 0.80),
    (0.10, 0.65, 0.75),
    (0.25, 0.75, 0.30),
    (0.95, 0.85, 0.20),
    (0.95, 0.50, 0.10),
    (0.80, 0.08, 0.08),
)
"""From little to much, in the order of lighting designers' plots; sRGB."""

_BLUE_TO_RED = (
    (0.10, 0.25, 0.80),
    (0.55, 0.70, 0.95),
    (0.92, 0.92, 0.92),
    (0.95, 0.60, 0.50),
    (0.75, 0.08, 0.08),
)
"""From below 0 to above it."""

_ROUND = (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 12)

NEARLY_ALL = 98.0
"""Percentile that an automatic scale reaches: a few texels next to a lamp would leave the rest no colors."""


@dataclass(frozen=True)
class ColorScale:
    """Colors for numbers from `low` to `high`; what is beyond has the color of the end.

    Parameters
    ----------
    low, high : float
    signed : bool
        Whether 0 is in the middle and has a color that is neither warm nor cold.
    """

    low: float
    high: float
    signed: bool = False

    def __call__(self, values: Array) -> Array:
        """Return (…, 3) float32 sRGB for (…) values."""
        stops = np.array(_BLUE_TO_RED if self.signed else _DARK_TO_BRIGHT, dtype=np.float32)
        share = np.clip((values - self.low) / max(self.high - self.low, 1e-30), 0.0, 1.0)
        at = np.linspace(0.0, 1.0, len(stops))
        return np.stack([np.interp(share, at, channel) for channel in stops.T], axis=-1).astype(np.float32)

    def ticks(self) -> tuple[tuple[float, str], ...]:
        """Return the values to write next to the scale, and their texts."""
        return tuple((value, tick_label(value)) for value in linear_ticks(self.low, self.high))


def automatic_scale(values: Array, signed: bool = False) -> ColorScale:
    """Return a scale of round ends that nearly all of the values (n,) lie on; from 0 unless signed."""
    most = float(np.percentile(np.abs(values), NEARLY_ALL)) if len(values) else 0.0
    most = most if most > 0 and np.isfinite(most) else 1.0
    high = _round_above(most)
    return ColorScale(-high if signed else 0.0, high, signed)


def _round_above(value: float) -> float:
    """Return a number of one or two digits that is not below a positive value, and not far above it."""
    decade = math.floor(math.log10(value))
    return next(float(f"{step:g}e{decade}") for step in _ROUND if float(f"{step:g}e{decade}") >= value)
