"""How much of a lamp each point sees: few shadow rays everywhere, many in penumbrae.

Samples are spread over footprints, so that a shadow's edge that crosses a texel is its mean.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np

from .arrays import Array
from .emitters import EmitterGroup
from .lights import Lamp
from .parallel import chunk_steps
from .sampling import stratified_square
from .visibility import RayCaster

CHUNK_RAYS = 1 << 17
"""Rays a thread prepares at once; bounds its temporaries to about 20 MB."""

GAINS, UNEVEN, MORE_GAINS = 4, 0.02, 64
"""Points of a footprint at which the unblocked light is asked for, and how many more where it varies by
more than this part: beside a lamp, and at the rim of a spot's cone."""

MORE_RAYS = 16
"""Times as many shadow rays where the first disagree."""

PENUMBRA_STEPS = 32
"""How far, in neighbours, a penumbra is followed from where few rays found it."""

Sampler = Callable[[Array, Array], Array]
"""(rows, u (r, k, 2)) → (r, k, 3): points of the rows' footprints."""


Lift = Callable[[Array, Array, Array], Array]
"""(rows, starts (r, k, 3), directions (r, k, 3)) → (r, k, 3): where shadow rays start instead."""


@dataclass(frozen=True)
class Footprints:
    """Where light is asked for.

    Attributes
    ----------
    points, normals : (n, 3) float64
        Centres of the footprints, unit normals.
    keys : (n,) int
        With the seed, what places each point's samples.
    sampler : callable or None
        Spreads the samples over each point's footprint; None keeps them at the point.
    near : callable or None
        Grows a (n,) mask of doubtful points to their neighbours, which then also get the
        larger number of rays.
    starts : int or None
        From how many samples a point's gather rays start, each of them a run that is stratified by
        itself; None gives every ray its own.
    lift : callable or None
        Moves the starts of shadow rays off a smooth surface's flat triangles.
    """

    points: Array
    normals: Array
    keys: Array
    sampler: Sampler | None = None
    near: Callable[[Array], Array] | None = None
    starts: int | None = None
    lift: Lift | None = None

    def __len__(self) -> int:
        return len(self.points)

    def mean_gain(self, light: Lamp, seed: int) -> Array:
        """Return (n,) the unoccluded irradiance per unit of strength, a mean over the footprint."""
        if self.sampler is None:
            return light.unit_irradiance(self.points, self.normals)
        gain = self._gains(light, np.arange(len(self)), GAINS, seed)
        mean = gain.mean(axis=1)
        uneven = np.flatnonzero(gain.std(axis=1) > UNEVEN * mean)
        step = CHUNK_RAYS // MORE_GAINS
        for first in range(0, len(uneven), step):
            rows = uneven[first : first + step]
            mean[rows] = self._gains(light, rows, MORE_GAINS, seed).mean(axis=1)
        return np.asarray(mean)

    def _gains(self, light: Lamp, rows: Array, count: int, seed: int) -> Array:
        """Return (r, count) the unoccluded irradiance per unit of strength, at points of footprints."""
        assert self.sampler is not None
        spread = self.sampler(rows, stratified_square(self.keys[rows], count, seed)).reshape(-1, 3)
        gain = light.unit_irradiance(spread, np.repeat(self.normals[rows], count, axis=0))
        return np.asarray(gain.reshape(-1, count))


class ShadowShare:
    """The unblocked share of one lamp at footprints.

    Parameters
    ----------
    caster : RayCaster
    light : Lamp or EmitterGroup
    footprints : Footprints
    seed, threads : int
    """

    def __init__(
        self,
        caster: RayCaster,
        light: Lamp | EmitterGroup,
        footprints: Footprints,
        seed: int,
        threads: int = 0,
    ) -> None:
        self._caster, self._light, self._at = caster, light, footprints
        self._seed, self._threads = seed, threads
        self._lit, self._total = np.zeros(len(footprints)), np.zeros(len(footprints))

    def steps(self, facing: Array, rays: int) -> Generator[float, None, Array]:
        """Ask where `facing` (n,) bool; yields the fraction done, returns the (n,) share."""
        for fraction in self._shadow(np.flatnonzero(facing), rays):
            yield 0.5 * fraction
        # Few rays miss the faint ends of a penumbra: where many rays found one, ask around it.
        many = np.zeros(len(facing), dtype=bool)
        near = self._at.near
        left = 0.5
        for _ in range(PENUMBRA_STEPS):
            share = self._share()
            partial = facing & (share > 1e-6) & (share < 1 - 1e-6)
            if near is not None:
                partial = near(partial) | (near(facing & (share > 0.5)) & near(facing & (share <= 0.5)))
            rows = np.flatnonzero(partial & facing & ~many)
            if len(rows) == 0:
                break
            many[rows] = True
            self._lit[rows] = self._total[rows] = 0.0
            for fraction in self._shadow(rows, rays * MORE_RAYS):
                yield 1.0 - left * (1.0 - 0.5 * fraction)
            left *= 0.5
        return self._share()

    def _share(self) -> Array:
        return np.asarray(self._lit / np.where(self._total > 0, self._total, 1.0))

    def _shadow(self, rows: Array, count: int) -> Generator[float, None, None]:
        """Add `count` shadow rays a row to the sums of unblocked and of all weights."""
        at, caster = self._at, self._caster

        def trace(part: slice) -> None:
            chunk = rows[part]
            centre, normal = at.points[chunk], at.normals[chunk]
            unit = stratified_square(at.keys[chunk], count, self._seed + 1)
            directions, distances, weights = self._light.shadow_rays(centre, normal, unit)
            start = np.repeat(centre[:, None], count, axis=1)
            if at.sampler is not None:
                # The same lamp points, seen from points spread over the footprint.
                start = at.sampler(chunk, stratified_square(at.keys[chunk], count, self._seed + 2))
                finite = np.isfinite(distances)[..., None]
                reach = np.where(finite, distances[..., None], 1.0)
                along = np.where(finite, centre[:, None] + directions * reach - start, directions)
                length = np.linalg.norm(along, axis=2)
                directions = along / np.maximum(length, 1e-300)[..., None]
                distances = np.where(finite[..., 0], length, np.inf)
            if at.lift is not None:
                start = at.lift(chunk, start, directions)
            start = start + caster.surface_offset * normal[:, None]
            point, sample = np.nonzero(weights > 0)
            ray = (point, sample)
            free = caster.visible(start[ray], directions[ray], distances[ray])
            self._lit[chunk] += np.bincount(point, free * weights[ray], minlength=len(chunk))
            self._total[chunk] += weights.sum(axis=1)

        yield from chunk_steps(trace, len(rows), max(CHUNK_RAYS // count, 1), self._threads)
