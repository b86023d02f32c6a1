"""Rays from points over their hemispheres, whose hits are kept: links at the finest level.

Cosine-distributed, each stands for the same form factor; besides, rays aimed at the few
elements that are far brighter than the rest (`bright_patches.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...lights import SkyTable
from ...numerics import (
    Array,
    Stream,
    TakenRows,
    cosine_hemisphere,
    map_chunks,
    orthonormal_basis,
    stratified_square,
)
from ...rays import Hits, RayCaster
from .bright_patches import AimedRays, AimedTable, BrightElements
from .footprints import Footprints
from .hit_numbers import NOTHING, Resolver, sky_numbers

CHUNK_RAYS = 1 << 16
"""Rays a thread prepares at once; bounds its temporaries to about 10 MB."""

AIMED_PART = 4
"""One ray is aimed for this many cosine-distributed ones, where any are aimed."""

PRESSED = 1.5
"""A back so few surface offsets above the start of a ray is that of the surface it starts on, which lies
against another one: points on it are sunk behind it (`lightmap/texels/texel_geometry.py`), because nothing
reaches them, however bright the back is where it is open."""

MOST_TINT = float(np.finfo(np.float16).max)
"""Largest tint that can be kept. Tints are relative to the chance that rays pass: at each surface that is
paint and glass at once a channel may have three times as much."""

SAME_PLACE = 1e-5
"""Barycentric weights that differ by less are one place on a triangle."""


@dataclass(frozen=True)
class GatheredHits:
    """What the rays of n points met.

    Attributes
    ----------
    sources : (n, rays) int32
        What the resolver said; a cell of the sky where nothing was hit, NOTHING below the surface and where
        aimed rays ask instead.
    closeness : (n,) float64
        Mean of 1/distance over the rays [1/m]: how quickly irradiance may change.
    aimed : AimedRays
    tints : (n, rays, 3) float16 or None
        What the light of each ray is multiplied with on its way through glass; None where there is none.
    """

    sources: Array
    closeness: Array
    aimed: AimedRays
    tints: Array | None = None

    def mean_of(self, table: Array) -> Array:
        """Return (n, 3) means over the cosine-distributed rays of a table's rows (rows, 3)."""
        seen = table[self.sources]
        return np.asarray((seen if self.tints is None else seen * self.tints).mean(axis=1))


class FinalGather:
    """Traces the rays of some points.

    Parameters
    ----------
    caster : RayCaster
    at : Footprints
        `near` is not used.
    surface_normals : (n, 3) float64
        Rays that dip below carry nothing, where `at.normals` shade.
    rays : int
        Cosine-distributed ones a point; each stands for a form factor of 1 / rays.
    resolve, leaves_of : callable
        Number the hits, and return the leaf elements that were hit.
    seed, threads : int
    sky : SkyTable
    """

    def __init__(
        self,
        caster: RayCaster,
        at: Footprints,
        surface_normals: Array | TakenRows,
        rays: int,
        resolve: Resolver,
        leaves_of: Resolver,
        seed: int,
        threads: int,
        sky: SkyTable,
    ) -> None:
        self._caster, self._at, self._surface_normals, self._rays = caster, at, surface_normals, rays
        self._resolve, self._leaves_of = resolve, leaves_of
        self._seed, self.threads, self._sky = seed, threads, sky

    def trace(
        self,
        bright: BrightElements | None,
        irradiance: Array,
        into: tuple[Array, Array | None] | None = None,
        progress: Progress = SILENT,
    ) -> GatheredHits:
        """Trace all.

        Parameters
        ----------
        bright : BrightElements or None
            What is aimed at.
        irradiance : (n,) float64 [W/m²]
            What is about expected: noise is measured by it.
        into : (n, rays) int32, and (n, rays, 3) float16 or None
            Takes the sources and tints, if given.
        """
        count, scratch = len(self._at), self._at.scratch
        if into is None:
            into = np.empty((count, self._rays), dtype=np.int32), self._new_tints(count)
        sources, tints = into
        closeness, aimed = scratch.empty(count), AimedTable(scratch)
        trace, chunk = partial(_trace, self, bright, irradiance), max(CHUNK_RAYS // self._rays, 1)
        for part, found in map_chunks(trace, count, chunk, self.threads, progress):
            sources[part], closeness[part] = found.sources, found.closeness
            if tints is not None:
                tints[part] = found.tints
            aimed.extend(found.aimed, part.start)
        return GatheredHits(sources, closeness, aimed.all(), tints)

    def _new_tints(self, count: int) -> Array | None:
        return np.empty((count, self._rays, 3), dtype=np.float16) if self._caster.tinted else None

    def shares(self, rows: Array, bright: BrightElements, irradiance: Array) -> Array:
        """Return (r, m) how some rows would share their aimed rays out."""
        return bright.shares(self._at.points[rows], self._at.normals[rows], self._rays, irradiance[rows])

    def trace_rows(self, rows: Array, bright: BrightElements | None, shares: Array | None) -> GatheredHits:
        """Trace all rays of some rows; aimed ones have their rows numbered among these."""
        if bright is None or shares is None or not shares.any():
            sources, closeness, tints = self._cosine(rows, None, None)
            return GatheredHits(sources, closeness, AimedRays.none(), tints)
        sources, closeness, tints = self._cosine(rows, bright, shares)
        return GatheredHits(sources, closeness, self._aim(rows, bright, shares), tints)

    def on_any(self, elements: Array, hosts: Array, hits: Hits) -> Array:
        """Return (h,) whether hits are on some elements, (e,) bool, of some triangles, (t,) bool."""
        found = (hits.triangle >= 0) & hosts[hits.triangle]
        rows = np.flatnonzero(found)
        leaf = self._leaves_of(hits.take(rows))
        found[rows] = (leaf >= 0) & elements[np.maximum(leaf, 0)]
        return np.asarray(found)

    def planes(self, rows: Array) -> tuple[Array, Array]:
        """Return (r, 3) twice: the points, and the normals of the hemispheres that rays leave by."""
        return self._at.points[rows], self._at.normals[rows]

    def directions(self, rows: Array) -> tuple[Array, Array]:
        """Return where the cosine-distributed rays of some rows go.

        Returns
        -------
        directions : (r, rays, 3) float32
        upward : (r, rays) bool
            Whether they leave the surface at all.
        """
        directions = self._directions(rows)
        surface = self._surface_normals[rows].astype(np.float32)
        return directions, (directions @ surface[:, :, None])[:, :, 0] > 0

    def trace_again(
        self, rows: Array, ray: Array, directions: Array, stale: Array, casters: tuple[RayCaster, RayCaster]
    ) -> tuple[Array, Array, Hits, Array]:
        """Trace some cosine-distributed rays, as if their points aimed at nothing.

        Parameters
        ----------
        rows, ray : (p,) int
            In order of the rows.
        directions : (p, 3) float32
        stale : (p,) bool
            Whether what was hit must be numbered again even if it is hit again.
        casters : RayCaster twice
            Of what moved alone, at both places: rays that meet none of it have not changed. And of the scene
            as it was: it gives the lengths of the rays.

        Returns
        -------
        changed : (c,) int
            Which of the rays may have another source now.
        sources : (c,) int32
            That one.
        hits : Hits
            What these met.
        nearer : (c,) float64 [1/m]
            What they add to their points' closeness.
        """
        moved, before = casters
        start = self._starts_of(rows, ray)
        missed = moved.unoccluded(start, directions, np.full(len(rows), np.inf))
        retraced = np.flatnonzero(~missed | stale)
        start, along = start[retraced], directions[retraced]
        hits, old = self._caster.intersect(start, along), before.intersect(start, along)
        same = (hits.triangle == old.triangle) & (hits.front == old.front) & ~stale[retraced]
        same &= (np.abs(hits.barycentric - old.barycentric) < SAME_PLACE).all(axis=1)
        if hits.tint is not None or old.tint is not None:
            one, other = (1.0 if some.tint is None else some.tint for some in (hits, old))
            same &= np.isclose(one, other).all(axis=1)
        other = np.flatnonzero(~same)
        changed, hits, old = retraced[other], hits.take(other), old.take(other)
        least = self._caster.surface_offset
        nearer = 1.0 / np.maximum(hits.distance, least) - 1.0 / np.maximum(old.distance, least)
        nearer = nearer.astype(np.float64) / self._rays
        return changed, self._found(hits, along[other], self._surface_normals[rows[changed]]), hits, nearer

    def _cosine(
        self, rows: Array, bright: BrightElements | None, shares: Array | None
    ) -> tuple[Array, Array, Array | None]:
        """Trace the cosine-distributed rays of rows; return sources, closeness, tints of `GatheredHits`."""
        rays = self._rays
        directions, upward = self.directions(rows)
        start = self._starts(rows, rays, self._seed + Stream.GATHER_STARTS)
        hits = self._caster.intersect(start.reshape(-1, 3), directions.reshape(-1, 3))
        upright = np.repeat(self._surface_normals[rows], rays, axis=0)
        found = self._found(hits, directions.reshape(-1, 3), upright).reshape(len(rows), rays)
        found[~upward] = NOTHING
        if bright is not None and shares is not None:
            found[bright.left_out(shares, hits, self._leaves_of).reshape(found.shape)] = NOTHING
        inverse = 1.0 / np.maximum(hits.distance.reshape(len(rows), rays), self._caster.surface_offset)
        tints = None if hits.tint is None else tints_of(hits).reshape(len(rows), rays, 3)
        return found, inverse.mean(axis=1), tints

    def _directions(self, rows: Array) -> Array:
        """Return (r, rays, 3) float32: where the cosine-distributed rays of some rows go."""
        normals = self._at.normals[rows]
        seed = self._seed + Stream.GATHER_DIRECTIONS
        local = cosine_hemisphere(self._square(rows, self._rays, seed))
        frame = np.stack([*orthonormal_basis(normals), normals], axis=1).astype(np.float32)
        return np.asarray(local @ frame)

    def _found(self, hits: Hits, directions: Array, upright: Array) -> Array:
        """Return (h,) int32 the numbers of what rays met, the sky where they met nothing.

        upright (h, 3): Normals of the surfaces that the rays start on.
        """
        missed = np.flatnonzero(hits.triangle < 0)
        back = np.flatnonzero(~hits.front & (hits.triangle >= 0))
        height = hits.distance[back] * np.einsum("hk,hk->h", directions[back], upright[back])
        answered = np.ones(len(directions), dtype=bool)
        answered[back[height < PRESSED * self._caster.surface_offset]] = False
        found = np.full(len(directions), NOTHING, dtype=np.int32)
        found[answered] = self._resolve(hits.take(answered))
        found[missed] = sky_numbers(self._sky, directions[missed])
        return found

    def _aim(self, rows: Array, bright: BrightElements, shares: Array) -> AimedRays:
        """Trace the rays that some rows aim at bright elements."""
        count = max(self._rays // AIMED_PART, 1)
        start = self._starts(rows, count, self._seed + Stream.AIMED_STARTS)
        unit = self._square(rows, count, self._seed + Stream.AIMED_DIRECTIONS)
        aim = bright.aim(start, self._at.normals[rows], shares, unit)
        hits = self._caster.intersect(start[aim.row].reshape(-1, 3), aim.directions.reshape(-1, 3))
        arrived = self._leaves_of(hits) == aim.element.ravel()
        arrived &= np.einsum("nrk,nk->nr", aim.directions, self._surface_normals[rows[aim.row]]).ravel() > 0
        sources = np.full(len(arrived), NOTHING, dtype=np.int32)
        sources[arrived] = self._resolve(hits.take(arrived))
        shape = aim.element.shape
        weights = aim.weights.astype(np.float32)
        if hits.tint is not None:
            weights = weights[..., None] * hits.tint.reshape(*shape, 3)
        return AimedRays(aim.row, sources.reshape(shape), weights, aim.element)

    def _square(self, rows: Array, count: int, seed: int) -> Array:
        """Return (r, count, 2) float32: the points in the unit square that are the turn of some rows."""
        runs = self._at.runs
        first = 0 if runs is None else runs[rows] * count
        return stratified_square(self._at.keys[rows], count, seed, first)

    def _starts(self, rows: Array, rays: int, seed: int) -> Array:
        """Return (r, rays, 3) where rays start, just above the footprints."""
        at = self._at
        lift = self._caster.surface_offset * self._surface_normals[rows][:, None]
        if at.sampler is None:
            return np.repeat(at.points[rows][:, None] + lift, rays, axis=1)
        starts_used = min(at.starts or rays, rays)
        starts = at.sampler(rows, self._square(rows, starts_used, seed)) + lift
        return np.asarray(starts[:, np.arange(rays) * starts_used // rays])

    def _starts_of(self, rows: Array, ray: Array) -> Array:
        """Return (p, 3) where some cosine-distributed rays, by row and number, start: as in `_starts`."""
        at = self._at
        lift = self._caster.surface_offset * self._surface_normals[rows]
        if at.sampler is None:
            return np.asarray(at.points[rows] + lift)
        starts_used = min(at.starts or self._rays, self._rays)
        distinct, number = np.unique(rows, return_inverse=True)
        number, place = number.reshape(-1), ray * starts_used // self._rays
        unit = self._square(distinct, starts_used, self._seed + Stream.GATHER_STARTS)
        if len(rows) < starts_used * len(distinct):
            return np.asarray(at.sampler(rows, unit[number, place][:, None])[:, 0] + lift)
        return np.asarray(at.sampler(distinct, unit)[number, place] + lift)


def tints_of(hits: Hits) -> Array:
    """Return (n, 3) float16 the tints of hits; ones if they have none."""
    if hits.tint is None:
        return np.ones((len(hits.triangle), 3), dtype=np.float16)
    return np.asarray(np.minimum(hits.tint, MOST_TINT).astype(np.float16))


def _trace(
    gathering: FinalGather, bright: BrightElements | None, irradiance: Array, part: slice
) -> GatheredHits:
    """Trace all rays of a run of points."""
    rows = np.arange(part.start, part.stop)
    shares = None if bright is None or not len(bright) else gathering.shares(rows, bright, irradiance)
    return gathering.trace_rows(rows, bright, shares)
