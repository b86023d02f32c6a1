"""Texels near nothing but their own plane: they need no probes for crossing geometry.

Space is cut into cells a few texels wide, and every cell that a piece of a triangle may reach remembers a
plane, or that there are several. A texel whose surroundings lie in cells of its own plane, and in
empty ones, is clear. The test errs on the safe side: a texel next to a wall is not clear although it
ends before the wall, nor is one on a curved surface.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import product

import numpy as np

from ...numerics import Array, Scratch, fill_chunks, tiles
from .texel_geometry import TexelGeometry

CELL = 2.0
"""Width of the cells, in widths of a texel's surroundings, the median."""

MOST_CELLS = 1 << 24
"""Beyond, cells share places: some 80 MB."""

MAX_PIECES = 1 << 16
"""More pieces of triangles than this and than four a texel are not made: then no texel is clear."""

PLANE_DISTANCE = 0.45
"""Surfaces this near each other's planes, as a part of the clearance, are one: twice that still is within."""

ROUNDED = 1e-7
"""A sine less than this, of planes that are the same except for rounding, is 0."""

CHUNK = 1 << 13
"""Texels worked on at once; bounds the temporaries to about 5 MB a thread."""

CHUNK_PIECES = 1 << 15
"""Pieces worked on at once; bounds the temporaries to about 20 MB."""

_CORNERS = list(product((0, 1), repeat=3))


def clear_texels(
    geometry: TexelGeometry, outset: float, height: float, clearance: float, threads: int = 1
) -> Array:
    """Find texels around which nothing rises off their plane.

    outset: Size of the square around a texel in its plane, relative to the texel.
    height: And how far up that reaches, in widths of the texel.
    clearance: What rises less than this off the plane does not count [m].
    threads: 0 means all cores.
    Returns clear (n,) bool: Certain where true; unknown where false.
    """
    clear = np.zeros(len(geometry), dtype=bool)
    if len(geometry) == 0:
        return clear
    low, high = _surroundings(geometry, outset, height, clearance, threads)
    cells = _Cells(*_extent(low, high))
    pieces = _pieces(geometry.triangles, cells, max(MAX_PIECES, 4 * len(geometry)), geometry.scratch)
    if pieces is None:
        return clear
    cells.fill(geometry, *pieces, PLANE_DISTANCE * clearance)
    del pieces
    judge = partial(_all_flat, cells, geometry, low, high, PLANE_DISTANCE * clearance)
    fill_chunks(judge, clear, len(clear), CHUNK, threads)
    return clear


def _surroundings(
    geometry: TexelGeometry, outset: float, height: float, clearance: float, threads: int
) -> tuple[Array, Array]:
    """Return (n, 3) lower and upper bounds of the surroundings of each texel."""
    low, high = (geometry.scratch.empty((len(geometry), 3)) for _ in range(2))
    bound = partial(_surroundings_of, geometry, outset, height, clearance)
    fill_chunks(bound, (low, high), len(geometry), CHUNK, threads)
    return low, high


def _surroundings_of(
    geometry: TexelGeometry, outset: float, height: float, clearance: float, part: slice
) -> tuple[Array, Array]:
    rows = np.arange(part.start, part.stop)
    square = geometry.squares(rows)
    first, opposite = square[:, 0], square[:, 2]
    middle = 0.5 * (first + opposite)
    half = np.abs(square[:, 1] - first)
    half += np.abs(square[:, 3] - first)
    half *= 0.5 * outset
    diagonal = opposite - first
    width = outset * np.sqrt(np.einsum("nk,nk->n", diagonal, diagonal))
    up = (height * width + 2.0 * clearance)[:, None] * geometry.surface_normal[rows]
    low = middle - half + np.minimum(up, 0.0) - clearance
    return low, middle + half + np.maximum(up, 0.0) + clearance


def _extent(low: Array, high: Array) -> tuple[Array, Array, float]:
    """Return the bounds of all boxes between (n, 3) `low` and `high`, and how wide cells are to be."""
    widest = np.empty(len(low))
    bottom, top = np.full(3, np.inf), np.full(3, -np.inf)
    for rows in tiles(len(low)):
        widest[rows] = _largest(high[rows] - low[rows])
        bottom = np.minimum(bottom, low[rows].min(axis=0))
        top = np.maximum(top, high[rows].max(axis=0))
    return bottom, top, CELL * float(np.median(widest, overwrite_input=True))


class _Cells:
    """Cubic cells over the part of space where there are texels.

    low, high (3,).
    size float [m].
    """

    def __init__(self, low: Array, high: Array, size: float) -> None:
        self.low, self.high = low - size, high + size
        self.size = size
        counts = np.ceil((self.high - self.low) / size).astype(np.int64) + 1
        self._strides = np.array([1, counts[0], counts[0] * counts[1]])
        self._places = int(min(counts.astype(np.float64).prod(), MOST_CELLS))
        self.owner = np.full(self._places, -1, dtype=np.int32)
        self.several = np.zeros(self._places, dtype=bool)

    def corners_of(self, low: Array, high: Array) -> Iterator[Array]:
        """Yield eight times (n,) int: the cells at the corners of boxes no wider than a cell."""
        bounds = [np.floor((bound - self.low) / self.size).astype(np.int64) for bound in (low, high)]
        bounds = [bound * self._strides for bound in bounds]
        for x, y, z in _CORNERS:
            yield (bounds[x][:, 0] + bounds[y][:, 1] + bounds[z][:, 2]) % self._places

    def fill(self, geometry: TexelGeometry, corners: Array, triangle: Array, tolerance: float) -> None:
        """Note the planes of pieces (p, 3, 3) of triangles (p,), no wider than a cell."""
        places = geometry.scratch.empty((len(_CORNERS), len(corners)), np.int32)
        for rows in tiles(len(corners), CHUNK_PIECES):
            low, high = _bounds(corners[rows])
            low -= tolerance
            high += tolerance
            for corner, place in enumerate(self.corners_of(low, high)):
                places[corner, rows] = place
        first = np.ascontiguousarray(geometry.triangles[:, 0])
        for place in places:
            for rows in tiles(len(corners)):
                self.owner[place[rows]] = triangle[rows]
        for place in places:
            for rows in tiles(len(corners), CHUNK_PIECES):
                owner = self.owner.take(place[rows])
                elsewhere = np.flatnonzero(owner != triangle[rows])
                others_triangle = owner[elsewhere]
                apart = corners[rows].take(elsewhere, axis=0) - first.take(others_triangle, axis=0)[:, None]
                plane = geometry.face_normals.take(others_triangle, axis=0)
                off = _largest(np.abs(np.einsum("pck,pk->pc", apart, plane)))
                self.several[place[rows][elsewhere[off > tolerance]]] = True


def _all_flat(
    cells: _Cells, geometry: TexelGeometry, low: Array, high: Array, tolerance: float, rows: slice
) -> Array:
    """Return (n,) bool: nothing but the planes of texels is in the cells that boxes around them touch."""
    low, high = low[rows], high[rows]
    extent = high - low
    flat = _largest(extent) <= cells.size
    own, normal = geometry.triangle[rows], geometry.surface_normal[rows]
    # No point of a box is farther from its texel than this.
    reach = np.sqrt(np.einsum("nk,nk->n", extent, extent))
    position = geometry.position[rows]
    for place in cells.corners_of(low, np.minimum(high, low + cells.size)):
        flat &= ~cells.several.take(place)
        owner = cells.owner.take(place)
        elsewhere = np.flatnonzero(flat & (owner >= 0) & (owner != own))
        others_triangle = owner[elsewhere]
        plane, at = geometry.face_normals.take(others_triangle, axis=0), position.take(elsewhere, axis=0)
        off = np.abs(np.einsum("nk,nk->n", at - geometry.triangles[others_triangle, 0], plane))
        cosine = np.einsum("nk,nk->n", normal.take(elsewhere, axis=0), plane)
        bend = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        # The square root of a rounding error of 1 − 1 is not a bend.
        off += reach[elsewhere] * np.where(bend < ROUNDED, 0.0, bend)
        flat[elsewhere[off > tolerance]] = False
    return flat


def _pieces(triangles: Array, cells: _Cells, most: int, scratch: Scratch) -> tuple[Array, Array] | None:
    """Cut triangles (t, 3, 3) into pieces (p, 3, 3) no wider than a cell; None if it takes too many.

    Left out is what lies where there are no cells. Also returns each piece's triangle, (p,).
    """
    corners, triangle = triangles, np.arange(len(triangles), dtype=np.int32)
    # Slightly narrower, because a piece's bounds are widened by the rounding error.
    widest = cells.size * 0.999
    done = scratch.rows(9, np.float64), scratch.rows(1, np.int32)
    count = 0
    while len(corners):
        halves = scratch.rows(9, np.float64), scratch.rows(1, np.int32)
        for rows in tiles(len(corners), CHUNK_PIECES):
            chunk, chunk_triangle = corners[rows], triangle[rows]
            low, high = _bounds(chunk)
            within = (high >= cells.low) & (low <= cells.high)
            inside = within[:, 0] & within[:, 1] & within[:, 2]
            small = _largest(high - low) <= widest
            ready, split = np.flatnonzero(inside & small), np.flatnonzero(inside & ~small)
            done[0].extend(chunk[ready])
            done[1].extend(chunk_triangle[ready])
            halves[0].extend(_halved(chunk[split]))
            halves[1].extend(np.repeat(chunk_triangle[split], 2))
            count += len(ready)
        corners, triangle = halves[0].all().reshape(-1, 3, 3), halves[1].all()[:, 0]
        if count + len(corners) > most + len(triangles):
            return None
    return done[0].all().reshape(-1, 3, 3), done[1].all()[:, 0]


def _bounds(corners: Array) -> tuple[Array, Array]:
    """Return (p, 3) twice: the lower and upper bounds of (p, 3, 3) triangles."""
    first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.minimum(np.minimum(first, second), third), np.maximum(np.maximum(first, second), third)


def _largest(vectors: Array) -> Array:
    """Return (n,) the largest of each row's three numbers: many times as fast as a maximum along an axis."""
    return np.asarray(np.maximum(np.maximum(vectors[:, 0], vectors[:, 1]), vectors[:, 2]))


def _halved(corners: Array) -> Array:
    """Return (2 n, 3, 3): triangles cut in two across their longest edges."""
    edges = corners[:, [1, 2, 0]] - corners
    longest = np.einsum("nek,nek->ne", edges, edges).argmax(axis=1)
    rows = np.arange(len(corners))
    start, end, tip = (corners[rows, (longest + step) % 3] for step in range(3))
    halves = np.empty((len(corners), 2, 3, 3))
    halves[:, 0, 0], halves[:, 1, 1] = start, end
    halves[:, 0, 1] = halves[:, 1, 0] = 0.5 * (start + end)
    halves[:, :, 2] = tip[:, None]
    return halves.reshape(-1, 3, 3)
