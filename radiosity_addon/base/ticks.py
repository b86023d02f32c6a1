"""Round numbers along an axis, and how they are written."""

from __future__ import annotations

import math


def linear_ticks(low: float, high: float, most: int = 7) -> tuple[float, ...]:
    """Return the multiples of 1, 2 or 5 times a power of ten within [low, high], at most `most` of them."""
    decade = math.floor(math.log10((high - low) / most))
    steps = [float(f"{step}e{decade}") for step in (1, 2, 5, 10, 20)]
    step = next(step for step in steps if (high - low) / step < most)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return tuple(number * step for number in range(first, last + 1))


def tick_label(value: float) -> str:
    """Return a number in few characters: 0.25, 20, 5k, 2M, 1e-4."""
    for unit, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if unit <= abs(value) < 1000 * unit:
            return f"{value / unit:g}{letter}"
    if value and not 1e-2 <= abs(value) < 1e4:
        mantissa, exponent = f"{value:.2e}".split("e")
        return f"{float(mantissa):g}e{int(exponent)}"
    return f"{value:g}"
