"""Numbers of what rays find where no surface answers: they index a table of radiosity from its end.

Numbers of surfaces start at 0; the caller of a gather defines them (`lightmap/transport/hit_table.py`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...lights import SkyTable
from ...numerics import Array
from ...rays import Hits

UNNUMBERED = -1
"""Left to resolvers: no number yet, or one that something which moved made stale."""

NOTHING = -2
"""A ray that left through the surface it started on, or that brings no light."""

SKY = -3
"""The sky's first cell; the others count down from it (see `SkyTable`)."""

Resolver = Callable[[Hits], Array]
"""Hits → (n,) int32: the number under which a hit's radiosity will be looked up."""


def sky_numbers(sky: SkyTable, directions: Array) -> Array:
    """Return (n,) the numbers of rays that leave the scene in some directions."""
    return np.asarray(SKY - sky.cells(directions))


def lowest_number(sky: SkyTable) -> int:
    """Return the number of the sky's last cell."""
    return SKY + 1 - len(sky.radiosity)


def table_end(sky: SkyTable) -> Array:
    """Return (cells + 2, 3) the last rows of a table of radiosity [W/m²]: the sky's cells, and two dark."""
    return np.concatenate([sky.radiosity[::-1], np.zeros((-1 - SKY, 3))])


def values_of(values: Array, elements: Array) -> Array:
    """Return the (e, …) values at elements (n,); 0 at NOTHING."""
    found = np.zeros((len(elements), *values.shape[1:]))
    there = elements != NOTHING
    found[there] = values[elements[there]]
    return found
