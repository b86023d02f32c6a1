"""Texels that many small triangles share: points and lines on the page.

A triangle is *collapsed* if its lightmap coordinates are one point, or lie on a horizontal or vertical line.
The atlas collapses charts that are smaller than a texel to the center of a texel, and charts that are thinner
to the centers of a row of texels, where bilinear filtering reads no other row. A collapsed triangle
covers no area of the page, but it is there: along a line each texel holds the triangles' *pieces* between its
two borders. The light of a shared texel is the mean over its pieces, by their areas in the world.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...numerics import (
    Array,
    areas,
    clip_half_plane,
    numbered,
    pick_in_runs,
    run_numbers,
    running_sums,
    signed_double_areas,
    tiles,
)
from ...scene import Scene
from .clip import polygon_area_centroid, sample_polygons

_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
"""Of a triangle, as weights of its second and third corner."""

CHUNK_TRIANGLES = 1 << 16
"""Triangles that are cut at once; their temporaries take some ten MB."""


class Pieces(NamedTuple):
    """Parts of collapsed triangles, each within one texel.

    triangle, row, column (p,) int32.
    polygon (p, 5, 2): Corners, as weights of the triangle's second and third corner; the last may repeat.
    share (p,): Of the triangle's area.
    """

    triangle: Array
    row: Array
    column: Array
    polygon: Array
    share: Array


def is_collapsed(uv: Array) -> NDArray[np.bool_]:
    """Return (n,) which of (n, 3, 2) triangles are a point or lie on a horizontal or vertical line."""
    return np.asarray((uv == uv[:, :1]).all(axis=1).any(axis=1))


def collapsed_pieces(uv: Array, resolution: int) -> Pieces:
    """Cut collapsed triangles at the borders of texels; ascending by triangle.

    uv (n, 3, 2) float32: Triangles in [0, 1]; what is not collapsed or lies outside is left out.
    """
    found = list(_pieces_in_chunks(uv, resolution))
    return Pieces(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _pieces_in_chunks(uv: Array, resolution: int) -> Iterator[Pieces]:
    """Yield the pieces of some triangles at a time, at least once."""
    for rows in tiles(max(len(uv), 1), CHUNK_TRIANGLES):
        pieces = _cut_at_texels(uv[rows], resolution)
        yield pieces._replace(triangle=pieces.triangle + np.int32(rows.start))


def _cut_at_texels(uv: Array, resolution: int) -> Pieces:
    place = uv.astype(np.float64) * resolution
    inside = np.isfinite(place).all(axis=(1, 2)) & (place >= 0).all(axis=(1, 2))
    rows = np.flatnonzero(is_collapsed(uv) & inside & (place <= resolution).all(axis=(1, 2)))
    place = place[rows]
    level = (place == place[:, :1]).all(axis=1)[:, 1]
    # Along its line, and across.
    along = np.where(level[:, None], place[..., 0], place[..., 1])
    across = np.where(level, place[:, 0, 1], place[:, 0, 0])
    last = resolution - 1
    first = np.clip(np.floor(along.min(axis=1)), 0, last).astype(np.int64)
    count = np.clip(np.ceil(along.max(axis=1)).astype(np.int64) - first, 1, resolution - first)
    of = np.repeat(np.arange(len(rows)), count)
    texel = run_numbers(count, first)
    other = np.clip(np.floor(across[of]), 0, last).astype(np.int64)
    corners = np.concatenate([np.broadcast_to(_CORNERS, (len(of), 3, 2)), along[of][..., None]], axis=2)
    cut = np.flatnonzero(count[of] > 1)
    polygon = np.concatenate([corners, corners[:, 2:], corners[:, 2:]], axis=1)
    low = clip_half_plane(corners[cut], corners[cut, :, 2] - texel[cut, None])
    polygon[cut] = clip_half_plane(low, texel[cut, None] + 1 - low[..., 2])
    share = 2.0 * areas(polygon[..., :2])
    kept = share > 0
    row, column = np.where(level[of], other, texel), np.where(level[of], texel, other)
    return Pieces(
        rows[of[kept]].astype(np.int32),
        row[kept].astype(np.int32),
        column[kept].astype(np.int32),
        polygon[kept, :, :2],
        share[kept],
    )


def largest_piece(pieces: Pieces, area: Array, resolution: int) -> tuple[Array, Array, Array]:
    """Return the texels that hold pieces, row by row, the largest one's triangle, and its centroid.

    area (n,): Of the triangles in the world.
    Returns texel (t,) int64, triangle (t,) int32, and weights (t, 3) of the triangle's corners.
    """
    texel = pieces.row.astype(np.int64) * resolution + pieces.column
    order = np.lexsort((pieces.triangle, -pieces.share * area[pieces.triangle], texel))
    texel, start = np.unique(texel[order], return_index=True)
    chosen = order[start]
    return texel, pieces.triangle[chosen], _centroids(pieces.polygon[chosen])


def texel_areas(uv: Array, area: Array, resolution: int) -> Array:
    """Return (n,) what a texel is of each triangle in the world [m²]: of a collapsed one, all that shares it.

    uv (n, 3, 2) float32, area (n,): All of a page, or of an object that shares texels with no other.
    """
    flat = 0.5 * np.abs(signed_double_areas(uv.astype(np.float64))) * resolution**2
    # Far below what single-precision UVs can enclose, and far enough from 0 for any area.
    found = area / np.maximum(flat, 1e-200)
    # Without their polygons, which take most of the memory.
    parts = [
        (pieces.triangle, pieces.row.astype(np.int64) * resolution + pieces.column, pieces.share)
        for pieces in _pieces_in_chunks(uv, resolution)
    ]
    triangle, texel, share = (np.concatenate(part) for part in zip(*parts, strict=True))
    if len(triangle):
        own = share * area[triangle]
        texel = numbered(texel)
        held = np.bincount(texel, own)[texel]
        # Of the texel that holds its largest piece.
        order = np.lexsort((held, own, triangle))
        found[triangle[order]] = held[order]
    return np.asarray(found)


def _centroids(polygon: Array) -> Array:
    """Return (p, 3) the weights of the triangles' corners at the centroids of pieces (p, 5, 2)."""
    second = polygon_area_centroid(polygon)[1]
    return np.concatenate([1.0 - second.sum(axis=1, keepdims=True), second], axis=1)


class SharedTexels:
    """The pieces of the s shared ones among n texels.

    number (n,) int32: Which shared texel each texel is, or −1.
    area (s,): Of all pieces, in the world [m²].
    facing, shading (s, 3): Unit: the pieces' mean normal, and mean shading normal.
    pieces, start (s + 1,): Sorted by texel; where each texel's begin.
    """

    def __init__(self, number: Array, of: Array, pieces: Pieces, main: Array, scene: Scene) -> None:
        """Sort the pieces by their texels.

        of (p,) int: The shared texel of each piece.
        main (s,) int: The triangle that stands for each texel.
        """
        order = np.argsort(of, kind="stable")
        of = of[order]
        self.number = number
        self.triangle, self._polygon = pieces.triangle[order], pieces.polygon[order]
        self.start = np.searchsorted(of, np.arange(len(main) + 1))
        self.of = of
        normals = scene.face_normals
        self.piece_area = pieces.share[order] * scene.areas[self.triangle]
        self.area = np.bincount(of, self.piece_area, len(main))
        self.facing = self._mean(normals[self.triangle], normals[main])
        weights = _centroids(self._polygon)
        smooth = np.einsum("pc,pck->pk", weights, scene.normals[self.triangle])
        self.shading = self._mean(smooth, self.facing)
        turned = np.einsum("sk,sk->s", self.shading, self.facing) <= 0
        self.shading[turned] = self.facing[turned]
        # What faces away from the mean would start its rays behind itself.
        ahead = np.einsum("pk,pk->p", normals[self.triangle], self.facing[of])
        self._running = running_sums(self.piece_area * np.maximum(ahead, 1e-3))
        self._main = np.zeros(len(main), dtype=np.int64)
        own = np.flatnonzero(self.triangle == main[of])
        self._main[of[own]] = own

    def _mean(self, vectors: Array, otherwise: Array) -> Array:
        """Return (s, 3) the direction of the pieces' mean vector; where there is none, of another."""
        total = [np.bincount(self.of, self.piece_area * vectors[:, k], len(self.area)) for k in range(3)]
        mean = np.stack(total, axis=-1)
        length = np.linalg.norm(mean, axis=1, keepdims=True)
        clear = length > 1e-3 * self.area[:, None]
        return np.where(clear, mean / np.where(clear, length, 1.0), otherwise)

    def sample(self, shared: Array, u: Array) -> tuple[Array, Array]:
        """Spread points over shared texels (r,) by (r, k, 2) numbers: (r, k) triangles, (r, k, 3) weights."""
        begin, end = (self.start[shared + step][:, None] for step in (0, 1))
        piece, within = pick_in_runs(self._running, u[..., 0], begin, end)
        spots = np.stack([within, u[..., 1].astype(np.float64)], axis=-1).reshape(-1, 1, 2)
        second = sample_polygons(self._polygon[piece.ravel()], spots)[:, 0]
        weights = np.concatenate([1.0 - second.sum(axis=1, keepdims=True), second], axis=1)
        return self.triangle[piece], np.maximum(weights, 0.0).reshape(*piece.shape, 3)

    def sample_main(self, shared: Array, u: Array) -> Array:
        """Return (r, k, 3) weights of points on the piece that stands for each texel."""
        second = sample_polygons(self._polygon[self._main[shared]], u.astype(np.float64))
        weights = np.concatenate([1.0 - second.sum(axis=2, keepdims=True), second], axis=2)
        return np.maximum(weights, 0.0)


def find_shared(
    scene: Scene, uv: Array, page_of_triangle: Array, index: Sequence[Array], owner: Array
) -> SharedTexels | None:
    """Return the texels that belong to collapsed triangles; None if there are none.

    uv (t, 3, 2), page_of_triangle (t,): Of the scene's triangles.
    index: Per page, the numbers of its texels.
    owner (n,) int: The triangle that each texel belongs to.
    """
    collapsed = is_collapsed(uv) & (page_of_triangle >= 0)
    is_shared = np.zeros(len(owner), dtype=bool)
    for tile in tiles(len(owner)):
        is_shared[tile] = collapsed[owner[tile]]
    if not is_shared.any():
        return None
    number = np.cumsum(is_shared, dtype=np.int32) - 1
    number[~is_shared] = -1
    found, owners = [], []
    for page, numbers in enumerate(index):
        rows = np.flatnonzero(collapsed & (page_of_triangle == page))
        pieces = collapsed_pieces(uv[rows], len(numbers))
        texel = numbers[pieces.row, pieces.column]
        own = np.flatnonzero((texel >= 0) & is_shared[texel])
        owners.append(number[texel[own]])
        found.append(Pieces(rows[pieces.triangle[own]], *(part[own] for part in pieces[1:])))
    joined = Pieces(*(np.concatenate(parts) for parts in zip(*found, strict=True)))
    return SharedTexels(number, np.concatenate(owners), joined, owner[is_shared], scene)
