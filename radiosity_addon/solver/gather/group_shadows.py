"""How much of many lamps together each point sees.

Rays that see another lamp each say little of a point. But a wall hides the same lamps from all points around:
the first rays, a few a point, teach how much blocks of neighbors see of each lamp, and further rays measure
only by how much that is wrong, at lamps of which little is known. What a block sees is wrong by the
mean over a point's own rays, so nothing is biased: these are other rays than those that taught it.
"""

from __future__ import annotations

from functools import cached_property, partial

import numpy as np

from ...base import Progress
from ...lights import Lamp, LampGroup
from ...numerics import Array, Stream, along_curve, fill_chunks, map_chunks, row_numbers, stratified_square
from ...rays import RayCaster, passing_light
from ..emitters import EmitterGroup
from .footprints import CHUNK_POINTS, Footprints, SpreadPoints
from .soft_shadows import CHUNK_RAYS, MORE_RAYS, UNEVEN, ShadowShare, power_of_two, spread_rays

BLOCK_POINTS = 64
"""Neighboring points that learn together."""

NOISE = 0.02
"""Noise of the share that is tolerated with one shadow ray a lamp; it falls with the root of their number."""

LEARNED_RAYS = 4
"""Times as many rays at most as one lamp gets where its first disagree."""

REGION_BLOCKS = 16
"""Blocks along the curve that make a region, …"""

PRIOR_RAYS = 2.0
"""… which counts for a block like so many of its own rays to each lamp."""

MOST_COLUMNS = 128
"""Runs of neighboring lamps that are told apart, at most: of more a block learns too little of each."""


def shadow_share(
    caster: RayCaster,
    light: Lamp | EmitterGroup,
    spread: SpreadPoints,
    seed: int,
    threads: int = 0,
) -> ShadowShare:
    """Return what finds the unblocked share of a light at footprints."""
    if isinstance(light, LampGroup):
        return GroupShadowShare(caster, light, spread, seed, threads)
    return ShadowShare(caster, light, spread, seed, threads)


class GroupShadowShare(ShadowShare):
    """The unblocked share of many lamps together."""

    FIRST = 4

    def __init__(
        self, caster: RayCaster, light: LampGroup, spread: SpreadPoints, seed: int, threads: int = 0
    ) -> None:
        super().__init__(caster, light, spread, seed, threads)
        self._group = light
        # No share is 0 or 1 of what was learned, and yet all rays may agree.
        self._differ = self._uneven = self._at.scratch.zeros(len(self._at), bool)
        # Elsewhere more rays would be asked only where a point's own first disagree: that would be biased.
        self._learned = None if self._at.near is None else LampVisibility(self._at, light)
        self._taught = False

    def _many(self, _facing: Array, many: Array, _most: int) -> Array:
        """As many as what was learned leaves in doubt asks for; none if nothing is learned."""
        if self._learned is None:
            return np.zeros_like(many)
        rows = row_numbers(_facing)
        doubt = np.empty(len(rows))
        ask = partial(_doubts, self._at, self._group, self._learned, rows)
        fill_chunks(ask, doubt, len(rows), CHUNK_POINTS, self._threads)
        noise = NOISE * np.sqrt(MORE_RAYS / _most)
        result = np.zeros_like(many)
        result[rows] = power_of_two((doubt / noise) ** 2 * (many[rows] / _most), LEARNED_RAYS * _most)
        return result

    def _shadow(self, rows: Array, counts: Array, progress: Progress) -> None:
        super()._shadow(rows, counts, progress)
        self._taught = True

    def _shadow_alike(self, rows: Array, count: int, progress: Progress) -> None:
        learned = self._learned if self._taught else None
        trace = partial(_first_rays, self._spread, self._group, self._caster, rows, count, self._seed)
        if learned is not None:
            scene = self._spread, self._group, self._caster
            trace = partial(_learned_rays, *scene, rows, count, self._seed, learned)
        chunk = max(CHUNK_RAYS // count, 1)
        # In order: what is learned is a sum.
        for part, found in map_chunks(trace, len(rows), chunk, self._threads, progress):
            at = rows[part]
            self._lit[at], self._total[at], self._differ[at] = found[:3]
            if self._learned is not None and not self._taught:
                self._learned.add(at, *found[3:])


def _doubts(at: Footprints, group: LampGroup, learned: LampVisibility, rows: Array, part: slice) -> Array:
    """Return (r,) the standard deviation of what one ray would measure of the share at some rows."""
    chunk = rows[part]
    return group.doubt(at.points[chunk], at.normals[chunk], learned.of(chunk))


class LampVisibility:
    """How much blocks of points see of runs of lamps."""

    def __init__(self, at: Footprints, group: LampGroup) -> None:
        self.columns = min(len(group.members), MOST_COLUMNS)
        self._column = group.column_of(self.columns)
        count = len(at)
        blocks = max(count // BLOCK_POINTS, 1)
        # Points that face one way and lie together.
        side = np.abs(at.normals).argmax(axis=1)
        side += 3 * (np.take_along_axis(at.normals, side[:, None], axis=1)[:, 0] < 0)
        order = np.argsort(along_curve(np.asarray(at.points)) + (side << 30), kind="stable")
        self._block = np.empty(count, dtype=np.int32)
        self._block[order] = np.arange(count) * blocks // max(count, 1)
        self._free, self._rays = np.zeros((2, blocks, self.columns), dtype=np.float32)

    def add(self, rows: Array, lamp: Array, free: Array) -> None:
        """Learn from rays of (r,) points to (r, k) lamps: `free` (r, k) of each passes, NaN of no ray."""
        asked = ~np.isnan(free)
        at = (np.repeat(self._block[rows], lamp.shape[1])[asked.ravel()], self._column[lamp[asked]])
        np.add.at(self._rays, at, np.float32(1.0))
        np.add.at(self._free, at, free[asked].astype(np.float32))

    def of(self, rows: Array) -> Array:
        """Return (r, columns) float32 about how much points see of runs of lamps."""
        return np.asarray(self._seen[self._block[rows]])

    @cached_property
    def _seen(self) -> Array:
        """(b, columns) float32: by a block's own rays as far as it has some, else by those of its region."""
        regions = np.arange(len(self._rays)) // REGION_BLOCKS
        starts = np.arange(0, len(self._rays), REGION_BLOCKS)
        rays, free = (np.add.reduceat(sums, starts, axis=0) for sums in (self._rays, self._free))
        every = free.sum(axis=1, keepdims=True) / np.maximum(rays.sum(axis=1, keepdims=True), 1.0)
        around = (free + every) / (rays + 1.0)
        return np.asarray((self._free + PRIOR_RAYS * around[regions]) / (self._rays + PRIOR_RAYS))


def _first_rays(
    spread: SpreadPoints, group: LampGroup, caster: RayCaster, rows: Array, count: int, seed: int, part: slice
) -> tuple[Array, ...]:
    """Return (r,) the sums of unblocked and of all weights, and whether rays differ.

    And (r, k) the lamps that rays went to and how much was free, NaN where there was no ray.
    """
    chunk = rows[part]
    unit = stratified_square(spread.at.keys[chunk], count, seed + Stream.SHADOW_RAYS)
    aimed, lamp = group.chosen_rays(spread.at.points[chunk], spread.at.normals[chunk], unit)
    start, directions, distances, weights = spread_rays(spread, group, caster, chunk, unit, aimed, seed)
    free = _free(caster, start, directions, distances, weights)
    passed = np.where(np.isnan(free), 0.0, free)
    lit = np.einsum("rk,rk...->r...", weights, passed)
    own = np.where(aimed[2] > 0, free if free.ndim == 2 else free.mean(axis=2), np.nan)
    return lit, weights.sum(axis=1), _differ(free), lamp, own


def _learned_rays(
    spread: SpreadPoints,
    group: LampGroup,
    caster: RayCaster,
    rows: Array,
    count: int,
    seed: int,
    learned: LampVisibility,
    part: slice,
) -> tuple[Array, ...]:
    """Return (r,) the unblocked irradiance, that were nothing in the way, and whether rays differ."""
    chunk, seed = rows[part], seed + Stream.LEARNED_SHADOWS
    unit = stratified_square(spread.at.keys[chunk], count, seed + Stream.SHADOW_RAYS)
    aimed = group.learned_rays(spread.at.points[chunk], spread.at.normals[chunk], unit, learned.of(chunk))
    start, directions, distances, weights = spread_rays(spread, group, caster, chunk, unit, aimed.rays, seed)
    free = _free(caster, start, directions, distances, weights)
    # Where the center gets nothing, nothing is known either: all rays count alike.
    dark = ~aimed.rays[2].any(axis=1)
    known, near = np.where(dark[:, None], 0.0, aimed.known), aimed.near | dark[:, None]
    base, far = np.where(dark, 0.0, aimed.base), np.where(dark, 0.0, aimed.far)
    wrong = np.where(np.isnan(free), 0.0, free - (known if free.ndim == 2 else known[..., None]))
    more = np.einsum("rk,rk...->r...", weights, wrong)
    lit = np.maximum((base if more.ndim == 1 else base[:, None]) + more, 0.0)
    return lit, far + (weights * near).sum(axis=1), _differ(free)


def _free(caster: RayCaster, start: Array, directions: Array, distances: Array, weights: Array) -> Array:
    """Return (r, k) or (r, k, 3) how much of rays passes, NaN of those without weight."""
    ray = np.nonzero(weights > 0)
    passed = passing_light(caster, start[ray], directions[ray], distances[ray])
    free = np.full((*weights.shape, *passed.shape[1:]), np.nan)
    free[ray] = passed
    return free


def _differ(free: Array) -> Array:
    """Return (r,) whether a row's rays differ in any channel."""
    asked = ~np.isnan(free)
    low, high = np.where(asked, free, np.inf).min(axis=1), np.where(asked, free, 0.0).max(axis=1)
    differ = high - low > UNEVEN * high
    return np.asarray(differ if differ.ndim == 1 else differ.any(axis=1))
