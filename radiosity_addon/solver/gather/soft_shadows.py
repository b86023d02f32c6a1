"""How much of a lamp each point sees: few shadow rays everywhere, many in penumbrae.

Samples are spread over footprints, so that a shadow's edge that crosses a texel is its mean.
A lamp that adds little to the light there is gets fewer rays: of k stratified ones the noise falls
by k^(3/4), so rays as the 4/5th power of the lamps' parts leave the least noise of all for their number.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...lights import Lamp, Rays
from ...numerics import Array, Stream, fill_chunks, marked, row_numbers, stratified_square, tiles
from ...rays import RayCaster, passing_light
from ..emitters import EmitterGroup
from .footprints import Footprints, SpreadPoints

CHUNK_RAYS = 1 << 16
"""Rays a thread prepares at once; bounds its temporaries to about 10 MB."""

MORE_RAYS = 16
"""Times as many shadow rays where the first disagree …"""

MAIN_PART = 0.6
"""… and a lamp gives this part of the light, or more."""

MIN_SHADOW_RAYS = 2
"""Shadow rays of a lamp that adds hardly anything. A single one would measure the visible share of the lamp,
not of its light: 0.40 instead of 0.44 behind a plate half way to a near lamp; two measure 0.43."""

UNEVEN = 0.02
"""Rays behind glass disagree if some bring less than the others by more than this part of any channel."""

BOXES = 4
"""Boxes along a footprint's side: as many rays of a penumbra start in each."""

PENUMBRA_STEPS = 32
"""How far, in neighbors, a penumbra is followed from where few rays found it."""


class ShadowShare:
    """The unblocked share of one lamp at footprints, by channel if the caster is tinted.

    spread: The footprints.
    """

    FIRST = 1
    """Times as many rays a point at first."""

    def __init__(
        self,
        caster: RayCaster,
        light: Lamp | EmitterGroup,
        spread: SpreadPoints,
        seed: int,
        threads: int = 0,
    ) -> None:
        self._caster, self._light, self._spread = caster, light, spread
        self._at: Footprints = spread.at
        self._seed, self._threads = seed, threads
        scratch, count = self._at.scratch, len(self._at)
        self._lit = scratch.zeros((count, 3) if caster.tinted else count)
        self._total = scratch.zeros(count)
        # Behind even glass no share is 0 or 1, and yet all rays agree.
        self._uneven = scratch.zeros(count, bool) if caster.tinted else None

    def at_points(self, gain: Array, rays: int, progress: Progress = SILENT) -> Array:
        """Ask where the lamp shines.

        gain (n,): Unoccluded irradiance per unit of the lamp's strength.
        rays: A point, where the lamp is most of the light there is.
        Returns share (n,) or (n, 3).
        """
        if isinstance(self._light, Lamp) and not self._light.casts_shadow:
            return np.ones(len(gain))
        count, near, strength = len(gain), self._at.near, self._light.strength.mean()
        facing = marked(count, lambda tile: gain[tile] > 0)
        few, many = np.empty((2, count), dtype=np.int32)
        least = self.FIRST * rays
        for tile in tiles(count):
            part = self._at.weight_of(gain[tile] * strength, tile)
            few[tile] = power_of_two(least * np.sqrt(part / MAIN_PART), least)
            many[tile] = power_of_two(MORE_RAYS * rays * (part / MAIN_PART) ** 0.8, MORE_RAYS * rays)
        self._shadow(row_numbers(facing), few, progress.part(0.0, 0.5))
        # Few rays miss the faint ends of a penumbra: where many rays found one, ask around it.
        many = self._many(facing, many, MORE_RAYS * rays)
        open_rows = facing & (many > few)
        partial = marked(count, lambda tile: facing[tile] & self._is_partial(tile))
        if near is not None:
            bright = marked(count, lambda tile: facing[tile] & (_mean(self._share(tile)) > 0.5))
            partial = near(partial) | (near(bright) & near(facing & ~bright))
        for _, turn in zip(range(PENUMBRA_STEPS), progress.part(0.5, 1.0).turns(0.5), strict=False):
            rows = row_numbers(partial & open_rows)
            if len(rows) == 0:
                break
            open_rows[rows] = False
            self._shadow(rows, many, turn)
            if near is None:
                break
            partial = np.zeros(len(facing), dtype=bool)
            partial[rows[self._is_partial(rows)]] = True
            partial = near(partial)
        for tile in tiles(count):
            self._lit[tile] = self._share(tile)
        return self._lit

    def _many(self, _facing: Array, many: Array, _most: int) -> Array:
        """Return (n,) how many rays follow the first where they disagree: `many`, of which `most` at most."""
        return many

    def _share(self, rows: Array | slice = slice(None)) -> Array:
        """Return the share as far as it is known: all, where no ray that was asked carries light."""
        total = self._total[rows]
        share = np.asarray((self._lit[rows].T / np.where(total > 0, total, 1.0)).T)
        share[total == 0] = 1.0
        return share

    def _is_partial(self, rows: Array | slice) -> Array:
        """Return which rows' shares are neither none nor all, or not known.

        Where a glowing face goes through a footprint, all rays that were asked may start behind it.
        """
        unknown = self._total[rows] == 0.0
        if self._uneven is not None:
            return np.asarray(self._uneven[rows] | unknown)
        share = self._share(rows)
        return np.asarray(((share > 1e-6) & (share < 1 - 1e-6)) | unknown)

    def _shadow(self, rows: Array, counts: Array, progress: Progress) -> None:
        """Ask `counts[row]` shadow rays a row, in place of those asked before."""
        each = counts[rows]
        total, done = max(int(each.sum()), 1), 0
        for count in np.unique(each):
            batch = rows[each == count]
            before, done = done, done + int(count) * len(batch)
            self._shadow_alike(batch, int(count), progress.part(before / total, done / total))

    def _shadow_alike(self, rows: Array, count: int, progress: Progress) -> None:
        """Ask `count` shadow rays a row."""
        trace = partial(_shadowed, self._spread, self._light, self._caster, rows, count, self._seed)
        into: tuple[Array, ...] = (self._lit, self._total)
        into, chunk = (into if self._uneven is None else (*into, self._uneven)), max(CHUNK_RAYS // count, 1)
        fill_chunks(trace, into, len(rows), chunk, self._threads, progress, at=rows)


def _shadowed(
    spread: SpreadPoints,
    light: Lamp | EmitterGroup,
    caster: RayCaster,
    rows: Array,
    count: int,
    seed: int,
    part: slice,
) -> tuple[Array, ...]:
    """Return (r,) the sums of unblocked and of all weights of `count` shadow rays a row.

    Of a tinted caster (r, 3) and (r,), and whether the rays of a row differ, (r,).
    """
    chunk = rows[part]
    center, normal = spread.at.points[chunk], spread.at.normals[chunk]
    unit = stratified_square(spread.at.keys[chunk], count, seed + Stream.SHADOW_RAYS)
    aimed = light.shadow_rays(center, normal, unit)
    start, directions, distances, weights = spread_rays(spread, light, caster, chunk, unit, aimed, seed)
    point, sample = np.nonzero(weights > 0)
    ray = (point, sample)
    free = passing_light(caster, start[ray], directions[ray], distances[ray])
    if not caster.tinted:
        return np.bincount(point, free * weights[ray], minlength=len(chunk)), weights.sum(axis=1)
    lit = [np.bincount(point, of * weights[ray], minlength=len(chunk)) for of in free.T]
    low, high = np.full((len(chunk), 3), np.inf), np.zeros((len(chunk), 3))
    np.minimum.at(low, point, free)
    np.maximum.at(high, point, free)
    uneven = (high - low > UNEVEN * high).any(axis=1)
    return np.stack(lit, axis=1), weights.sum(axis=1), uneven


def spread_rays(
    spread: SpreadPoints,
    light: Lamp | EmitterGroup,
    caster: RayCaster,
    chunk: Array,
    unit: Array,
    aimed: Rays,
    seed: int,
) -> tuple[Array, Array, Array, Array]:
    """Spread rays that are aimed at a light from the centers of footprints over the footprints.

    chunk (r,): Rows of the footprints.
    unit (r, k, 2): What aimed the rays.
    aimed: Directions, distances and weights.
    Returns starts, directions (r, k, 3), distances, weights (r, k).
    """
    at, count = spread.at, unit.shape[1]
    center, normal = at.points[chunk], at.normals[chunk]
    directions, distances, weights = aimed
    # The edge of a spot's cone may cross a footprint and leave its center dark: then all count alike.
    weights = np.where(weights.any(axis=1, keepdims=True), weights, 1.0)
    start = center[:, None]
    if at.sampler is not None:
        # The same lamp points, seen from points spread over the footprint.
        start = _starts(spread, chunk, count, seed)
        finite = np.isfinite(distances)
        reach = np.where(finite, distances, 1.0)[..., None]
        along = np.where(finite[..., None], directions * reach - (start - center[:, None]), directions)
        length = np.sqrt(np.einsum("rkc,rkc->rk", along, along))
        directions = along / np.maximum(length, 1e-300)[..., None]
        distances = np.where(finite, length, np.inf)
        if isinstance(light, EmitterGroup):
            # Next to a face the light at a start is not that in the center; it may even be behind the face.
            near = np.flatnonzero(light.is_near(center, spread.width(chunk)))
            own = (
                start[near].reshape(-1, 3),
                np.repeat(normal[near], count, axis=0),
                unit[near].reshape(-1, 2),
            )
            directions[near], distances[near], weights[near] = (
                found.reshape(len(near), count, *found.shape[1:]) for found in light.rays_from(*own)
            )
    if at.lift is not None:
        start = at.lift(chunk, np.broadcast_to(start, directions.shape), directions)
    start = np.broadcast_to(start + caster.surface_offset * normal[:, None], directions.shape)
    return start, directions, distances, weights


def _starts(spread: SpreadPoints, rows: Array, count: int, seed: int) -> Array:
    """Return (r, count, 3) float64 points of the footprints of some rows."""
    at = spread.at
    if count <= spread.count:
        return spread.points(rows, count)
    assert at.sampler is not None
    # A point for every ray: behind a small lamp the shadow's edge is as sharp as if its rays were one.
    unit = stratified_square(at.keys[rows], count, seed + Stream.SHADOW_STARTS)
    if count > BOXES**2:
        # Each run of rays, which is stratified by itself over the lamp, keeps to a box of the footprint.
        box = (BOXES * unit).astype(np.int8) @ np.array([BOXES, 1], dtype=np.int8)
        unit = np.take_along_axis(unit, box.argsort(axis=1, kind="stable")[..., None], axis=1)
    return np.asarray(at.sampler(rows, unit))


def _mean(share: Array) -> Array:
    """Return (n,) shares, of (n, 3) by channel the mean."""
    return share if share.ndim == 1 else np.asarray(share.mean(axis=1))


def power_of_two(wanted: Array, most: int) -> Array:
    """Return (n,) int64 powers of two, at least `wanted`, from `MIN_SHADOW_RAYS` up to `most` itself."""
    exponent = np.ceil(np.log2(np.maximum(wanted, MIN_SHADOW_RAYS)))
    return np.asarray(np.minimum(2.0**exponent, most), dtype=np.int64)
