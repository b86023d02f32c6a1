"""Seams, where a surface continues in another chart: pairs of places on pages, one place in the world.

A seam is an edge of two triangles whose lightmap coordinates differ on its two sides. Only those
count over which light goes on unbroken: the shading normal is the same on both sides, the surface
does not fold, and no third surface stands on the edge. Across a crease a step is right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...numerics import Array, run_numbers, run_starts, texels_around, tiles, weld
from ...rays import SAGITTA, SIGHT_LIFT, RayCaster
from ...scene import Scene
from ..texels import NO_TEXEL, TexelGeometry

WELD = 1e-6
"""Corners are merged if their distance is at most this part of the scene's extent."""

SAME_NORMAL = 0.99
"""Least cosine between the shading normals of the two sides, …"""

NO_FOLD = 0.5
"""… and between the triangles' own."""

SAMPLES_PER_TEXEL = 2.0
"""Samples along a seam, per texel of the finer side."""

SAME_UV = 1e-3
"""Sides that lie closer than this on the page [texels] are one."""

ROUNDED = 2.0**-23
"""Places closer to a texel's center than this part of the page's width are there: coordinates are
single-precision numbers."""

MAX_SEAM_DISTANCE = 3.0
"""Texels this far [texels] from a place on a seam do not belong to it."""

CHUNK = 1 << 16
"""Places tested at once; bounds the temporaries to about 40 MB."""


@dataclass(frozen=True)
class Seams:
    """s places on seams, and the texels a bilinear look-up of either side reads there.

    texel (s, 2, 4) int64: One side's four texels, then the other's, numbered row by row and page after page.
    weight (s, 2, 4): Of the texels; either side's sum to 1.
    length (s,): Of the seam that the place stands for, in texels, at most 1.
    triangle (s, 2) int64: The scene's triangles on either side.
    """

    texel: Array
    weight: Array
    length: Array
    triangle: Array

    def __len__(self) -> int:
        return len(self.length)

    def take(self, rows: Array) -> Seams:
        """Return some of the places: a mask or row numbers."""
        return Seams(self.texel[rows], self.weight[rows], self.length[rows], self.triangle[rows])

    def of_one_material(self, scene: Scene) -> Seams:
        """Return the places whose two sides have equal reflectance and emission and no textures."""
        alike = np.ones(len(self), dtype=bool)
        for values in (scene.reflectance, scene.emission):
            alike &= (values[self.triangle[:, 0]] == values[self.triangle[:, 1]]).all(axis=1)
        if scene.images is not None:
            alike &= ~scene.images.textured[self.triangle].any(axis=1)
        return self.take(alike)

    def sides(self, values: Array) -> Array:
        """Return (s, 2, k) what bilinear look-ups give on either side; `values` (n, k) of all texels."""
        return np.asarray(np.einsum("sab,sabk->sak", self.weight, values[self.texel]))


def find_seams(scene: Scene, geometry: TexelGeometry, caster: RayCaster | None = None) -> Seams:
    """Find the seams of all charts on all pages.

    caster: Detects geometry that stands on seams; None assumes there is none.
    """
    triangle, corner = _shared_edges(scene, geometry)
    apart = np.zeros(len(triangle), dtype=bool)
    for rows in tiles(len(triangle)):
        ends, pages = _on_pages(geometry, triangle[rows], corner[rows])
        extent = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2).max(axis=1)
        moved = (np.abs(ends[:, 0] - ends[:, 1]) > SAME_UV).any(axis=(1, 2))
        apart[rows] = (moved | (pages[:, 0] != pages[:, 1])) & (extent > 0)
    edges = np.flatnonzero(apart)
    edges = edges[_smooth(scene, triangle[edges], corner[edges])]
    triangle, corner = triangle[edges].astype(np.int64), corner[edges].astype(np.int64)
    ends, pages = _on_pages(geometry, triangle, corner)
    extent = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    count = np.maximum(np.ceil(SAMPLES_PER_TEXEL * extent.max(axis=1)), 1).astype(np.int64)
    edge, total = np.repeat(np.arange(len(triangle)), count), np.repeat(count, count)
    along = (run_numbers(count) + 0.5) / total
    share = along[:, None, None]
    spots = (1 - share) * ends[edge, :, 0] + share * ends[edge, :, 1]
    texel, weight, inside = _bilinear(spots, pages[edge], [len(numbers) for numbers in geometry.index])
    seams = Seams(texel, weight, extent[edge].max(axis=1) / total, triangle[edge]).take(inside)
    edge, along = edge[inside], along[inside, None]
    start, end = (scene.triangles[triangle[edge, 0], corner[edge, 0, k]] for k in (0, 1))
    size = np.linalg.norm(end - start, axis=1) / np.maximum(extent[edge].min(axis=1), 1e-9)
    size = np.clip(size, geometry.texel_size, 100 * geometry.texel_size)
    return seams.take(_clean(geometry, seams, start + along * (end - start), size, caster))


def _on_pages(geometry: TexelGeometry, triangle: Array, corner: Array) -> tuple[Array, Array]:
    """Return (p, side, end, 2) where edges' ends lie on their sides' pages [texels], and (p, 2) the pages."""
    pages = geometry.page_of_triangle[triangle]
    sizes = np.array([len(numbers) for numbers in geometry.index])
    ends = geometry.uv[triangle[:, :, None], corner].astype(np.float64) * sizes[pages][:, :, None, None]
    return ends, pages


def _clean(geometry: TexelGeometry, seams: Seams, at: Array, size: Array, caster: RayCaster | None) -> Array:
    """Return (s,) which places read their own surface's texels only, with nothing between the sides."""
    index = geometry.index[0].ravel() if len(geometry.index) == 1 else _in_one(geometry)
    good = np.zeros(len(seams), dtype=bool)
    for first in range(0, len(seams), CHUNK):
        rows = np.arange(first, min(first + CHUNK, len(seams)))
        numbers, weight = index[seams.texel[rows]], seams.weight[rows]
        own = _own_texels_only(geometry, numbers, weight, at[rows], size[rows])
        rows, numbers, weight = rows[own], numbers[own], weight[own]
        good[rows] = True if caster is None else _open(geometry, caster, numbers, weight)
    return good


def _in_one(geometry: TexelGeometry) -> Array:
    """Return all pages' numbers of texels, one page after the other."""
    return np.concatenate([numbers.ravel() for numbers in geometry.index])


def _shared_edges(scene: Scene, geometry: TexelGeometry) -> tuple[Array, Array]:
    """Return the edges of exactly two triangles on pages whose fronts face the same way.

    Returns triangle (p, 2) int32.
    Returns corner (p, 2, 2) int8: Which of the triangle's corners are the edge's ends, in the same order on
        both sides.
    """
    every = np.flatnonzero(scene.areas > 0).astype(np.int32)
    vertex = weld(scene.triangles[every].reshape(-1, 3), WELD).astype(np.int32).reshape(-1, 3)
    corners = np.array([[0, 1], [1, 2], [2, 0]], dtype=np.int8)
    ends = vertex[:, corners].reshape(-1, 2)
    flip = ends[:, 0] > ends[:, 1]
    key = ends.min(axis=1).astype(np.int64) * (int(vertex.max(initial=0)) + 1) + ends.max(axis=1)
    del ends, vertex
    order = np.argsort(key, kind="stable")
    key = key[order]
    new = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]])) if len(key) else np.zeros(0, np.int64)
    pairs = new[np.diff(np.append(new, len(key))) == 2]
    del key, new
    sides = np.stack([order[pairs], order[pairs + 1]], axis=1)
    del order
    triangle = every[sides // 3]
    # From the other side, the edge runs in the other direction.
    kept = (geometry.page_of_triangle[triangle] >= 0).all(axis=1) & (flip[sides[:, 0]] != flip[sides[:, 1]])
    triangle, sides = triangle[kept], sides[kept]
    corner = corners[sides % 3]
    return triangle, np.where(flip[sides][..., None], corner[..., ::-1], corner)


def _smooth(scene: Scene, triangle: Array, corner: Array) -> Array:
    """Return (p,) whether the two triangles of edges continue each other."""
    normal = scene.face_normals[triangle]
    smooth = np.einsum("pk,pk->p", normal[:, 0], normal[:, 1]) > NO_FOLD
    shading = scene.normals[triangle[:, :, None], corner]
    shading = shading / np.maximum(np.linalg.norm(shading, axis=3, keepdims=True), 1e-12)
    smooth &= (np.einsum("pek,pek->pe", shading[:, 0], shading[:, 1]) > SAME_NORMAL).all(axis=1)
    return np.asarray(smooth)


def _bilinear(spots: Array, pages: Array, sizes: Sequence[int]) -> tuple[Array, Array, Array]:
    """Return what is read at places on the page, and which of the places are on it.

    spots (s, 2, 2): In texels.
    Returns (s, 2, 4) texels and weights; a texel without weight is replaced by the one with the most.
    """
    size = np.asarray(sizes, dtype=np.int64)
    first, width = run_starts(size * size)[pages], size[pages]
    inside = ((spots >= 0) & (spots <= width[..., None])).all(axis=(1, 2))
    texels, share = texels_around(spots, width, width)
    near = np.abs(share - np.rint(share)) <= ROUNDED * width[..., None]
    share = np.where(near, np.rint(share), share)
    (left, below), (right, above) = np.moveaxis(1 - share, -1, 0), np.moveaxis(share, -1, 0)
    weights = np.stack([left * below, right * below, left * above, right * above], axis=2)
    most = np.take_along_axis(texels, weights.argmax(axis=2)[..., None], axis=2)
    return first[..., None] + np.where(weights > 0, texels, most), weights, inside


def _own_texels_only(geometry: TexelGeometry, numbers: Array, weight: Array, at: Array, size: Array) -> Array:
    """Return (s,) which places read no other surface's texels, but their own on both sides.

    numbers (s, 2, 4) int: The covered texels among those read, or NO_TEXEL.
    at, size (s, 3), (s,): Where the places are, and the width of a texel there [m].
    """
    covered = (numbers != NO_TEXEL) & (weight > 0)
    distance = np.linalg.norm(geometry.position[numbers] - at[:, None, None], axis=3)
    own = ~covered | (distance < MAX_SEAM_DISTANCE * size[:, None, None])
    return np.asarray(own.all(axis=(1, 2)) & covered.any(axis=2).all(axis=1))


def _open(geometry: TexelGeometry, caster: RayCaster, numbers: Array, weight: Array) -> Array:
    """Return (s,) the places with nothing between their sides: the main texels see each other."""
    best = np.where((numbers != NO_TEXEL) & (weight > 0), weight, -1.0).argmax(axis=2)
    ends = np.take_along_axis(numbers, best[:, :, None], axis=2)[..., 0]
    at, normal, facet = geometry.position[ends], geometry.normal[ends], geometry.surface_normal[ends]
    length = np.linalg.norm(at[:, 1] - at[:, 0], axis=1)
    turn = np.minimum(*(np.einsum("sk,sk->s", normals[:, 0], normals[:, 1]) for normals in (normal, facet)))
    lift = SIGHT_LIFT * caster.surface_offset + SAGITTA * length * np.sqrt(np.maximum(1.0 - turn, 0.0))
    at = at + lift[:, None, None] * normal
    along = at[:, 1] - at[:, 0]
    length = np.linalg.norm(along, axis=1)
    return np.asarray(caster.unoccluded(at[:, 0], along / np.maximum(length, 1e-300)[:, None], length))
