"""Rays aimed at the few elements that are far brighter than the rest.

A small bright patch, such as the wall next to a lamp, is hit by few of a point's cosine-distributed
rays, and each hit makes a speck. So the patch's elements are sampled separately, like lamps: by rays
aimed at them in proportion to what each would send. Cosine rays leave out what is aimed at; which
elements those are depends on the point alone, so that the two together are unbiased.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ...form_factors import ray_geometry_term, throughput
from ...numerics import (
    Array,
    Rows,
    Scratch,
    pick_in_rows,
    pick_in_runs,
    point_on_each_triangle,
    radiance_of_radiosity,
    running_sums,
    split_in_four,
    split_in_sixteen,
    tiles,
)
from ...rays import Hits
from ..hierarchy import Hierarchy

EVEN_SHARE = 0.2
"""This part of the rays at an element spreads over it evenly: lamps do not show other
light, nor shadows."""

CONTRAST = 6.0
"""Elements are bright from this many times the mean reflected radiosity …"""

MAX_BRIGHT_ELEMENTS = 128
"""… and at most this many, the brightest: all are tried at every point."""

MAX_HEMISPHERE_SHARE = 0.05
"""Aimed at are elements that fill less than this of the hemisphere: others many rays hit anyway."""

NOISE = 0.002
"""Nothing is aimed at where chance hits on bright elements would disturb irradiance by less than this."""


TABLE_ROWS = 1 << 14
"""Points whose rays are added to a table at once; bounds the temporaries to a few MB."""


@dataclass(frozen=True)
class AimedRays:
    """Rays from some of the gather points to bright elements.

    row (a,) int: The gather points.
    sources (a, k) int32: What was hit, numbered as the hits of all other rays; NOTHING where something is in
        the way.
    weights (a, k) float32: What each source's radiosity counts for.
    element (a, k) int32: What each was aimed at.
    """

    row: Array
    sources: Array
    weights: Array
    element: Array = field(default_factory=lambda: np.zeros((0, 1), np.int32))

    @staticmethod
    def none() -> AimedRays:
        """Return no rays."""
        return AimedRays(np.zeros(0, np.int64), np.zeros((0, 1), np.int32), np.zeros((0, 1), np.float32))

    @staticmethod
    def joined(parts: list[AimedRays], first: list[int], scratch: Scratch | None = None) -> AimedRays:
        """Put lists of rays together; `first` is added to the rows of each."""
        table = AimedTable(scratch)
        for part, start in zip(parts, first, strict=True):
            table.extend(part, start)
        return table.all()

    def entries(self, chosen: Array) -> AimedRays:
        """Return some of the rays' rows, by a mask (a,)."""
        return AimedRays(self.row[chosen], self.sources[chosen], self.weights[chosen], self.element[chosen])

    def of_points(self, chosen: Array) -> AimedRays:
        """Return those of the gather points that a mask (g,) has chosen, numbered among these."""
        rays = self.entries(chosen[self.row])
        return replace(rays, row=(np.cumsum(chosen) - 1)[rays.row])


class AimedTable:
    """Aimed rays that are put together list by list.

    scratch: Makes the arrays; None keeps them in memory.
    """

    def __init__(self, scratch: Scratch | None = None) -> None:
        self._scratch = scratch or Scratch()
        self._columns: tuple[Rows, ...] = ()

    def extend(self, rays: AimedRays, first: int) -> None:
        """Add rays; `first` is added to their rows."""
        if not len(rays.row):
            return
        if not self._columns:
            width, make = rays.sources.shape[1], self._scratch.rows
            self._columns = (
                make(1, np.int64),
                *(make(width, kind) for kind in (np.int32, np.float32, np.int32)),
            )
        for rows in tiles(len(rays.row), TABLE_ROWS):
            values = rays.row[rows] + first, rays.sources[rows], rays.weights[rows], rays.element[rows]
            for column, added in zip(self._columns, values, strict=True):
                column.extend(added)

    def all(self) -> AimedRays:
        """Return all rays, and give the table up."""
        if not self._columns:
            return AimedRays.none()
        row, sources, weights, element = (column.all() for column in self._columns)
        self._columns = ()
        return AimedRays(row[:, 0], sources, weights, element)


@dataclass(frozen=True)
class Aim:
    """r rows of k rays: where to, at which element, and what each stands for.

    row (r,) int: The points that aim.
    directions (r, k, 3), unit.
    element (r, k) int32.
    weights (r, k).
    """

    row: Array
    directions: Array
    element: Array
    weights: Array


class BrightElements:
    """The leaf elements whose reflected light is far above the mean, the brightest first.

    reflected (e, 3): Every element's reflected radiosity [W/m²].
    lit: Points and normals (p, 3) → (p,): how strongly lamps light them, about. An element may be larger than
        the bright spot on it; rays then aim at the spot. None aims evenly.
    """

    def __init__(
        self, hierarchy: Hierarchy, reflected: Array, lit: Callable[[Array, Array], Array] | None = None
    ) -> None:
        leaves = hierarchy.leaves
        level, area = reflected[leaves].mean(axis=1), hierarchy.area[leaves]
        mean = float(level @ area) / max(float(area.sum()), 1e-300)
        bright = np.flatnonzero(level > CONTRAST * mean)
        bright = bright[np.argsort(-level[bright], kind="stable")[:MAX_BRIGHT_ELEMENTS]]
        self.element = leaves[bright].astype(np.int32)
        """(m,) int32"""
        self._level, self._area = level[bright], area[bright]
        self._corners = hierarchy.corners[self.element]
        self._normals = hierarchy.normal[self.element]
        self._hosts = np.zeros(hierarchy.faces.of_triangle.shape[1], dtype=bool)
        self._hosts[hierarchy.faces.triangle[hierarchy.face[self.element]]] = True
        self._number = np.full(hierarchy.n_elements, -1, dtype=np.int32)
        self._number[self.element] = np.arange(len(bright))
        self._cells = split_in_sixteen(self._corners)
        self._chance = self._chances(lit)

    def __len__(self) -> int:
        return len(self.element)

    def _chances(self, lit: Callable[[Array, Array], Array] | None) -> Array:
        """Return (m, 16) how likely a ray at an element aims at each of its sixteenths."""
        chance = np.full((len(self), 16), 1.0 / 16.0)
        if lit is None or len(self) == 0:
            return chance
        places = split_in_four(self._cells.reshape(-1, 3, 3)).mean(axis=2).reshape(-1, 3)
        level = lit(places, np.repeat(self._normals, 64, axis=0)).reshape(-1, 16, 4).mean(axis=2)
        total = level.sum(axis=1, keepdims=True)
        uneven = np.where(total > 0, level / np.where(total > 0, total, 1.0), chance)
        return np.asarray(EVEN_SHARE * chance + (1.0 - EVEN_SHARE) * uneven)

    def shares(self, points: Array, normals: Array, rays: int, irradiance: Array) -> Array:
        """Return (n, m) what each element would send to points [W/m²], roughly; 0 is left to chance.

        points, normals (n, 3).
        rays: Cosine-distributed ones that a point would have.
        irradiance (n,) [W/m²]: What noise is measured by.
        """
        along = self._corners.mean(axis=1)[None] - points[:, None]
        square = np.einsum("nmk,nmk->nm", along, along)
        cos_r = np.einsum("nmk,nk->nm", along, normals)
        cos_s = np.einsum("mk,nk->nm", self._normals, points) - np.einsum(
            "mk,mk->m", self._normals, self._corners[:, 0]
        )
        # Seen whole: no corner below the horizon.
        lowest = (normals @ self._corners.reshape(-1, 3).T).reshape(len(points), -1, 3).min(axis=2)
        lowest -= np.einsum("nk,nk->n", points, normals)[:, None]
        far = (lowest > 0) & (cos_s > 0) & (self._area < MAX_HEMISPHERE_SHARE * np.pi * square)
        factor = np.where(far, self._area * cos_r * cos_s / np.maximum(np.pi * square * square, 1e-300), 0.0)
        noise = factor @ (self._level**2) / rays
        factor[noise <= (NOISE * irradiance) ** 2] = 0.0
        return np.asarray(factor * self._level)

    def left_out(self, shares: Array, hits: Hits, leaves_of: Callable[[Hits], Array]) -> Array:
        """Return (n · k,) bool: which hits are on what is aimed at from their point.

        shares (n, m).
        hits: k of each point, one point after the other.
        leaves_of: Returns the leaf elements that were hit.
        """
        out = np.zeros(len(hits.triangle), dtype=bool)
        aims = np.repeat(shares.any(axis=1), len(out) // len(shares))
        ray = np.flatnonzero(aims & (hits.triangle >= 0) & self._hosts[hits.triangle])
        leaf = leaves_of(hits.take(ray))
        number = np.where(leaf >= 0, self._number[leaf], -1)
        ray, number = ray[number >= 0], number[number >= 0]
        out[ray] = shares[ray // (len(out) // len(shares)), number] > 0
        return out

    def aim(self, points: Array, normals: Array, shares: Array, u: Array) -> Aim:
        """Aim rays from points (r, k, 3), of which row i shares `shares[i]` among the elements.

        points (n, k, 3): Where the rays start.
        normals (n, 3).
        shares (n, m): Rows without any are left out.
        u (n, k, 2).
        """
        row = np.flatnonzero(shares.any(axis=1))
        shares = shares[row]
        pick, within = pick_in_rows(shares, u[row, :, 0])
        share = np.take_along_axis(shares, pick, axis=1)
        part = np.maximum(share / shares.sum(axis=1, keepdims=True), 1e-300)
        # The same once more, for the sixteenths of the element.
        cell, within = pick_in_runs(running_sums(self._chance.ravel()), within, 16 * pick, 16 * pick + 16)
        inside = np.stack([within, u[row, :, 1]], axis=-1)
        targets = point_on_each_triangle(self._cells.reshape(-1, 3, 3)[cell], inside)
        along = targets - points[row]
        distance = np.linalg.norm(along, axis=2)
        directions = along / np.maximum(distance, 1e-300)[..., None]
        cos_r = np.einsum("nkc,nc->nk", directions, normals[row])
        cos_s = -np.einsum("nkc,nkc->nk", directions, self._normals[pick])
        area = self._area[pick] / (16.0 * self._chance.ravel()[cell])
        thrown = throughput(ray_geometry_term(cos_r, cos_s, distance), 1.0, area)
        weights = radiance_of_radiosity(thrown) / (part * u.shape[1])
        return Aim(row, directions, self.element[pick], np.where(share > 0, weights, 0.0))
