"""Many lamps as one: exact light of all together, and shadow rays to each by what it adds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..numerics import pick_in_runs, running_sums
from .lamp_table import LampTable
from .light import Emitter, Float64Array, Light, Rays, Samples

MOST_COLORS = 3
"""Lamps of more colors than these are grouped by channel instead: three groups hold any color."""

SAME_COLOR = 1e-6
"""Colors that differ by no more than this part are one."""

BY_POWER = 0.1
"""Of rays that start elsewhere than where lamps were chosen: what is dark there may light their start."""

BELOW_ONE = 1.0 - 2.0**-24
"""The largest number that places a sample."""

LEAST_DOUBT = 0.05
"""Standard deviation of what a point sees of a lamp, at least, however sure its surroundings are."""

BLOCK_PAIRS = 1 << 17
"""Pairs of point and lamp evaluated at a time; bounds the temporaries to about 10 MB a thread."""


@dataclass(frozen=True)
class LearnedRays:
    """k rays of each of n points, that measure by how much what is known of lamps is wrong.

    The irradiance is `base` + Σ weight (free − known); were nothing in the way, it would be `far` + Σ weight
    over near rays.

    rays: As of `Lamp.shadow_rays`.
    known (n, k): How much of its lamp the point is taken to see; 0 of near ones, which nothing is known of.
    near (n, k): Whether its lamp is near.
    base (n,): The irradiance by what is known, per unit of strength.
    far (n,): The unoccluded irradiance of all that is not near.
    """

    rays: Rays
    known: Float64Array
    near: npt.NDArray[np.bool_]
    base: Float64Array
    far: Float64Array


@dataclass(frozen=True)
class _Choice:
    """(n, k) lamps in the table's order, the chances of their choice, and what is left of the numbers.

    known, near, base, far: As in `LearnedRays`; 0 if nothing has been learned.
    """

    lamp: npt.NDArray[np.int64]
    chance: Float64Array
    within: Float64Array
    known: Float64Array
    near: npt.NDArray[np.bool_]
    base: Float64Array
    far: Float64Array

    @staticmethod
    def empty(count: int, each: int) -> _Choice:
        chance, within, known = np.zeros((3, count, each))
        base, far = np.zeros((2, count))
        lamp = np.zeros((count, each), dtype=np.int64)
        return _Choice(lamp, chance, within, known, np.zeros((count, each), dtype=bool), base, far)


@dataclass(frozen=True, eq=False)
class LampGroup(Emitter):
    """Lamps of one color that points see as one.

    members (m,): At least one; all cast shadows or none does.
    powers (m, 3): How much of each one's strength is in the group: all of it, or one channel. All of one
        color.
    """

    members: tuple[Emitter, ...]
    powers: npt.ArrayLike

    @property
    def strength(self) -> Float64Array:
        """(3,) RGB power of all [W]."""
        return np.asarray(np.asarray(self.powers, dtype=np.float64).sum(axis=0))

    @property
    def position(self) -> Float64Array:
        """(3,) the mean of their places by power [m]."""
        table, shares = self._sorted
        return np.asarray(shares @ table.places)

    @property
    def flux(self) -> Float64Array:
        """(3,) RGB power they send out [W]."""
        return self.strength * float(self._sent.sum())

    @cached_property
    def _sorted(self) -> tuple[LampTable, Float64Array]:
        """The members' table, and (m,) what part of the strength each has."""
        powers = np.asarray(self.powers, dtype=np.float64).sum(axis=1)
        table = LampTable(self.members)
        return table, powers[table.order] / powers.sum()

    @cached_property
    def _sent(self) -> Float64Array:
        """(m,) what each sends out per unit of the group's strength."""
        table, shares = self._sorted
        sent = [float(lamp.flux.sum() / lamp.strength.sum()) for lamp in table.members]
        return np.asarray(shares * sent)

    def unit_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:
        """Return the irradiance of all per unit of strength (see `Lamp.unit_irradiance`)."""
        table, shares = self._sorted
        gain = np.empty(len(points))
        near_points, near_lamps = [], []
        for rows in self._blocks(len(points)):
            each, near = table.afar(points[rows], normals[rows])
            each[near] = 0.0
            gain[rows] = each @ shares
            point, lamp = np.nonzero(near)
            near_points.append(point + rows.start)
            near_lamps.append(lamp)
        if near_points:
            point, lamp = np.concatenate(near_points), np.concatenate(near_lamps)
            own = table.exactly(lamp, points[point], normals[point]) * shares[lamp]
            gain += np.bincount(point, own, minlength=len(points))
        return gain

    def shadow_rays(self, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return rays to lamps in proportion to about what each adds (see `Lamp.shadow_rays`).

        Where none adds anything, to lamps by their power, without weight.
        """
        starts = np.broadcast_to(points[:, None], (*u.shape[:2], 3))
        return self._rays_from(starts, self._choose(points, normals, u[..., 0], 0.0), normals, u)

    def rays_from(self, starts: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return rays from (n, k, 3) points, each to a lamp that adds something to the middle of its row.

        Weights are those of `shadow_rays`: in the mean their sum is the mean irradiance of a row's points.
        """
        middle = starts.mean(axis=1)
        return self._rays_from(starts, self._choose(middle, normals, u[..., 0], BY_POWER), normals, u)

    def learned_rays(
        self, points: Float64Array, normals: Float64Array, u: Samples, seen: Float64Array
    ) -> LearnedRays:
        """Return rays to lamps by what is not known of them yet.

        seen (n, c): About how much points see of each run of lamps, see `column_of`.
        """
        choice = self._choose(points, normals, u[..., 0], 0.0, seen)
        starts = np.broadcast_to(points[:, None], (*u.shape[:2], 3))
        return LearnedRays(
            self._rays_from(starts, choice, normals, u), choice.known, choice.near, choice.base, choice.far
        )

    def doubt(self, points: Float64Array, normals: Float64Array, seen: Float64Array) -> Float64Array:
        """Return (n,) the standard deviation of the share that is seen, by one ray of `learned_rays`.

        seen (n, c): As there.
        """
        table, shares = self._sorted
        column = self.column_of(seen.shape[1])
        doubt = np.empty(len(points))
        for rows in self._blocks(len(points)):
            each, near = table.afar(points[rows], normals[rows])
            each = each * shares
            total = each.sum(axis=1)
            each *= _doubts(seen[rows][:, column], near)
            doubt[rows] = each.sum(axis=1) / np.where(total > 0.0, total, 1.0)
        return doubt

    def chosen_rays(
        self, points: Float64Array, normals: Float64Array, u: Samples
    ) -> tuple[Rays, npt.NDArray[np.int64]]:
        """Return the rays of `shadow_rays`, and to which lamp each goes, (n, k) in the table's order."""
        starts = np.broadcast_to(points[:, None], (*u.shape[:2], 3))
        choice = self._choose(points, normals, u[..., 0], 0.0)
        return self._rays_from(starts, choice, normals, u), choice.lamp

    def column_of(self, columns: int) -> npt.NDArray[np.int64]:
        """Return (m,) which of so many runs of neighbors the lamps of the table's order are in."""
        return np.arange(len(self.members)) * columns // len(self.members)

    def _choose(
        self,
        points: Float64Array,
        normals: Float64Array,
        u: Samples,
        by_power: float,
        seen: Float64Array | None = None,
    ) -> _Choice:
        """Choose lamps for points by (n, k) numbers: `by_power` of them by power alone.

        seen (n, c): As for `learned_rays`: then in proportion to how uncertain that leaves what they add.
        """
        table, shares = self._sorted
        column = None if seen is None else self.column_of(seen.shape[1])
        choice = _Choice.empty(*u.shape)
        for rows in self._blocks(len(points)):
            each, near = table.afar(points[rows], normals[rows])
            each = each * shares
            known = None
            if seen is not None:
                known = seen[rows][:, column]
                known[near] = 0.0
                choice.base[rows] = (each * known).sum(axis=1)
                choice.far[rows] = np.where(near, 0.0, each).sum(axis=1)
                each *= _doubts(known, near)
            total = each.sum(axis=1, keepdims=True)
            each *= (1.0 - by_power) / np.where(total > 0.0, total, 1.0)
            each += np.where(total > 0.0, by_power, 1.0) * shares
            first = len(table) * np.arange(len(each))[:, None]
            entry, choice.within[rows] = pick_in_runs(
                running_sums(each.ravel()), u[rows], first, first + len(table)
            )
            choice.lamp[rows], choice.chance[rows] = entry - first, each.ravel()[entry]
            if known is not None:
                choice.known[rows], choice.near[rows] = known.ravel()[entry], near.ravel()[entry]
        return choice

    def _rays_from(self, starts: Float64Array, choice: _Choice, normals: Float64Array, u: Samples) -> Rays:
        """Return a ray from each of (n, k, 3) points to the lamp chosen for it."""
        table, shares = self._sorted
        count = u.shape[1]
        square = np.minimum(np.stack([choice.within, u[..., 1]], axis=-1), BELOW_ONE)
        facing = np.repeat(normals, count, axis=0)
        found = table.rays(choice.lamp.ravel(), starts.reshape(-1, 3), facing, square.reshape(-1, 2))
        directions, distances, weights = (each.reshape(*u.shape[:2], *each.shape[1:]) for each in found)
        chance = np.where(choice.chance > 0.0, choice.chance, np.inf)
        return directions, distances, weights * shares[choice.lamp] / (chance * count)

    def emit(self, place: Samples, way: Samples) -> Rays:
        """Return rays that carry the lamps' light away, as many of each as its part (see `Emitter.emit`)."""
        table, _ = self._sorted
        ways = np.array(way, dtype=np.float64)
        lamp, ways[:, 0] = pick_in_runs(running_sums(self._sent), ways[:, 0])
        ways = np.minimum(ways, BELOW_ONE)
        origins, directions, shares = np.empty((len(ways), 3)), np.empty((len(ways), 3)), np.empty(len(ways))
        for number in np.unique(lamp):
            rows = np.flatnonzero(lamp == number)
            origins[rows], directions[rows], own = table.members[number].emit(place[rows], ways[rows])
            shares[rows] = own / max(float(own.mean()), np.finfo(float).tiny)
        return origins, directions, shares

    def _blocks(self, count: int) -> list[slice]:
        step = max(BLOCK_PAIRS // len(self.members), 1)
        return [slice(first, first + step) for first in range(0, count, step)]


def _doubts(known: Float64Array, near: npt.NDArray[np.bool_]) -> Float64Array:
    """Return (n, m) the standard deviations of what points see of lamps, of which they know the mean."""
    deviation = np.sqrt(np.maximum(known * (1.0 - known), LEAST_DOUBT**2))
    return np.asarray(np.where(near, 0.5, deviation))


def each_lamp(lights: Sequence[Light]) -> list[Light]:
    """Return lights with the members of groups in their place."""
    return [one for light in lights for one in (light.members if isinstance(light, LampGroup) else [light])]


def grouped(lights: Sequence[Light], most: int) -> tuple[Light, ...]:
    """Return lights of which lamps with a place, if they are more than `most`, are groups of one color each.

    Their light is the same; what it costs hardly grows with their number.
    """
    lit = [light for light in lights if isinstance(light, Emitter) and light.strength.any()]
    if len(lit) <= most:
        return tuple(lights)
    chosen = {id(light) for light in lit}
    result = [light for light in lights if id(light) not in chosen]
    for shadows in (True, False):
        lamps = [lamp for lamp in lit if lamp.casts_shadow is shadows]
        if lamps:
            result += _by_color(lamps, shadows)
    return tuple(result)


def _by_color(lamps: list[Emitter], shadows: bool) -> list[Light]:
    """Group lamps by color, or by channel if there are many colors."""
    powers = np.array([lamp.strength for lamp in lamps])
    colors = np.round(powers / powers.max(axis=1, keepdims=True) / SAME_COLOR)
    found, color = np.unique(colors, axis=0, return_inverse=True)
    color = color.reshape(-1)
    if len(found) <= MOST_COLORS:
        parts = [np.where((color == number)[:, None], powers, 0.0) for number in range(len(found))]
    else:
        parts = [powers * channel for channel in np.eye(3)]
    groups: list[Light] = []
    for part in parts:
        rows = np.flatnonzero(part.any(axis=1))
        if len(rows) == 1 and len(found) <= MOST_COLORS:
            groups.append(lamps[rows[0]])
        elif len(rows):
            members = tuple(lamps[row] for row in rows)
            name = f"{len(rows)} lamps"
            groups.append(LampGroup(members, part[rows], casts_shadow=shadows, name=name))
    return groups
