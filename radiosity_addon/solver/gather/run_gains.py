"""What cells get of each of many lamps: of its unoccluded light what they see of the lamps around it.

Cells answer rays, and a ray meets one of many. So of a thousand lamps they need not know which are hidden,
only where those are: lamps that are neighbors make a run, a cell asks one ray for each run, and keeps a
byte. What a lamp adds unoccluded is made again whenever its strength is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ...base import Progress
from ...lights import Emitter, LampTable
from ...numerics import SHADOW_STEP, Array, Stream, fill_chunks, stratified_square
from ...rays import RayCaster, passing_light
from .footprints import CHUNK_POINTS, SpreadPoints
from .light_gains import LightGains, alike

RUNS, MOST_RUNS = 64, 128
"""Runs of lamps, for each ray that few lamps would get, and at most: what a cell keeps, and its rays, do not
grow with the number of lamps."""

BLOCK_PAIRS = 1 << 17
"""Pairs of point and lamp evaluated at a time; bounds the temporaries to about 10 MB a thread."""

SAME_LAMPS = 1 << 14
"""Points in a row that choose from the same lamps of a run."""

ASKED = 8
"""Lamps of a run that a point chooses from, about."""

WHOLE = 255.0
"""What stands for all of a run."""


class RunGains(LightGains):
    """Gains of n points: of many lamps by runs, of other lights as they are put in.

    lamps (m,): By runs.
    numbers (m,) int: Theirs among the lights.
    points, normals (n, 3) float32
    seen (n, r) or (n, r, 3) uint8: How much of each run a point sees, `WHOLE` of all.
    """

    STORED = ("count", "gain_of", "lamps", "numbers", "points", "normals", "seen")

    def __init__(
        self,
        points: Array,
        normals: Array,
        lamps: Sequence[Emitter],
        numbers: Array,
        runs: int,
        channels: tuple[int, ...],
    ) -> None:
        super().__init__(len(points))
        self.lamps, self.numbers = tuple(lamps), numbers
        self.points, self.normals = points.astype(np.float32), normals.astype(np.float32)
        self.seen = np.zeros((len(points), min(len(lamps), runs), *channels), dtype=np.uint8)

    @property
    def nbytes(self) -> int:
        """What they take in memory."""
        return super().nbytes + self.points.nbytes + self.normals.nbytes + self.seen.nbytes

    @property
    def run_of(self) -> Array:
        """(m,) int: which run each lamp is in."""
        return np.asarray(np.arange(len(self.lamps)) * self.seen.shape[1] // max(len(self.lamps), 1))

    def of(self, light: int) -> Array:
        """Return (n,) or (n, 3) float32: the gain of a light; 0 of one that is not here."""
        if light not in self.numbers:
            return super().of(light)
        strengths = np.zeros((max(int(self.numbers.max()), light) + 1, 3))
        strengths[light] = 1.0
        gain = self._of_lamps(strengths).astype(np.float32)
        return gain if self.seen.ndim == 3 else gain[:, 0]

    def take(self, points: Array) -> LightGains:
        """Return those of some points, row numbers or a mask."""
        others = super().take(points)
        return self._like(others, self.points[points], self.normals[points], self.seen[points])

    def replaced(self, rows: Array, other: RunGains) -> RunGains:
        """Return gains of which some rows' are another's: of the same lights."""
        result = self._like(LightGains(self.count), self.points.copy(), self.normals.copy(), self.seen.copy())
        for light in sorted({*self.gain_of, *other.gain_of}):
            gain, found = alike(self.of(light), other.of(light))
            gain[rows] = found
            result.put(light, gain)
        result.points[rows], result.normals[rows] = other.points, other.normals
        result.seen[rows] = other.seen
        return result

    @staticmethod
    def of_parts(parts: Sequence[RunGains], others: LightGains) -> RunGains:
        """Put the points of several one after the other; `others` are their gains of other lights."""
        arrays = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("points", "normals", "seen")
        )
        return parts[0]._like(others, *arrays)

    def _like(self, others: LightGains, points: Array, normals: Array, seen: Array) -> RunGains:
        """Return gains of the same lamps at other points."""
        result = RunGains(points[:0], normals[:0], self.lamps, self.numbers, 0, self.seen.shape[2:])
        result.count, result.gain_of = len(points), others.gain_of
        result.points, result.normals, result.seen = points, normals, seen
        return result

    def irradiance(self, strengths: Array) -> Array:
        """Return (n, 3) float64 what arrives [W/m²] (see `LightGains.irradiance`)."""
        return np.asarray(super().irradiance(strengths) + self._of_lamps(strengths))

    def _of_lamps(self, strengths: Array) -> Array:
        """Return (n, 3) what lamps of (k, 3) strengths add."""
        total = np.zeros((self.count, 3))
        lit = np.flatnonzero(strengths[self.numbers].any(axis=1))
        if len(lit) == 0 or self.count == 0:
            return total
        table = LampTable([self.lamps[row] for row in lit])
        lit = lit[table.order]
        power, run = strengths[self.numbers[lit]] / WHOLE, self.run_of[lit]
        near_points, near_lamps = [], []
        step = max(BLOCK_PAIRS // len(lit), 1)
        for first in range(0, self.count, step):
            rows = slice(first, first + step)
            gain, near = table.afar(
                self.points[rows].astype(np.float64), self.normals[rows].astype(np.float64)
            )
            gain[near] = 0.0
            seen = self.seen[rows][:, run]
            if seen.ndim == 2:
                total[rows] = (gain * seen) @ power
            else:
                total[rows] = np.einsum("nm,nmc,mc->nc", gain, seen, power)
            point, lamp = np.nonzero(near)
            near_points.append(point + first)
            near_lamps.append(lamp)
        point, lamp = np.concatenate(near_points), np.concatenate(near_lamps)
        exact = table.exactly(
            lamp, self.points[point].astype(np.float64), self.normals[point].astype(np.float64)
        )
        seen = self.seen[point, run[lamp]]
        own = (exact[:, None] * (seen if seen.ndim == 2 else seen[:, None])) * power[lamp]
        for channel in range(3):
            total[:, channel] += np.bincount(point, own[:, channel], minlength=self.count)
        return total


def ask_runs(
    gains: RunGains, caster: RayCaster, spread: SpreadPoints, seed: int, threads: int, progress: Progress
) -> None:
    """Find what points see of runs of lamps, by a ray for each run."""
    run_of = gains.run_of
    for run, part in progress.each(list(range(gains.seen.shape[1]))):
        lamps = [gains.lamps[row] for row in np.flatnonzero(run_of == run)]
        parts = -(-len(lamps) // ASKED)
        tables = [LampTable(lamps[first::parts]) for first in range(parts)]
        ask = partial(_seen_of_run, caster, tables, spread, run, seed + SHADOW_STEP * run)
        fill_chunks(ask, gains.seen[:, run], gains.count, CHUNK_POINTS, threads, part)


def _seen_of_run(
    caster: RayCaster, tables: Sequence[LampTable], spread: SpreadPoints, run: int, seed: int, part: slice
) -> Array:
    """Return (r,) or (r, 3) uint8 what points see of lamps, by a ray to one of them, chosen by what it adds.

    tables: The run's lamps, in parts: `SAME_LAMPS` points in a row choose from one of these.
    run: Chooses the point of the footprint that the ray starts from.
    """
    pieces = range(part.start // SAME_LAMPS, -(-part.stop // SAME_LAMPS))
    return np.concatenate([
        _seen_of_lamps(
            caster, tables[piece % len(tables)], spread, run, seed,
            slice(max(piece * SAME_LAMPS, part.start), min((piece + 1) * SAME_LAMPS, part.stop)),
        )
        for piece in pieces
    ])  # fmt: skip


def _seen_of_lamps(
    caster: RayCaster, table: LampTable, spread: SpreadPoints, run: int, seed: int, part: slice
) -> Array:
    """Return the same of points that choose from one table."""
    at = spread.at
    center, normal, keys = at.points[part], at.normals[part], at.keys[part]
    place = stratified_square(keys, 1, seed + Stream.SHADOW_RAYS)[:, 0]
    choice = stratified_square(keys, 1, seed + Stream.SHADOW_STARTS)[:, 0, :1]
    lamp: Array = np.empty(len(center), dtype=np.int64)
    lit = np.empty(len(center), dtype=bool)
    step = max(BLOCK_PAIRS // len(table), 1)
    for first in range(0, len(center), step):
        block = slice(first, first + step)
        sums = np.cumsum(table.afar(center[block], normal[block])[0], axis=1)
        lamp[block] = (sums <= choice[block] * sums[:, -1:]).sum(axis=1)
        lit[block] = sums[:, -1] > 0.0
    rows = np.flatnonzero(lit)
    lamp = np.minimum(lamp[rows], len(table) - 1)
    directions, distances, weights = table.rays(lamp, center[rows], normal[rows], place[rows])
    there = np.flatnonzero(weights > 0.0)
    rows, directions, distances = rows[there], directions[there], distances[there]
    start = spread.points(part)[rows, run % spread.count]
    along = distances[:, None] * directions - (start - center[rows])
    length = np.maximum(np.linalg.norm(along, axis=1), np.finfo(float).tiny)
    start += caster.surface_offset * normal[rows]
    free = passing_light(caster, start, along / length[:, None], length)
    seen = np.zeros((len(center), *free.shape[1:]), dtype=np.uint8)
    seen[rows] = np.rint(WHOLE * free)
    return np.asarray(seen)


def joined_gains(parts: Sequence[LightGains]) -> LightGains:
    """Put the points of several gains one after the other; all are by runs, or none is."""
    others = LightGains.joined(parts)
    runs = [part for part in parts if isinstance(part, RunGains)]
    return RunGains.of_parts(runs, others) if runs else others
