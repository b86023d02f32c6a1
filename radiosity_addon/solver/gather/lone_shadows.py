"""How much each point sees of one of many lamps, which is kept because it may shine alone one day.

A hundred lamps cannot each have the rays of one that is alone. What is wrong at a point counts by what the
lamp gives there, so rays go where that is much *of its own light*: as the 4/5th power, for of k stratified
rays the noise falls by k^(3/4). One ray a point finds where a shadow's edge is. Around it a few more find the
texels that it crosses, and only these get all theirs. The light of other lamps counts for nothing: any of
them may be switched off.
"""

from __future__ import annotations

import numpy as np

from ...base import SILENT, Progress
from ...lights import Emitter, LampGroup
from ...numerics import Array, marked, row_numbers, tiles
from ...rays import RayCaster
from .footprints import SpreadPoints
from .soft_shadows import ShadowShare, _mean

SHARED_STARTS = 16
"""Points of a footprint that rays to all lamps start from: making them takes longer than a ray."""

RAYS = 2.0
"""Rays of a penumbra, for each shadow ray of a lamp, where the lamp gives the mean of what it gives, …"""

MOST_RAYS = 64
"""… and at most, where it gives more."""

FIRST_RAYS = 1.0
"""Rays of any point likewise, but one at least, …"""

MOST_FIRST = 4
"""… and at most."""

PROBES = 4
"""Times as many rays find out whether an edge crosses a texel next to one."""

STEPS = 2
"""How far, in neighbors, an edge is followed from where a ray a point found it."""

ENOUGH = 2.0
"""Lamps up to this many times the number from which they are many have all these rays; more share them."""


class LoneShadowShare(ShadowShare):
    """The unblocked share of one of many lamps, by what it adds to its own light alone.

    part: Of the rays that a lamp would have if lamps were just too many, see `part_of_rays`.
    """

    def __init__(
        self,
        caster: RayCaster,
        light: Emitter,
        spread: SpreadPoints,
        seed: int,
        threads: int = 0,
        part: float = 1.0,
    ) -> None:
        super().__init__(caster, light, spread, seed, threads)
        self._part = part

    def at_points(self, gain: Array, rays: int, progress: Progress = SILENT) -> Array:
        """Ask where the lamp shines (see `ShadowShare.at_points`)."""
        count, near, light = len(gain), self._at.near, self._light
        assert isinstance(light, Emitter)
        if not light.casts_shadow:
            return np.ones(count)
        facing = marked(count, lambda tile: gain[tile] > 0)
        mean = sum(float(gain[tile].sum()) for tile in tiles(count)) / max(count, 1)
        first, many = np.empty((2, count), dtype=np.int16)
        least, most = FIRST_RAYS * self._part * rays, RAYS * self._part * rays
        for tile in tiles(count):
            bright = (gain[tile] / max(mean, 1e-300)) ** 0.8
            first[tile] = _power_of_two(least * bright, MOST_FIRST * rays if near is not None else rays)
            many[tile] = _power_of_two(most * bright, MOST_RAYS * rays)
        self._shadow(row_numbers(facing), first, progress.part(0.0, 0.4))
        if near is not None:
            self._follow_edges(facing, first, many, progress.part(0.4, 1.0))
        for tile in tiles(count):
            self._lit[tile] = self._share(tile)
        return self._lit

    def _follow_edges(self, facing: Array, first: Array, many: Array, progress: Progress) -> None:
        """Ask more rays where neighbors differ, and on from there as far as a penumbra goes."""
        near = self._at.near
        assert near is not None
        count = len(facing)
        bright = marked(count, lambda tile: facing[tile] & (_mean(self._share(tile)) > 0.5))
        partial = marked(count, lambda tile: facing[tile] & self._is_partial(tile))
        edge = (near(bright) & near(facing & ~bright)) | near(partial)
        probes = np.minimum(many, PROBES * first)
        waiting = facing & (many > first)
        for _, turn in zip(range(STEPS), progress.turns(0.5), strict=False):
            rows = row_numbers(edge & waiting)
            if len(rows) == 0:
                break
            waiting[rows] = False
            self._shadow(rows[probes[rows] > first[rows]], probes, turn.part(0.0, 0.3))
            crossed = rows[self._is_partial(rows)]
            self._shadow(crossed[many[crossed] > probes[crossed]], many, turn.part(0.3, 1.0))
            edge = np.zeros(count, dtype=bool)
            edge[crossed] = True
            edge = near(edge)


def part_of_rays(lamps: int, many: int) -> float:
    """Return what part of its rays each of `lamps` has, so that those of all hardly grow.

    many: Lamps are many if they are more than this.
    """
    return min(ENOUGH * many / max(lamps, 1), 1.0)


def one_lamp(light: Emitter) -> LampGroup:
    """Return a lamp whose unoccluded irradiance is that of lamps in tables: exact where it is near."""
    return LampGroup((light,), np.ones((1, 3)), casts_shadow=light.casts_shadow)


def _power_of_two(wanted: Array, most: int) -> Array:
    """Return (n,) powers of two, at least `wanted`, from 1 to `most`."""
    exponent = np.ceil(np.log2(np.maximum(wanted, 1.0)))
    return np.asarray(np.minimum(2.0**exponent, most), dtype=np.int16)
