"""Lightmap pages at other sizes."""

from __future__ import annotations

import numpy as np

from ..numerics import Array


def resampled(page: Array, width: int, height: int) -> Array:
    """Return a page (h, w, 3) at another size, as a bilinear filter reads it at the texels' centers."""
    rows, weights = _taps(page.shape[0], height)
    page = page[rows[0]] * (1.0 - weights)[:, None, None] + page[rows[1]] * weights[:, None, None]
    columns, weights = _taps(page.shape[1], width)
    return page[:, columns[0]] * (1.0 - weights)[:, None] + page[:, columns[1]] * weights[:, None]


def _taps(count: int, wanted: int) -> tuple[tuple[Array, Array], Array]:
    """Return the two texels that each new one is between, and the weight of the second."""
    place = np.clip((np.arange(wanted) + 0.5) * count / wanted - 0.5, 0.0, count - 1.0)
    low = np.minimum(place.astype(np.int64), max(count - 2, 0))
    return (low, np.minimum(low + 1, count - 1)), (place - low).astype(np.float32)
