"""Positions of all lightmap texels of all pages in the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...numerics import Array, Scratch, TakenRows, orthonormal_basis, tiles
from ...rays import Hits, surface_offset
from ...scene import Scene
from .rasterization import FOOTPRINT, Texels, sample_footprints
from .shared_texels import SharedTexels, find_shared, texel_areas

NO_TEXEL = -1

EDGE_OFFSETS = 4.0
"""Points keep this many ray offsets from the edges of their triangles."""

SINK = 2.0
"""Points that touch another surface lie this many ray offsets behind their own."""

CHUNK = 1 << 16
"""Texels placed at once; bounds the temporaries to about 40 MB."""

_SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


class TexelGeometry:
    """The n covered texels of all pages, numbered page by page.

    uv (t, 3, 2) float32: Lightmap coordinates of every scene triangle; rows without a lightmap are ignored.
    page_of_triangle (t,) int32: −1 where a triangle has no lightmap.
    texels: One per page.
    rows sequence of (p,) int: Per page, the scene triangle of each of the page's triangles.
    scratch: Makes the texels' arrays, and those of what else there is of each; None keeps them in memory.
    uv, page_of_triangle, triangles, face_normals, normals: Of every scene triangle, as given.
    page (n,) int16, or int32 where there are more pages.
    page_start (pages + 1,) int64: The first texel of each page, and n.
    row, column, triangle (n,) int32.
    share (n,) float32: What part of the texel its triangle covers.
    center_inside (n,) bool: Whether the texel's center is on its triangle.
    whole (n,) bool: Whether all of the texel is.
    barycentric (n, 2) float32: Weights of the triangle's second and third corner at the center of the
        footprint.
    position, normal, surface_normal (n, 3): Center of the footprint; interpolated shading normal; the
        triangle's own normal.
    """

    STORED = ("page", "page_start", "triangle", "center_inside", "index", "uv", "page_of_triangle")

    scratch = Scratch()
    shared: SharedTexels | None = None
    """the texels that several triangles share; None if there are none, or the bake comes from a file"""

    def __init__(
        self,
        scene: Scene,
        uv: Array,
        page_of_triangle: Array,
        texels: Sequence[Texels],
        rows: Sequence[Array],
        scratch: Scratch | None = None,
    ) -> None:
        self.scratch = scratch = scratch or Scratch()
        self._scene = scene
        self.uv, self.page_of_triangle = uv, page_of_triangle
        self.triangles, self.face_normals, self.normals = scene.triangles, scene.face_normals, scene.normals
        self.page_start = np.cumsum([0] + [len(page) for page in texels])
        count = int(self.page_start[-1])
        self.index = []
        """per page (height, width) int32: the texel's number, or NO_TEXEL"""
        for number, page in enumerate(texels):
            numbers = np.full((page.resolution,) * 2, NO_TEXEL, dtype=np.int32)
            for tile in tiles(len(page)):
                own = np.arange(tile.start, tile.stop)
                numbers[page.row[tile], page.column[tile]] = self.page_start[number] + own
            self.index.append(numbers)
        self.texels = self._joined(texels)
        self.page = scratch.empty(count, np.int16 if len(texels) <= np.iinfo(np.int16).max else np.int32)
        self.triangle, self.whole = scratch.empty(count, np.int32), scratch.empty(count, np.bool_)
        self._inset, self._depth = _edge_inset(scene), SINK * surface_offset(scene.triangles)
        self.barycentric = scratch.empty((count, 2), np.float32)
        self.position, self.normal = scratch.empty((count, 3)), scratch.empty((count, 3))
        for number, (of, page) in enumerate(zip(rows, self.texels, strict=True)):
            for tile in tiles(len(page), CHUNK):
                texels_of_tile = slice(
                    self.page_start[number] + tile.start, self.page_start[number] + tile.stop
                )
                triangle = of[page.triangle[tile]]
                self.page[texels_of_tile], self.triangle[texels_of_tile] = number, triangle
                self.whole[texels_of_tile] = page.area[tile] >= 1.0
                centroid = page.centroid[tile].astype(np.float64)
                self._put(texels_of_tile, self._drawn_in(centroid[:, None], triangle)[:, 0])
        self.surface_normal = TakenRows(scene.face_normals, self.triangle)
        self.shared = find_shared(scene, uv, page_of_triangle, self.index, self.triangle)
        if self.shared is not None:
            many = np.flatnonzero(self.shared.number >= 0)
            self.whole[many] = False
            self.normal[many] = self.shared.shading
            own = scratch.empty(count, np.int32)
            own[:] = self.triangle
            own[many] = len(scene.face_normals) + np.arange(len(many))
            facing = np.concatenate([scene.face_normals, self.shared.facing])
            self.surface_normal = TakenRows(facing, own)

    def _joined(self, texels: Sequence[Texels]) -> list[Texels]:
        """Put the pages' texels one after the other; return them as views of the whole."""
        names = ("row", "column", "center_inside", "area")
        if len(texels) == 1:
            (only,) = texels
            self.row, self.column, self.center_inside, self.share = (getattr(only, name) for name in names)
            return [only]
        whole = {}
        for name in names:
            parts = [getattr(page, name) for page in texels]
            whole[name] = self.scratch.empty(int(self.page_start[-1]), parts[0].dtype if parts else np.int32)
            for first, part in zip(self.page_start, parts, strict=False):
                for tile in tiles(len(part)):
                    whole[name][first + tile.start : first + tile.stop] = part[tile]
        self.row, self.column, self.center_inside, self.share = (whole[name] for name in names)
        rows = [slice(first, first + len(page)) for first, page in zip(self.page_start, texels, strict=False)]
        return [
            replace(
                page,
                row=self.row[of_page],
                column=self.column[of_page],
                center_inside=self.center_inside[of_page],
                area=self.share[of_page],
            )
            for of_page, page in zip(rows, texels, strict=True)
        ]

    def _put(self, rows: slice, weights: Array) -> None:
        """Move texels to barycentric weights (r, 3) of their triangles."""
        triangle = self.triangle[rows]
        upright = self.face_normals[triangle]
        self.barycentric[rows] = weights[:, 1:]
        self.position[rows] = self._sunk(triangle[:, None], _at(self.triangles[triangle], weights[:, None]))[
            :, 0
        ]
        shading = np.einsum("nc,nck->nk", weights, self.normals[triangle])
        length = np.linalg.norm(shading, axis=1, keepdims=True)
        # A shading normal that vanished or points behind the surface is not usable.
        sane = (length[:, 0] > 1e-6) & (np.einsum("nk,nk->n", shading, upright) > 0)
        self.normal[rows] = np.where(sane[:, None], shading / np.maximum(length, 1e-6), upright)

    def __len__(self) -> int:
        return len(self.page)

    @cached_property
    def texel_size(self) -> float:
        """Width of a texel in the world [m], the median."""
        if not len(self):
            return 1.0
        # The median of every texel's area, by how many there are of each triangle.
        order = np.argsort(self.texel_area, kind="stable")
        ends = np.cumsum(self.counts[order])
        middle = np.searchsorted(ends, [(len(self) - 1) // 2, len(self) // 2], side="right")
        return float(np.sqrt(self.texel_area[order[middle]].mean()))

    @cached_property
    def scale(self) -> Array:
        """(t,) int64: the power of two nearest to the width of each triangle's texels by the median one."""
        width = np.sqrt(self.texel_area) / self.texel_size
        known = np.isfinite(width) & (width > 0)
        return np.round(np.log2(width, out=np.zeros(len(width)), where=known)).astype(np.int64)

    @cached_property
    def counts(self) -> Array:
        """(t,) int64: how many texels each triangle has."""
        found = np.zeros(len(self.page_of_triangle), dtype=np.int64)
        for tile in tiles(len(self)):
            triangles, count = np.unique(self.triangle[tile], return_counts=True)
            found[triangles] += count
        return found

    @cached_property
    def texel_area(self) -> Array:
        """(t,) float64: what a texel is of every triangle [m²]; endless where it has none of a page."""
        result = np.full(len(self.triangles), np.inf)
        for page, numbers in enumerate(self.index):
            rows = np.flatnonzero(self.page_of_triangle == page)
            result[rows] = texel_areas(self.uv[rows], self._scene.areas[rows], len(numbers))
        return result

    @property
    def reach(self) -> Array:
        """(n,) float64: no point of a texel is farther from another one of it [m]."""
        across, up = self._texel_edges(slice(None))
        reach = np.asarray((np.linalg.norm(across, axis=1) + np.linalg.norm(up, axis=1))[self.triangle])
        if self.shared is not None:
            rows, shared = np.flatnonzero(self.shared.number >= 0), self.shared
            apart = self.triangles[shared.triangle] - self.position[rows][shared.of, None]
            farthest = np.zeros(len(rows))
            np.maximum.at(farthest, shared.of, np.linalg.norm(apart, axis=2).max(axis=1))
            reach[rows] = 2.0 * farthest
        return reach

    def holds(self, texel: Array, points: Array) -> Array:
        """Return (h,) whether points (h, 3) are as near to texels, which are not shared, as theirs are."""
        across, up = self._texel_edges(self.triangle[texel])
        reach = np.linalg.norm(across, axis=1) + np.linalg.norm(up, axis=1)
        return np.asarray(np.linalg.norm(points - self.position[texel], axis=1) <= reach)

    def on(self, scene: Scene) -> TexelGeometry:
        """Return the same texels over a scene whose triangles have moved."""
        rows = [np.flatnonzero(self.page_of_triangle == page) for page in range(len(self.texels))]
        return TexelGeometry(scene, self.uv, self.page_of_triangle, self.texels, rows, self.scratch)

    def sample(self, rows: Array, u: Array, width: float = FOOTPRINT) -> Array:
        """Return (r, k, 3) points spread over the middle `width` of r texels by u (r, k, 2)."""
        points = np.empty((len(rows), u.shape[1], 3))
        # Texels that lie entirely on their triangle need no clipping.
        inner = self.whole[rows] & ((width < 1.0) | ((u > 0.0) & (u < 1.0)).all(axis=(1, 2)))
        shared = self._shared_numbers(rows)
        plain, cut = np.flatnonzero(inner), np.flatnonzero(~inner & (shared < 0))
        points[plain] = self.in_plane(rows[plain], 0.5 + (u[plain].astype(np.float64) - 0.5) * width)
        corners = self._scene.triangles[self.triangle[rows[cut]]]
        points[cut] = _at(corners, self.sample_weights(rows[cut], u[cut], width))
        triangle = self.triangle[rows][:, None]
        many = np.flatnonzero(shared >= 0)
        if self.shared is not None and len(many):
            own, weights = self.shared.sample(shared[many], u[many])
            weights = self._drawn_in(weights.reshape(-1, 1, 3), own.ravel())
            points[many] = _at(self._scene.triangles[own.ravel()], weights).reshape(*own.shape, 3)
            triangle = np.repeat(triangle, points.shape[1], axis=1)
            triangle[many] = own
        return self._sunk(triangle, points)

    def _shared_numbers(self, rows: Array) -> Array:
        """Return (r,) which shared texels some texels are, or NO_TEXEL."""
        if self.shared is None:
            return np.full(len(rows), NO_TEXEL, dtype=np.int32)
        return np.asarray(self.shared.number[rows])

    def is_shared(self, rows: Array) -> Array:
        """Return (r,) which texels several triangles share."""
        return np.asarray(self._shared_numbers(rows) >= 0)

    def _sunk(self, triangle: Array, points: Array) -> Array:
        """Move points (r, k, 3) that lie against another surface behind their own, which stops their rays.

        Rays that start above would pass the surface that the texel lies on.

        triangle (r, k or 1) int: That the points are on.
        """
        layers = self._scene.layers
        pressed = np.flatnonzero(layers.pressed_triangles[triangle].any(axis=1))
        if len(pressed) == 0:
            return points
        triangle = np.broadcast_to(triangle[pressed], (len(pressed), points.shape[1])).ravel()
        chosen = points[pressed].reshape(-1, 3)
        sunk = layers.is_pressed(triangle, layers.weights(2 * triangle.astype(np.int64), chosen))
        chosen[sunk] -= self._depth * self.face_normals[triangle[sunk]]
        points[pressed] = chosen.reshape(-1, *points.shape[1:])
        return points

    def squares(self, rows: Array) -> Array:
        """Return (r, 4, 3) the corners of whole texels, in their triangles' planes but not cut by them."""
        squares = self.in_plane(rows, np.broadcast_to(_SQUARE, (len(rows), 4, 2)))
        shared = self._shared_numbers(rows)
        many = np.flatnonzero(shared >= 0)
        if self.shared is not None and len(many):
            # As large as what shares the texel.
            across, up = orthonormal_basis(self.surface_normal[rows[many]])
            half = 0.5 * np.sqrt(self.shared.area[shared[many]])[:, None]
            for corner, (x, y) in enumerate(_SQUARE - 0.5):
                squares[many, corner] = self.position[rows[many]] + 2.0 * half * (x * across + y * up)
        return squares

    def in_plane(self, rows: Array, spots: Array) -> Array:
        """Return (r, k, 3) points in the triangles' planes at places (r, k, 2) of texels as unit squares."""
        triangle = self.triangle[rows]
        start = np.stack([self.column[rows], self.row[rows]], axis=1) - self._places[triangle, :2]
        across, up = self._texel_edges(triangle)
        points = spots[..., :1] * across[:, None]
        points += spots[..., 1:] * up[:, None]
        first = self._scene.triangles[triangle, 0]
        points += (first + start[:, :1] * across + start[:, 1:] * up)[:, None]
        return np.asarray(points)

    def _texel_edges(self, triangle: Array | slice) -> tuple[Array, Array]:
        """Return (r, 3) twice: the way to a triangle's next texel of the row, of the column; 0 without area.

        Not stored: of a million triangles they take 46 MB.
        """
        edges = self._scene.triangles[triangle, 1:] - self._scene.triangles[triangle, :1]
        place = self._places[triangle].astype(np.float64)
        first, second = place[:, 2:4], place[:, 4:6]
        whole = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        part = np.where(whole == 0.0, 0.0, 1.0 / np.where(whole == 0.0, 1.0, whole))[:, None]
        across = (second[:, 1:] * edges[:, 0] - first[:, 1:] * edges[:, 1]) * part
        up = (first[:, :1] * edges[:, 1] - second[:, :1] * edges[:, 0]) * part
        return across, up

    def sample_weights(self, rows: Array, u: Array, width: float = FOOTPRINT) -> Array:
        """Return (r, k, 3) the barycentric weights of the same points in the texels' triangles."""
        weights = np.empty((len(rows), u.shape[1], 3))
        shared = self._shared_numbers(rows)
        for number, page in enumerate(self.texels):
            on_page = np.flatnonzero((self.page[rows] == number) & (shared < 0))
            if len(on_page) == 0:
                continue
            local = rows[on_page] - self.page_start[number]
            inside = sample_footprints(page.take(local), u[on_page], width)
            weights[on_page] = self._drawn_in(inside, self.triangle[rows[on_page]])
        many = np.flatnonzero(shared >= 0)
        if self.shared is not None and len(many):
            main = self.shared.sample_main(shared[many], u[many])
            weights[many] = self._drawn_in(main, self.triangle[rows[many]])
        return weights

    def _drawn_in(self, weights: Array, triangle: Array) -> Array:
        """Move (n, k, 3) barycentric points that lie on an edge of their triangle slightly off it."""
        inside = np.maximum(weights, self._inset[triangle][:, None])
        moved = (inside != weights).any(axis=2, keepdims=True)
        return np.asarray(np.where(moved, inside / inside.sum(axis=2, keepdims=True), weights))

    def neighborhood(self, chosen: Array) -> Array:
        """Grow a (n,) mask of texels by one texel in all eight directions of their page."""
        grown = np.empty(len(self), dtype=bool)
        for page, (numbers, inside) in enumerate(zip(self.index, self._framed, strict=True)):
            on_page = slice(self.page_start[page], self.page_start[page + 1])
            image = np.zeros((len(numbers) + 2, numbers.shape[1] + 2), dtype=bool)
            flat, own, result = image.ravel(), chosen[on_page], grown[on_page]
            for tile in tiles(len(inside)):
                flat[inside[tile]] = own[tile]
            image[1:-1] = image[1:-1] | image[:-2] | image[2:]
            image[:, 1:-1] = image[:, 1:-1] | image[:, :-2] | image[:, 2:]
            for tile in tiles(len(inside)):
                result[tile] = flat.take(inside[tile])
        return grown

    @cached_property
    def _framed(self) -> list[Array]:
        """Per page, the positions of its texels in a page with a border of one texel, row by row."""
        framed = [self.scratch.empty(len(page), np.int32) for page in self.texels]
        for page, places in zip(self.texels, framed, strict=True):
            for tile in tiles(len(page)):
                places[tile] = (page.row[tile] + 1) * (page.resolution + 2) + page.column[tile] + 1
        return framed

    def positions_of(self, hits: Hits) -> Array:
        """Return (h, 3) where rays hit; meaningless without a hit."""
        weights = np.concatenate([np.zeros((len(hits.triangle), 1)), hits.barycentric], axis=1)
        return _at(self._scene.triangles[hits.triangle], weights[:, None])[:, 0]

    def texel_at(self, hits: Hits) -> Array:
        """Return (h,) int32: the texel under each ray's hit; NO_TEXEL on backs and unbaked surfaces."""
        found = np.full(len(hits.triangle), NO_TEXEL, dtype=np.int32)
        baked = (hits.triangle >= 0) & hits.front
        baked &= self.page_of_triangle[hits.triangle] >= 0
        rows = np.flatnonzero(baked)
        triangle = hits.triangle[rows]
        place = self._places.take(triangle, axis=0)
        second, third = hits.barycentric[rows, 0], hits.barycentric[rows, 1]
        column = place[:, 0] + second * place[:, 2] + third * place[:, 4]
        row = place[:, 1] + second * place[:, 3] + third * place[:, 5]
        page = self.page_of_triangle[triangle] if len(self.index) > 1 else None
        for number, numbers in enumerate(self.index):
            on_page = slice(None) if page is None else np.flatnonzero(page == number)
            last = np.float32(len(numbers) - 1)
            at = np.clip(row[on_page], 0, last).astype(np.int64) * len(numbers)
            at += np.clip(column[on_page], 0, last).astype(np.int64)
            found[rows[on_page]] = numbers.ravel()[at]
        return found

    @cached_property
    def _places(self) -> Array:
        """(t, 6) float32: each triangle's first corner on its page and its edges from there, in texels."""
        sizes = np.array([len(numbers) for numbers in self.index], dtype=np.float64)
        corners = self.uv * sizes[np.maximum(self.page_of_triangle, 0)][:, None, None]
        edges = corners[:, 1:] - corners[:, :1]
        places = np.concatenate([corners[:, 0], edges[:, 0], edges[:, 1]], axis=1)
        return np.asarray(places, dtype=np.float32)


def _edge_inset(scene: Scene) -> Array:
    """Return (t, 3) float64: the least barycentric weights of a point a few ray offsets inside.

    A point on the very edge of a wall, lifted off it, would start in or behind the next wall
    and see out of a closed room.
    """
    edges = np.roll(scene.triangles, -1, axis=1) - np.roll(scene.triangles, 1, axis=1)
    heights = 2.0 * scene.areas[:, None] / np.maximum(np.linalg.norm(edges, axis=2), 1e-300)
    inset = EDGE_OFFSETS * surface_offset(scene.triangles) / np.maximum(heights, 1e-300)
    return np.asarray(np.minimum(inset, 0.25))


def _at(corners: Array, weights: Array) -> Array:
    """Return (n, k, 3) points at (n, k, 3) barycentric weights of (n, 3, 3) triangles.

    Along the edges from the first corner, whose own weight is not used: float32 weights that
    do not quite sum to 1 cannot lift a point off a plane far from the origin.
    """
    edges = corners[:, 1:] - corners[:, :1]
    return np.asarray(corners[:, :1] + weights[:, :, 1:].astype(np.float64) @ edges)
