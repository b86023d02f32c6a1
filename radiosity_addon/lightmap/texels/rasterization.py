"""Which triangle each texel of a lightmap belongs to, and the exact part of it that it shows.

A texel is the unit square [column, column + 1] × [row, row + 1] in texel coordinates; row 0 is
v = 0. It is covered where a triangle overlaps it by a positive area, and it belongs to one
triangle: the one that covers its `CENTER`, else the one with the largest overlap. Its *footprint*
is the overlap, a convex polygon of up to seven corners, over which the lightmap averages. Texels that no
triangle covers may be shared by triangles without an area on the page (`shared_texels.py`).

Candidates are found by row spans (for each triangle and row the columns the triangle reaches), so
the work is proportional to the texels covered, not to bounding boxes; temporaries are chunked at
`CHUNK` pairs, about 60 MB. Footprints are not stored but clipped again where they are needed:
at 4096² they would take a gigabyte.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...numerics import Scratch, plane_weights_at, run_chunks, run_numbers, signed_double_areas, tiles
from .clip import area_in_unit_square, clip_to_unit_square, polygon_area_centroid, sample_polygons
from .shared_texels import collapsed_pieces, is_collapsed, largest_piece

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]
Bool = NDArray[np.bool_]
Selection = slice | NDArray[np.intp] | Bool

CHUNK = 1 << 17
"""(triangle, texel) pairs handled at once."""

UNRESOLVED = 2.0**-23
"""Slivers thinner than this share of the page are rounding of float32 UVs, not coverage."""

_CENTER = 2.0
"""Added to the overlap of a pair that covers the center, so that it beats every other overlap."""

CENTER = (0.501, 0.502)
"""What counts as a texel's center. As in Blender's bake, it is slightly off, so that edges of aligned layouts
do not run through it (`RE_bake_pixels_populate` in source/blender/render/intern/bake.cc)."""

FOOTPRINT = 0.5
"""Width of a texel's footprint, in texels, where its center is covered. Cycles' bake spreads its samples
over just this middle part of a texel, not over the whole of it (docs/decisions/0010)."""

_NOBODY = np.iinfo(np.int32).max


@dataclass(frozen=True)
class Texels:
    """The covered texels of one page, in row-major order.

    resolution: Width and height of the page.
    uv (n_triangles, 3, 2) float32: The triangles that were rasterized, all of the page's.
    row, column (t,) int32: Row 0 is v = 0, the bottom.
    triangle (t,) int32: The triangle the texel belongs to.
    area (t,) float32: Area of the footprint as a fraction of the texel, in (0, 1].
    centroid (t, 3) float32: Barycentric coordinates, in the triangle, of the footprint's centroid.
    center_inside (t,) bool: Whether the triangle covers the texel's center.
    """

    resolution: int
    uv: Float32
    row: Int32
    column: Int32
    triangle: Int32
    area: Float32
    centroid: Float32
    center_inside: Bool

    def __len__(self) -> int:
        return len(self.row)

    def take(self, selection: Selection) -> Texels:
        """Return the selected texels only (a slice, indices or a mask)."""
        return Texels(
            self.resolution,
            self.uv,
            self.row[selection],
            self.column[selection],
            self.triangle[selection],
            self.area[selection],
            self.centroid[selection],
            self.center_inside[selection],
        )

    def coverage(self) -> Bool:
        """Return the page's (resolution, resolution) mask of covered texels."""
        mask = np.zeros((self.resolution, self.resolution), dtype=np.bool_)
        mask[self.row, self.column] = True
        return mask

    def footprints(self) -> Float32:
        """Return (t, 7, 3) footprint corners in barycentric coordinates of each triangle.

        Unused corners repeat the last one. About 400 bytes a texel while it works: ask for
        a few hundred thousand at a time (`take`).
        """
        polygon, origin, _ = _clip(self.uv, self.resolution, self.triangle, self.row, self.column)
        return _weights_inside(polygon, origin).astype(np.float32)


class _TexelPairs(NamedTuple):
    """Overlapping (triangle, texel) pairs: flat texel index, triangle, overlap, center covered."""

    texel: NDArray[np.int64]
    triangle: Int32
    area: Float
    center: Bool


def rasterize(
    uv: Float32, resolution: int, scratch: Scratch | None = None, surface: Float | None = None
) -> Texels:
    """Find every texel that a triangle overlaps, and the one triangle it belongs to.

    uv (n, 3, 2) float32: Triangles in [0, 1], either orientation; what lies outside the page is cut off and
        triangles without area cover nothing, but see `surface`.
    resolution: Width and height of the page in texels.
    scratch: Makes the texels' arrays; None keeps them in memory.
    surface (n,): Areas of the triangles in the world. If given, what no triangle covers belongs to the
        collapsed triangle that has the largest piece there.
    Returns row-major; ties go to the larger overlap, then to the lower triangle index.
    """
    uv = np.ascontiguousarray(uv, dtype=np.float32)
    best = np.zeros(resolution * resolution, dtype=np.float32)
    owner = np.full(resolution * resolution, _NOBODY, dtype=np.int32)
    for pairs in overlapping_pairs(uv, resolution):
        score = (pairs.area + _CENTER * pairs.center).astype(np.float32)
        before = best[pairs.texel]
        np.maximum.at(best, pairs.texel, score)
        wins = score == best[pairs.texel]
        owner[pairs.texel[wins & (score > before)]] = _NOBODY
        np.minimum.at(owner, pairs.texel[wins], pairs.triangle[wins])
    shared = None
    if surface is not None:
        texel, triangle_there, centers = largest_piece(collapsed_pieces(uv, resolution), surface, resolution)
        free = owner[texel] == _NOBODY
        shared = texel[free], centers[free]
        owner[texel[free]], best[texel[free]] = triangle_there[free], _CENTER + 1
    scratch = scratch or Scratch()
    covered = np.flatnonzero(owner != _NOBODY)
    count = len(covered)
    row, column, triangle = (scratch.empty(count, np.int32) for _ in range(3))
    area, centroid = scratch.empty(count, np.float32), scratch.empty((count, 3), np.float32)
    center_inside = scratch.empty(count, np.bool_)
    for tile in tiles(count, CHUNK):
        at = covered[tile]
        row[tile], column[tile] = np.divmod(at, resolution)
        triangle[tile], score = owner[at], best[at]
        area[tile], center_inside[tile] = 1.0, score >= _CENTER
        whole = score >= _CENTER + 1
        numbers = tile.start + np.flatnonzero(whole & ~is_collapsed(uv[owner[at]]))
        centroid[numbers] = center_weights(uv, resolution, triangle[numbers], row[numbers], column[numbers])
        numbers = tile.start + np.flatnonzero(~whole)
        polygon, origin, _ = _clip(uv, resolution, triangle[numbers], row[numbers], column[numbers])
        area[numbers], middle = polygon_area_centroid(polygon)
        centroid[numbers] = _weights_inside(middle[:, None], origin)[:, 0]
    if shared is not None:
        centroid[np.searchsorted(covered, shared[0])] = shared[1].astype(np.float32)
    return Texels(resolution, uv, row, column, triangle, area, centroid, center_inside)


def center_weights(uv: Float32, resolution: int, triangle: Int32, row: Int32, column: Int32) -> Float:
    """Return (p, 3) the barycentric coordinates, each in its triangle, of texels' centers."""
    origin = _around_texels(uv, resolution, triangle, row, column)
    return _weights_inside(np.full((len(triangle), 1, 2), 0.5), origin)[:, 0]


def overlap_areas(uv: Float32, resolution: int, triangle: Int32, row: Int32, column: Int32) -> Float:
    """Return (p,) the part of each texel that its triangle covers, 0 to 1."""
    return area_in_unit_square(_around_texels(uv, resolution, triangle, row, column))


def coverage_sum(uv: Float32, resolution: int) -> Float:
    """Return the (resolution, resolution) sum of all triangles' overlaps with each texel.

    More than 1 means that triangles lie over each other.
    """
    total = np.zeros(resolution * resolution)
    for pairs in overlapping_pairs(np.ascontiguousarray(uv, dtype=np.float32), resolution):
        np.add.at(total, pairs.texel, pairs.area)
    return total.reshape(resolution, resolution)


def sample_footprints(texels: Texels, u: Float, width: float = FOOTPRINT) -> Float32:
    """Place area-uniform points in each texel's footprint.

    texels: t texels.
    u (t, k, 2): Points of the unit square; stratified ones give stratified points, because the map from the
        square to the footprint keeps areas and is continuous within each triangle of the footprint's fan
        (whole texels take the square as it is).
    width: Of the footprint where the center is covered, in texels.
    Returns (t, k, 3) float32: Barycentric coordinates in each texel's triangle.
    """
    result = np.empty((*u.shape[:2], 3), dtype=np.float32)
    for start in range(0, len(texels), CHUNK):
        part = texels.take(slice(start, start + CHUNK))
        widths = np.where(part.center_inside, width, 1.0)
        polygon, origin, whole = _clip(part.uv, part.resolution, part.triangle, part.row, part.column, widths)
        points = np.array(u[start : start + CHUNK], dtype=np.float64)
        cut = np.flatnonzero(~whole)
        points[cut] = sample_polygons(polygon[cut], points[cut])
        points[whole] = 0.5 + (points[whole] - 0.5) * widths[whole, None, None]
        result[start : start + CHUNK] = _weights_inside(points, origin)
    return result


def overlapping_pairs(uv: Float32, resolution: int, centers_only: bool = False) -> Iterator[_TexelPairs]:
    """Yield, in chunks and by ascending triangle, every pair that overlaps by a positive area.

    With `centers_only`, and several times as fast, those whose center lies well inside the
    triangle; their area is given as 1.
    """
    corners = uv.astype(np.float64) * resolution
    double_area = signed_double_areas(corners)
    usable = np.flatnonzero(np.isfinite(corners).all(axis=(1, 2)) & (double_area != 0))
    for triangle, row in _rows(corners, usable, resolution):
        first, count = _columns(corners[triangle], row, resolution)
        for part in run_chunks(count, CHUNK):
            repeat = np.repeat(np.arange(part.start, part.stop), count[part])
            column = run_numbers(count[part], first[part]).astype(np.int32)
            if centers_only:
                pairs = _centered(uv, resolution, triangle[repeat], row[repeat], column)
            else:
                pairs = _overlaps(uv, resolution, triangle[repeat], row[repeat], column, double_area)
            if len(pairs.texel):
                yield pairs


def _centered(uv: Float32, resolution: int, triangle: Int32, row: Int32, column: Int32) -> _TexelPairs:
    """Return those of the candidate pairs whose center is inside, off the triangle's sides."""
    distance, reach, _ = _edge_distances(uv, resolution, triangle, row, column)
    keep = _all_three(distance > 1e-3 * reach)
    texel = row[keep].astype(np.int64) * resolution + column[keep]
    return _TexelPairs(texel, triangle[keep], np.ones(len(texel)), np.ones(len(texel), dtype=np.bool_))


def _overlaps(
    uv: Float32, resolution: int, triangle: Int32, row: Int32, column: Int32, double_area: Float
) -> _TexelPairs:
    """Return those of the candidate pairs that overlap, with the exact area."""
    distance, reach, of_center = _edge_distances(uv, resolution, triangle, row, column)
    center = _all_three(of_center >= 0)
    touches = _all_three(distance + reach > 0)
    whole = _all_three(distance - reach >= 0)
    area = whole.astype(np.float64)
    cut = np.flatnonzero(touches & ~whole)
    area[cut] = overlap_areas(uv, resolution, triangle[cut], row[cut], column[cut])
    # A triangle smaller than the threshold still keeps the texel with most of its area.
    least = np.minimum(UNRESOLVED * resolution, 0.125 * np.abs(double_area[triangle]))
    keep = touches & (area > 0) & (center | (area >= least))
    texel = row[keep].astype(np.int64) * resolution + column[keep]
    return _TexelPairs(texel, triangle[keep], area[keep], center[keep])


def _rows(corners: Float, usable: NDArray[np.intp], resolution: int) -> Iterator[tuple[Int32, Int32]]:
    """Yield (triangle, row) for every row of the page each usable triangle reaches, in chunks."""
    v = corners[usable, :, 1]
    first = np.clip(np.floor(v.min(axis=1)), 0, resolution).astype(np.int64)
    last = np.clip(np.ceil(v.max(axis=1)), 0, resolution).astype(np.int64)
    count = np.maximum(last - first, 0)
    for part in run_chunks(count, CHUNK):
        repeat = np.repeat(np.arange(part.start, part.stop), count[part])
        row = run_numbers(count[part], first[part])
        yield usable[repeat].astype(np.int32), row.astype(np.int32)


def _columns(corners: Float, row: Int32, resolution: int) -> tuple[Int32, NDArray[np.int64]]:
    """Return the first column and the number of columns each triangle reaches within its row."""
    following = np.roll(corners, -1, axis=1)
    start, rise = corners[..., 1], following[..., 1] - corners[..., 1]
    flat = rise == 0
    slope = np.where(flat, 1.0, rise)
    bottom = row[:, None].astype(np.float64)
    t_0 = np.where(flat, 0.0, np.clip((bottom - start) / slope, 0, 1))
    t_1 = np.where(flat, 1.0, np.clip((bottom + 1 - start) / slope, 0, 1))
    run = following[..., 0] - corners[..., 0]
    # An edge outside the row's strip would be clamped to its nearer end: leave it out.
    low, high = np.minimum(start, following[..., 1]), np.maximum(start, following[..., 1])
    apart = (high < bottom) | (low > bottom + 1)
    x_0, x_1 = corners[..., 0] + t_0 * run, corners[..., 0] + t_1 * run
    left = np.where(apart, np.inf, np.minimum(x_0, x_1))
    right = np.where(apart, -np.inf, np.maximum(x_0, x_1))
    left = np.minimum(np.minimum(left[:, 0], left[:, 1]), left[:, 2])
    right = np.maximum(np.maximum(right[:, 0], right[:, 1]), right[:, 2])
    first = np.clip(np.floor(left), 0, resolution).astype(np.int32)
    last = np.clip(np.ceil(right), 0, resolution).astype(np.int64)
    return first, np.maximum(last - first, 0)


def _edge_distances(
    uv: Float32, resolution: int, triangle: Int32, row: Int32, column: Int32
) -> tuple[Float, Float, Float]:
    """Return (p, 3) edge functions at texels' middles, inside positive, their reach, and those at `CENTER`.

    The reach is how much an edge function changes from the middle to the farthest corner.
    """
    corners = uv[triangle].astype(np.float64) * resolution
    edge = np.roll(corners, -1, axis=1) - corners
    x = column[:, None] + 0.5 - corners[..., 0]
    y = row[:, None] + 0.5 - corners[..., 1]
    side = np.sign(signed_double_areas(corners))[:, None]
    distance = side * (edge[..., 0] * y - edge[..., 1] * x)
    of_center = distance + side * (edge[..., 0] * (CENTER[1] - 0.5) - edge[..., 1] * (CENTER[0] - 0.5))
    return distance, 0.5 * np.abs(edge).sum(axis=2), of_center


def _clip(
    uv: Float32, resolution: int, triangle: Int32, row: Int32, column: Int32, width: Float | float = 1.0
) -> tuple[Float, Float, Bool]:
    """Clip triangles to the middle `width` of texels, (t,) or one for all.

    Returns the (t, 7, 2) footprints and the (t, 3, 2) triangles, both with the texel's lower
    left corner as the origin, and which texels are covered whole.
    """
    corners = _around_texels(uv, resolution, triangle, row, column)
    distance, reach, _ = _edge_distances(uv, resolution, triangle, row, column)
    whole = _all_three(distance - reach >= 0)
    polygon = np.empty((len(corners), 7, 2))
    polygon[whole] = ((0, 0), (1, 0), (1, 1), (0, 1), (0, 1), (0, 1), (0, 1))
    cut = np.flatnonzero(~whole)
    # Clipped at the scale where the middle part is the unit square, and brought back.
    middle = np.broadcast_to(width, len(corners))[cut, None, None]
    polygon[cut] = 0.5 + (clip_to_unit_square(0.5 + (corners[cut] - 0.5) / middle) - 0.5) * middle
    return polygon, corners, whole


def _around_texels(uv: Float32, resolution: int, triangle: Int32, row: Int32, column: Int32) -> Float:
    """Return (p, 3, 2) corners of triangles as seen from texels that are unit squares at the origin."""
    corners = uv[triangle].astype(np.float64) * resolution
    corners -= np.stack((column, row), axis=-1)[:, None, :]
    return corners


def _weights_inside(points: Float, corners: Float) -> Float:
    """Return (t, k, 3) weights of (t, 3, 2) triangles' corners at (t, k, 2) points; none is negative."""
    weights = np.maximum(plane_weights_at(corners, points), 0)
    return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def _all_three(sides: Bool) -> Bool:
    """Return (p,) whether all of (p, 3) are true; several times as fast as `all` along an axis."""
    return np.asarray(sides[:, 0] & sides[:, 1] & sides[:, 2])
