"""Bilinear look-ups: which texels they read."""

from __future__ import annotations

import numpy as np

from .arrays import Array


def texels_around(place: Array, width: Array | int, height: Array | int) -> tuple[Array, Array]:
    """Find the texels that bilinear look-ups read; beyond the centers of border texels the image is constant.

    place (…, 2): In texels; a texel's middle is at a half.
    width, height int or (…,) int: Of the image of each.
    Returns texel (…, 4) int: Row by row through the image: lower left, lower right, upper left, upper right.
    Returns share (…, 2): How far between them, to the right and up.
    """
    size = np.stack(np.broadcast_arrays(width, height), axis=-1)
    place = np.clip(place - 0.5, 0.0, size - 1.0)
    low = np.minimum(place.astype(np.int64), np.maximum(size - 2, 0))
    first = low[..., 1] * width + low[..., 0]
    right, up = np.minimum(size[..., 0] - 1, 1), np.where(size[..., 1] > 1, width, 0)
    return np.stack([first, first + right, first + up, first + right + up], axis=-1), place - low
