"""Making the two sides of a seam agree, as bilinear filtering sees them.

Least squares over the texels that are read along seams: Σ length (a(x) − b(x))² over places x on
the seams, where a and b are bilinear look-ups on either side, plus Σ λ (v − v₀)² over the texels,
solved by conjugate gradients. Places where a and b differ a lot are left out. Texels outside the charts,
which dilation made up, give way easily; those whose center is on the surface hardly. No texel leaves the
range of the values that were read next to it, so dark texels stay dark, and nothing turns negative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...numerics import Array, trim
from ..texels import NO_TEXEL, TexelGeometry
from .seams import Seams

Float32 = NDArray[np.float32]

HOLD_COVERED, HOLD_EDGE, HOLD_OUTSIDE = 1.0, 0.1, 0.01
"""λ of texels whose center is on the surface, of those of which only a part is, and of dilated ones."""

MOST_STEP = 0.5
"""Sides that differ by more than this part of their mean are lit differently: the edge of a shadow or of a
hood lies there, or a strip too narrow to show more than its mean. One value would be wrong on both."""

MAX_ITERATIONS = 40
"""Conjugate-gradient steps at most; …"""

TOLERANCE = 1e-4
"""… or until the residual has fallen to this part."""


def stitch_in_place(pages: Sequence[Float32], geometry: TexelGeometry, seams: Seams) -> None:
    """Stitch dilated pages, (height, width, channels) each, where they are.

    Texels farther outside the charts than filtering reaches keep their dilated values.
    """
    if not len(seams):
        return
    texel, inverse = np.unique(seams.texel, return_inverse=True)
    flat = [page.reshape(-1, page.shape[-1]) for page in pages]
    ends = np.cumsum([0, *(len(page) for page in flat)])
    on_pages = np.searchsorted(texel, ends)
    hold = np.full(len(texel), HOLD_OUTSIDE)
    values = np.empty((len(texel), pages[0].shape[-1]), dtype=pages[0].dtype)
    own = [(slice(*on_pages[number : number + 2]), ends[number]) for number in range(len(flat))]
    for page, index, (on_page, first) in zip(flat, geometry.index, own, strict=True):
        values[on_page] = page[texel[on_page] - first]
        numbers = index.ravel()[texel[on_page] - first]
        covered = numbers != NO_TEXEL
        inside = geometry.center_inside[numbers[covered]]
        hold[on_page][covered] = np.where(inside, HOLD_COVERED, HOLD_EDGE)
    rows = replace(seams, texel=inverse.reshape(seams.texel.shape))
    values = stitch(values, hold, rows)
    for page, (on_page, first) in zip(flat, own, strict=True):
        page[texel[on_page] - first] = values[on_page]
    trim()


def stitch(values: Array, hold: Array, seams: Seams) -> Array:
    """Return the texels' values with both sides of every seam brought together.

    values (n, k): Of all texels of all pages, the dilated ones too.
    hold (n,): How strongly each keeps its value: λ.
    Returns values (n, k): A new array of the same type; equal bit for bit where no seam is near.
    """
    result = np.array(values)
    seams = _lit_alike(seams, values)
    if not len(seams):
        return result
    texel, inverse = np.unique(seams.texel, return_inverse=True)
    system = _System(inverse.reshape(len(seams), 8), seams, hold[texel], len(texel))
    before = values[texel].astype(np.float64)
    after = before + system.solve(before)
    low, high = _range(system.texel, before)
    result[texel] = np.clip(after, low, high)
    return result


def _lit_alike(seams: Seams, values: Array) -> Seams:
    """Return the places whose two sides are about as bright."""
    one, other = seams.sides(values).sum(axis=2, dtype=np.float64).T
    alike = np.abs(one - other) <= 0.5 * MOST_STEP * (one + other)
    return Seams(seams.texel[alike], seams.weight[alike], seams.length[alike], seams.triangle[alike])


class _System:
    """The normal equations (DᵀLD + Λ) c = −DᵀLD v₀ of the corrections c, D the differences over seams."""

    def __init__(self, texel: Array, seams: Seams, hold: Array, count: int) -> None:
        self.texel = texel
        sign = np.array([1.0, -1.0])[None, :, None]
        self._weight = (seams.weight * sign).reshape(len(seams), 8) * np.sqrt(seams.length)[:, None]
        self._hold, self._count = hold[:, None], count
        diagonal = self._hold[:, 0] + np.bincount(texel.ravel(), (self._weight**2).ravel(), minlength=count)
        self._inverse_diagonal = 1.0 / diagonal[:, None]

    def _gap(self, values: Array) -> Array:
        """DᵀLD v."""
        result = np.empty_like(values)
        for channel in range(values.shape[1]):
            gap = (values[:, channel][self.texel] * self._weight).sum(axis=1)
            result[:, channel] = np.bincount(
                self.texel.ravel(), (gap[:, None] * self._weight).ravel(), minlength=self._count
            )
        return result

    def solve(self, values: Array) -> Array:
        """Return (m, k) the corrections, channel by channel with steps of their own."""
        correction = np.zeros_like(values)
        residual = -self._gap(values)
        start = np.sqrt((residual**2).sum(axis=0))
        ahead = self._inverse_diagonal * residual
        direction = ahead.copy()
        product = (residual * ahead).sum(axis=0)
        for _ in range(MAX_ITERATIONS):
            going = np.sqrt((residual**2).sum(axis=0)) > TOLERANCE * start
            if not going.any():
                break
            applied = self._gap(direction) + self._hold * direction
            curvature = (direction * applied).sum(axis=0)
            step = np.where(going & (curvature > 0), product / np.where(curvature > 0, curvature, 1.0), 0.0)
            correction += step * direction
            residual -= step * applied
            ahead = self._inverse_diagonal * residual
            following = (residual * ahead).sum(axis=0)
            direction = (
                ahead
                + np.where(product > 0, following / np.where(product > 0, product, 1.0), 0.0) * direction
            )
            product = following
        return correction


def _range(texel: Array, values: Array) -> tuple[Array, Array]:
    """Return (m, k) the least and largest value among all texels read together with each."""
    read = values[texel]
    low, high = np.full_like(values, np.inf), np.full_like(values, -np.inf)
    least = np.repeat(read.min(axis=1)[:, None], texel.shape[1], axis=1)
    largest = np.repeat(read.max(axis=1)[:, None], texel.shape[1], axis=1)
    np.minimum.at(low, texel.ravel(), least.reshape(-1, values.shape[1]))
    np.maximum.at(high, texel.ravel(), largest.reshape(-1, values.shape[1]))
    return low, high
