"""Noise of gathered light shared between texels of one surface that see each other.

The light that neighboring texels gather differs by their noise and by little else, except where it bends.
Steps of diffusion over 3 × 3 texels average over more and more of them. How many a texel takes is decided
texel by texel, by an estimate of the squared error: what the steps change beyond what they change of the
noise itself is bias, and what they leave of the noise is variance (Stein's unbiased risk estimate; Li, Wu and
Chuang, SURE-based optimization for adaptive sampling and reconstruction, 2012). The choice is kept: for
other light the operator is the same, and so it is linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...numerics import Array, Scratch, fill_chunks, tiles
from ...rays import SAGITTA, SIGHT_LIFT, RayCaster, free_segment
from ..texels import CORNERS, NO_TEXEL, TexelGeometry

PASSES = (1, 2, 4, 8, 16)
"""Steps that a texel may take, besides none."""

RISK_PASSES = 8
"""Means over 3 × 3 texels that the estimate of the squared error is averaged by."""

APART, ALIKE, OFF_PLANE = 1.6, 0.9, 0.35
"""Neighbors on the page are neighbors on the surface if they are no farther apart in the world than this many
steps of the page, their normals have this cosine at least, and they are this part of a step off each other's
plane at most."""

BIAS = 2.0
"""What the bias counts: it shows where noise does not, at shadows."""

BAND = 1 << 20
"""Pixels whose texels are placed at once; bounds the temporaries to 20 MB."""

CHUNK = 1 << 15
"""Texels smoothed at once; bounds the temporaries to about 20 MB a thread."""

_ALONE, _SHARED = 1, 2
"""Kinds of texels, besides those in the open, 0: neighbors are of one kind."""

_STEPS = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)])
"""(8, 2): rows and columns from a texel to its neighbors."""

_THERE = (np.arange(256)[:, None] >> np.arange(8)) & 1


def _diffusion() -> Array:
    """Return (256, 9) weights of a step: of the texel and the neighbors that a number's bits name.

    Two texels give each other the same part, so that a step of all texels loses no light. Texels that take
    different numbers of steps lose or gain a little.
    """
    given = _THERE * 0.25 * 0.5 ** np.abs(_STEPS).sum(axis=1)
    return np.concatenate([1.0 - given.sum(axis=1, keepdims=True), given], axis=1).astype(np.float32)


def _means() -> Array:
    """Return (256, 9) weights of the mean over a texel and the neighbors that a number's bits name."""
    there = np.concatenate([np.ones((256, 1)), _THERE], axis=1)
    return np.asarray(there / there.sum(axis=1, keepdims=True)).astype(np.float32)


_DIFFUSION, _MEANS = _diffusion(), _means()


@dataclass(frozen=True, eq=False)
class Smoothing:
    """How n texels share noise with their neighbors: a linear operator.

    Attributes
    ----------
    alike : (n,) uint8
        Which of the eight neighbors on the page, bit by bit, belong to a texel.
    passes : (n,) uint8
        Its steps.
    """

    alike: Array
    passes: Array

    def __call__(self, geometry: TexelGeometry, values: Array, threads: int = 0) -> Array:
        """Return (n, k) float32 values (n, k) of the texels, smoothed."""
        grid = _Grid(geometry, self.alike, threads)
        current = columns([values], geometry.scratch)
        result = columns([values], geometry.scratch)
        most, done = int(self.passes.max(initial=0)), 0
        for passes in PASSES:
            if passes > most:
                break
            for _ in range(passes - done):
                current = grid.weighed(_DIFFUSION, current)
            done = passes
            for rows in tiles(len(values)):
                chosen = self.passes[rows] == passes
                result[rows][chosen] = current[rows][chosen]
        return result


def choose_smoothing(
    geometry: TexelGeometry, alike: Array, parts: Sequence[Array], noise: Array, threads: int = 0
) -> tuple[Smoothing, Array]:
    """Choose how many steps each texel takes.

    Parameters
    ----------
    alike : (n,) uint8
        See `Smoothing`.
    parts : sequence of (n, 3) float
        What the texels gathered, in parts that take the same steps [W/m²].
    noise : (n, 3) float
        A sample of the noise of their sum [W/m²].

    Returns
    -------
    smoothing : Smoothing
    smoothed : (n, 3 parts) float32
        The parts after these steps [W/m²].
    """
    grid, scratch, count = _Grid(geometry, alike, threads), geometry.scratch, len(alike)
    start = columns([*parts, noise], scratch)
    current, smoothed, done = start, columns(parts, scratch), 0
    least, passes = scratch.empty(count, np.float32), np.zeros(count, dtype=np.uint8)
    for wanted in (0, *PASSES):
        for _ in range(wanted - done):
            current = grid.weighed(_DIFFUSION, current)
        done = wanted
        risk = scratch.empty((count, 1), np.float32)
        for rows in tiles(count):
            risk[rows, 0] = _risk(start[rows], current[rows])
        for _ in range(RISK_PASSES):
            risk = grid.weighed(_MEANS, risk)
        for rows in tiles(count):
            better = (risk[rows, 0] < least[rows]) | (wanted == 0)
            passes[rows][better], least[rows][better] = wanted, risk[rows, 0][better]
            smoothed[rows][better] = current[rows, :-3][better]
    return Smoothing(alike, passes), smoothed


def _risk(start: Array, current: Array) -> Array:
    """Return (r,) estimates of the squared error of parts and noise (r, 3 k), before and after some steps."""
    risk = np.zeros(len(start), dtype=np.float32)
    for channel in range(3):
        change = current[:, channel::3] - start[:, channel::3]
        left = current[:, channel - 3]
        risk += BIAS * (change[:, :-1].sum(axis=1) ** 2 - change[:, -1] ** 2) + left**2
    return risk


def columns(parts: Sequence[Array], scratch: Scratch) -> Array:
    """Return (n, k) float32: arrays (n, …) side by side, each column in one piece."""
    width = sum(part.shape[1] for part in parts)
    result = scratch.empty((width, len(parts[0])), np.float32).T
    for rows in tiles(len(result)):
        first = 0
        for part in parts:
            result[rows, first : first + part.shape[1]] = part[rows]
            first += part.shape[1]
    return result


def alike_neighbors(geometry: TexelGeometry, caster: RayCaster, alone: Array, threads: int = 0) -> Array:
    """Return (n,) uint8: which neighbors on the page, bit by bit, continue a texel's surface and see it.

    Texels that geometry divides or hoods, alone (n,), are neighbors of such texels only, and if corner by
    corner they see each other: along a wall's foot they hold alike mixtures, which nothing in the open does.
    Those that triangles share are neighbors of each other only, too.
    """
    grid = _Grid(geometry, None, threads)
    found, mutual = (geometry.scratch.empty(len(geometry), np.uint8) for _ in range(2))
    kind = np.uint8(_ALONE) * alone
    if geometry.shared is not None:
        kind[geometry.shared.number >= 0] = _SHARED
    width = np.sqrt(geometry.texel_area)
    candidates = partial(_alike, geometry, caster, kind, width, grid)
    fill_chunks(candidates, found, len(geometry), CHUNK, threads)
    fill_chunks(partial(_mutual, grid, found), mutual, len(geometry), CHUNK, threads)
    return mutual


def _alike(
    geometry: TexelGeometry, caster: RayCaster, kind: Array, width: Array, grid: _Grid, rows: slice
) -> Array:
    """Return (r,) uint8 the neighbors of a run of texels."""
    texel = np.arange(rows.start, rows.stop)
    position, normal = geometry.position[rows], geometry.normal[rows]
    found = np.zeros(len(texel), dtype=np.uint8)
    lift = SIGHT_LIFT * caster.surface_offset
    for bit, step in enumerate(_STEPS):
        other = grid.neighbor(rows, step)
        pair = np.flatnonzero((other >= 0) & (kind[rows] == kind[other]))
        far = other[pair]
        along = geometry.position[far] - position[pair]
        distance = np.linalg.norm(along, axis=1)
        stride = width[geometry.triangle[texel[pair]]] * np.hypot(*step)
        facing = np.einsum("pk,pk->p", normal[pair], geometry.normal[far])
        height = np.abs(np.einsum("pk,pk->p", along, geometry.surface_normal[texel[pair]]))
        near = np.flatnonzero(
            (distance < APART * stride) & (facing > ALIKE) & (height < OFF_PLANE * stride) & (distance > 0)
        )
        pair, far, facing, distance = pair[near], far[near], facing[near], distance[near]
        rise = (lift + SAGITTA * distance * np.sqrt(np.maximum(1.0 - facing, 0.0)))[:, None]
        way = along[near] + rise * (geometry.normal[far] - normal[pair])
        length = np.linalg.norm(way, axis=1)
        free = caster.unoccluded(position[pair] + rise * normal[pair], way / length[:, None], length)
        pair, far = pair[free], far[free]
        found[pair[_cut_alike(geometry, caster, kind, texel[pair], far)]] |= np.uint8(1 << bit)
    return found


def _cut_alike(geometry: TexelGeometry, caster: RayCaster, kind: Array, one: Array, other: Array) -> Array:
    """Return (p,) bool: texels see each other corner by corner, or nothing divides them."""
    alike = np.ones(len(one), dtype=bool)
    alone = np.flatnonzero(kind[one] == _ALONE)
    begin, end = (
        geometry.sample(texels, np.broadcast_to(CORNERS, (len(texels), 4, 2)))
        + (SIGHT_LIFT * caster.surface_offset * geometry.surface_normal[texels])[:, None]
        for texels in (one[alone], other[alone])
    )
    free = free_segment(caster, begin.reshape(-1, 3), end.reshape(-1, 3))
    alike[alone] = free.reshape(-1, 4).all(axis=1)
    return alike


class _Grid:
    """Texels by their places on the pages, and sums over those that belong together."""

    def __init__(self, geometry: TexelGeometry, alike: Array | None, threads: int) -> None:
        self.alike, self._threads, self._scratch = alike, threads, geometry.scratch
        # A rim of no texels around each page.
        self._width = np.array([len(page) + 2 for page in geometry.index], dtype=np.int64)
        first = np.cumsum([0, *self._width**2])
        self._page = geometry.page
        self._number = self._scratch.empty(int(first[-1]), np.int32)
        few = first[-1] <= np.iinfo(np.int32).max
        self._place = self._scratch.empty(len(geometry), np.int32 if few else np.int64)
        for width, start, page in zip(self._width, first, geometry.index, strict=False):
            padded = self._number[start : start + width * width].reshape(width, width)
            padded[[0, -1]] = padded[:, [0, -1]] = NO_TEXEL
            for band in tiles(len(page), max(BAND // len(page), 1)):
                padded[1:-1][band, 1:-1] = page[band]
                row, column = np.nonzero(page[band] != NO_TEXEL)
                texel = page[band][row, column]
                self._place[texel] = start + (row + band.start + 1) * width + column + 1

    def neighbor(self, rows: slice | Array, step: Array) -> Array:
        """Return (r,) the texels one step away on the page, or −1."""
        below = step[0] * self._width[self._page[rows]]
        return np.asarray(self._number[self._place[rows] + below + step[1]])

    def weighed(self, weights: Array, values: Array) -> Array:
        """Return (n, k) float32: sums over texels and their neighbors by (256, 9) weights, in `columns`."""
        result = self._scratch.empty(values.shape[::-1], np.float32).T
        fill_chunks(partial(_sums, self, weights, values), result, len(values), CHUNK, self._threads)
        return result


def _mutual(grid: _Grid, alike: Array, rows: slice) -> Array:
    """Return (r,) uint8 those neighbors of a run of texels that have them for neighbors as well."""
    found = alike[rows].copy()
    for bit, step in enumerate(_STEPS):
        # Steps are sorted: the last is the way back from the first.
        back = alike[grid.neighbor(rows, step)] >> (len(_STEPS) - 1 - bit)
        found &= ~((~back & 1) << bit).astype(np.uint8)
    return found


def _sums(grid: _Grid, weights: Array, values: Array, rows: slice) -> Array:
    """Return (r, k) float32 the sums of a run of texels."""
    assert grid.alike is not None
    has = rows.start + np.flatnonzero(grid.alike[rows])
    there = grid.alike[has]
    # Where there is no neighbor its weight is 0, whatever is read.
    terms = [(weights[:, 0].take(there), has)]
    terms += [(weights[:, bit + 1].take(there), grid.neighbor(has, step)) for bit, step in enumerate(_STEPS)]
    result = np.array(values[rows], order="F")
    for channel, column in enumerate(values.T):
        result[has - rows.start, channel] = sum(weight * column.take(texel) for weight, texel in terms)
    return result
