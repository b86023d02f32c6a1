"""Filling the texels that no triangle covers, so that filtering never meets an empty one.

Near the charts each uncovered texel takes the weighted mean of its covered neighbors, ring by
ring; being a mean over all eight directions it prefers none. What is farther than the rings is
filled from ever coarser means of the covered texels (a pyramid), so that mip levels stay
bright too. Covered texels are never changed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]

CHUNK = 1 << 20
"""Texels that are halved at once; bounds the temporaries to about 40 MB."""

_NEIGHBORS = tuple(
    (row, column, 1.0 if row == 0 or column == 0 else 0.5)
    for row in (-1, 0, 1)
    for column in (-1, 0, 1)
    if (row, column) != (0, 0)
)


def dilate(pixels: Float32, coverage: Bool, rings: int = 8) -> Float32:
    """Fill every uncovered texel of a page.

    pixels (height, width, channels) float32: Only covered texels are read.
    coverage (height, width) bool.
    rings: How many texels past the charts are filled by neighbors' means; the rest coarsely.
    Returns (height, width, channels) float32: A new array; all zero if nothing is covered.
    """
    result = np.where(coverage[..., None], pixels, np.float32(0)).astype(np.float32)
    fill(result, coverage, rings)
    return result


def fill(pixels: Float32, coverage: Bool, rings: int = 8) -> None:
    """Fill every uncovered texel of a page in place; they must be 0."""
    if not coverage.any():
        return
    filled = coverage.copy()
    for _ in range(rings):
        if not _grow(pixels, filled):
            return
    _fill_coarsely(pixels, filled)


def _grow(pixels: Float32, filled: Bool) -> bool:
    """Fill one ring around what is filled, in place; False if there was nothing to fill."""
    height, width = filled.shape
    padded = np.pad(filled, 1)
    near = np.zeros_like(filled)
    for row, column, _ in _NEIGHBORS:
        near |= padded[1 + row : 1 + row + height, 1 + column : 1 + column + width]
    rows, columns = np.nonzero(near & ~filled)
    if not len(rows):
        return False
    total = np.zeros((len(rows), pixels.shape[2]))
    weights = np.zeros(len(rows))
    for row, column, weight in _NEIGHBORS:
        y, x = rows + row, columns + column
        known = padded[y + 1, x + 1]
        total[known] += weight * pixels[y[known], x[known]]
        weights += weight * known
    pixels[rows, columns] = total / weights[:, None]
    filled[rows, columns] = True
    return True


def _fill_coarsely(pixels: Float32, filled: Bool) -> None:
    """Fill the texels of a page that are not filled yet.

    Each takes the mean of the filled texels in the smallest of the blocks of 2, 4, 8 … texels
    around it that holds any.
    """
    height, width = filled.shape
    if filled.all() or (height == 1 and width == 1):
        return
    coarse = np.empty(((height + 1) // 2, (width + 1) // 2, pixels.shape[2]), dtype=np.float32)
    known = np.empty(coarse.shape[:2], dtype=bool)
    # In bands of an even number of rows.
    band = max(CHUNK // width // 2, 1)
    for first in range(0, len(coarse), band):
        in_band = slice(first, first + band)
        coarse[in_band], known[in_band] = _halved(
            pixels[2 * first :][: 2 * band], filled[2 * first :][: 2 * band]
        )
    _fill_coarsely(coarse, known)
    for first in range(0, len(coarse), band):
        rows = slice(2 * first, min(2 * (first + band), height))
        wide = coarse[first : first + band].repeat(2, axis=0).repeat(2, axis=1)
        empty = ~filled[rows]
        pixels[rows][empty] = wide[: rows.stop - rows.start, :width][empty]


def _halved(pixels: Float32, filled: Bool) -> tuple[Float32, Bool]:
    """Return the means of blocks of 2 × 2 texels over those that are filled, and which blocks have any."""
    height, width = filled.shape
    pad = ((0, height % 2), (0, width % 2))
    weight = np.pad(filled, pad).astype(np.float32)
    values = np.pad(pixels, (*pad, (0, 0))) * weight[..., None]
    half_height, half_width = weight.shape[0] // 2, weight.shape[1] // 2
    count = weight.reshape(half_height, 2, half_width, 2).sum(axis=(1, 3))
    total = values.reshape(half_height, 2, half_width, 2, -1).sum(axis=(1, 3))
    return np.asarray(total / np.maximum(count, 1)[..., None]), np.asarray(count > 0)
