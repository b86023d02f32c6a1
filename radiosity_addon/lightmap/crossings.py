"""Texels that geometry cuts in two: a wall's foot on a floor, the rim of what a box covers.

Such a texel shows the mean of both sides, as it should. Light that comes back from it must
not be the mean: a ray from inside a closed box would then see the lit floor outside. A hit
on a crossed texel is looked up in a whole neighbour that the hit point can see.

What hovers closely over a surface (a window's frame a millimetre off the wall, a door in its
frame) parts light from dark likewise, though nothing stands on the texel, and the gap lets lines
of sight along the surface through. Short probes along the normal tell which texels are *hooded*,
which only partly, and on which side of the hood's rim a hit lies.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from ..solver.arrays import Array
from ..solver.gathering import NOTHING
from ..solver.parallel import chunk_steps
from ..solver.steps import drain
from ..solver.visibility import Hits, RayCaster
from .clearance import clear_texels
from .texel_geometry import NO_TEXEL, TexelGeometry

CHUNK = 1 << 16
"""Texels or hits tested at once; bounds the temporaries to about 60 MB."""

LIFT = 2.0
"""Segments run this many surface offsets above the surface."""

INSET = 0.96
"""Corners are drawn in to this part: a texel that ends at a wall is not crossed by it, …"""

OUTSET = 1.01
"""… but touched, if the wall crosses corners drawn out so far."""

HOOD = 0.25
"""What is nearer above a surface than this part of a texel's width hoods it. Light reaches about as far
into a gap as the gap is high: into a high one it fades over texels, without a hood's sharp rim."""

OPEN_ENOUGH = 0.5
"""A texel answers hits beside the hood over its other part if so much of its footprint lies in the open."""

_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], dtype=np.float32)
_EDGES = np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
_DIAGONALS = np.array([[0, 2], [1, 3]])
_SPOTS = np.array([[u, v] for u in (0.02, 0.5, 0.98) for v in (0.02, 0.5, 0.98)], dtype=np.float32)
_MIDDLES = np.array([[u, v] for u in (0.125, 0.375, 0.625, 0.875) for v in (0.125, 0.375, 0.625, 0.875)])
_AROUND = np.array([[r, c] for r in (-1, 0, 1) for c in (-1, 0, 1) if r or c])


@dataclass(frozen=True)
class CrossedTexels:
    """What `crossing_steps` found of n texels, (n,) bool each but for the last.

    Attributes
    ----------
    cut : geometry stands on them
    touched : they end at geometry; not cut
    rim : a hood's rim is above them
    hooded : all of them is below a hood; neither cut nor at a rim
    open_share : (n,) float64, the part of their footprint that is below no hood
    """

    cut: Array
    touched: Array
    rim: Array
    hooded: Array
    open_share: Array


class Crossings:
    """Which texels are crossed, and where their hits are looked up instead.

    Parameters
    ----------
    geometry : TexelGeometry
    caster : RayCaster
    found : CrossedTexels or None
        What `crossing_steps` found; None finds it.

    Attributes
    ----------
    crossed, touched : (n,) bool
        Crossed are texels that geometry cuts and those at the rim of a hood; none is both.
    alone : (n,) bool
        Texels whose light is like no neighbour's, though a line of sight may join them: crossed or hooded.
    beside : (n,) bool
        Texels next to a crossed one: what stands there takes half of what they see.
    gain : (n,) float64
        How much brighter a texel is where hits ask it than in the mean: below a hood it is dark, and
        only hits in the open are answered by texels at a rim.
    """

    def __init__(
        self, geometry: TexelGeometry, caster: RayCaster, found: CrossedTexels | None = None
    ) -> None:
        self._geometry, self._caster = geometry, caster
        found = drain(crossing_steps(geometry, caster)) if found is None else found
        self._cut, self._hooded = found.cut, found.hooded
        self.crossed, self.touched = found.cut | found.rim, found.touched & ~found.rim
        self.alone = self.crossed | found.hooded
        self._answers = found.rim & ~found.cut & (found.open_share >= OPEN_ENOUGH)
        self.gain = np.where(self._answers, 1.0 / np.maximum(found.open_share, OPEN_ENOUGH), 1.0)
        self.beside = geometry.neighbourhood(self.crossed) & ~self.alone

    def look_up(self, texel: Array, hits: Hits) -> Array:
        """Replace crossed texels, and touched ones from beyond, by whole neighbours on the hit's side.

        Parameters
        ----------
        texel : (h,) int32
            NO_TEXEL is left alone.
        hits : Hits
            Where the rays hit them.

        Returns
        -------
        texel : (h,) int32
            Where no whole neighbour can be seen: NOTHING if the hit is below a hood, and NO_TEXEL
            if the texel is cut, or next to nothing of it in the open.
        """
        result = texel.copy()
        rows = np.flatnonzero((texel != NO_TEXEL) & (self.crossed[texel] | self.touched[texel]))
        for first in range(0, len(rows), CHUNK):
            chunk = rows[first : first + CHUNK]
            position = self._geometry.positions_of(hits.take(chunk))
            apart = self.crossed[texel[chunk]] | ~self._sees_centre(texel[chunk], position)
            result[chunk[apart]] = self._elsewhere(texel[chunk[apart]], position[apart])
        return result

    def _elsewhere(self, texel: Array, position: Array) -> Array:
        """Return (h,) the texels that hits on texels not theirs are looked up in, NO_TEXEL or NOTHING."""
        below = _hooded(self._geometry, self._caster, texel, position[:, None])[:, 0]
        found = self._neighbour(texel, position, below)
        own = (found == NOTHING) & self._answers[texel] & ~below
        found = np.where((found == NOTHING) & ~below, NO_TEXEL, found)
        return np.where(own, texel, found)

    def _sees_centre(self, texel: Array, position: Array) -> Array:
        """Return (h,) whether nothing is between points and the centres of their texels."""
        lift = LIFT * self._caster.surface_offset * self._geometry.surface_normal[texel]
        start, end = position + lift, self._geometry.position[texel] + lift
        return _free(self._caster, start[:, None], end[:, None])[:, 0]

    def _neighbour(self, texel: Array, position: Array, below: Array) -> Array:
        """Return (h,) the nearest whole neighbour visible from each hit, or NOTHING.

        Where a hit is `below` a hood, (h,) bool, the neighbour must be as well, and else must not.
        """
        geometry = self._geometry
        around = np.full((len(texel), len(_AROUND)), NO_TEXEL, dtype=np.int32)
        for page, numbers in enumerate(geometry.index):
            mine = np.flatnonzero(geometry.page[texel] == page)
            row = geometry.row[texel[mine]][:, None] + _AROUND[:, 0]
            column = geometry.column[texel[mine]][:, None] + _AROUND[:, 1]
            inside = (row >= 0) & (row < len(numbers)) & (column >= 0) & (column < len(numbers))
            last = len(numbers) - 1
            near = numbers[np.clip(row, 0, last), np.clip(column, 0, last)]
            around[mine] = np.where(inside, near, NO_TEXEL)
        whole = (around != NO_TEXEL) & ~self.crossed[around]
        whole &= self._hooded[around] == below[:, None]
        normal = geometry.surface_normal[texel]
        # The same surface only: a chart's neighbour on the page may lie anywhere.
        along = geometry.position[around] - position[:, None]
        size = np.linalg.norm(along, axis=2)
        whole &= np.abs(np.einsum("hak,hk->ha", along, normal)) <= 0.1 * size
        whole &= np.einsum("hak,hk->ha", geometry.surface_normal[around], normal) > 0.9
        lift = LIFT * self._caster.surface_offset
        start = np.repeat((position + lift * normal)[:, None], len(_AROUND), axis=1)
        end = geometry.position[around] + lift * geometry.surface_normal[around]
        seen = np.zeros(whole.shape, dtype=bool)
        hit, which = np.nonzero(whole)
        seen[hit, which] = _free(self._caster, start[hit, which][:, None], end[hit, which][:, None])[:, 0]
        size = np.where(seen, size, np.inf)
        best = size.argmin(axis=1)
        every = np.arange(len(texel))
        return np.where(np.isfinite(size[every, best]), around[every, best], NOTHING)


def crossing_steps(
    geometry: TexelGeometry, caster: RayCaster, threads: int = 0
) -> Generator[float, None, CrossedTexels]:
    """Find the texels that geometry cuts, touches or hoods; yields the fraction done."""
    cut, touched, rim, hooded = np.zeros((4, len(geometry)), dtype=bool)
    result = CrossedTexels(cut, touched, rim, hooded, open_share=np.ones(len(geometry)))
    clear = clear_texels(geometry, OUTSET, HOOD, LIFT * caster.surface_offset, threads)
    doubted = np.flatnonzero(~clear)

    def find(part: slice) -> None:
        rows = doubted[part]
        lift = LIFT * caster.surface_offset * geometry.surface_normal[rows][:, None]
        # Of the texel on the page: hits land on the part outside its triangle as well.
        square = geometry.squares(rows) + lift
        middle = square.mean(axis=1, keepdims=True)
        # All of the texel that is on its triangle: hits land all over it, though its light comes
        # from the middle.
        corners, ends = square.copy(), np.flatnonzero(~geometry.whole[rows])
        spots = np.broadcast_to(_CORNERS, (len(ends), 4, 2))
        corners[ends] = geometry.sample(rows[ends], spots, 1.0) + lift[ends]
        centre = geometry.position[rows][:, None] + lift
        from_centre = corners - centre
        cut = ~_segments_free(caster, centre + INSET * from_centre, _EDGES)
        doubtful = ~_segments_free(caster, middle + OUTSET * (square - middle), _DIAGONALS) & ~cut
        some = np.flatnonzero(doubtful)
        cut[some] = ~_segments_free(caster, centre[some] + INSET * from_centre[some], _DIAGONALS)
        result.cut[rows], result.touched[rows] = cut, doubtful & ~cut
        spots = geometry.sample(rows, np.broadcast_to(_SPOTS, (len(rows), *_SPOTS.shape)), 1.0)
        below = _hooded(geometry, caster, rows, spots)
        result.rim[rows] = below.any(axis=1) & ~below.all(axis=1)
        result.hooded[rows] = below.all(axis=1) & ~cut
        at_rim = rows[result.rim[rows]]
        spots = geometry.sample(at_rim, np.broadcast_to(_MIDDLES, (len(at_rim), *_MIDDLES.shape)))
        result.open_share[at_rim] = 1.0 - _hooded(geometry, caster, at_rim, spots).mean(axis=1)

    yield from chunk_steps(find, len(doubted), CHUNK // 4, threads)
    return result


def _hooded(geometry: TexelGeometry, caster: RayCaster, texel: Array, spots: Array) -> Array:
    """Return (n, k) whether something is close above (n, k, 3) spots on texels."""
    lift, normal = LIFT * caster.surface_offset, geometry.surface_normal[texel]
    square = geometry.squares(texel)
    width = np.linalg.norm(square[:, 2] - square[:, 0], axis=1) / np.sqrt(2.0)
    height = np.maximum(HOOD * width, 2.0 * lift)
    probes = np.broadcast_to(normal[:, None], spots.shape).reshape(-1, 3)
    start = (spots + lift * normal[:, None]).reshape(-1, 3)
    free = caster.visible(start, probes, np.repeat(height - lift, spots.shape[1]))
    return np.asarray(~free.reshape(spots.shape[:2]))


def _segments_free(caster: RayCaster, corners: Array, segments: Array) -> Array:
    """Return (n,) whether all segments, pairs of (n, 4, 3) corners, meet nothing."""
    return np.asarray(_free(caster, corners[:, segments[:, 0]], corners[:, segments[:, 1]]).all(axis=1))


def _free(caster: RayCaster, start: Array, end: Array) -> Array:
    """Return (n, k) whether segments between (n, k, 3) points meet nothing."""
    along = (end - start).reshape(-1, 3)
    length = np.linalg.norm(along, axis=1)
    directions = along / np.maximum(length, 1e-300)[:, None]
    free = caster.visible(start.reshape(-1, 3), directions, length)
    return free.reshape(start.shape[:2])
