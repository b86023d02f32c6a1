"""Gathering at few texels: level by level, dense near contacts, and interpolated between.

After something moved most points of the bake before stay; others are chosen only among texels that these
may no longer speak for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, TakenRows, marked, row_numbers, run_numbers, tiles
from ...solver.gather import AimedRays, Footprints, GatheredHits, LocalPass, Resolver
from ..points import GatherPoints, Interpolation, fit, refit
from ..texels import Crossings, TexelGeometry
from .gather_links import GatherLinks
from .gather_settings import GatherSettings
from .ray_runs import (
    RUNS,
    Values,
    further_runs,
    over_runs,
    points_of,
    runs_of,
    variance_of,
)
from .traced_texels import GatherPointLayout

CHUNK = 1 << 16
"""Texels whose elements are looked up at once; bounds the temporaries to about 20 MB."""

STARTS = 8
"""Points of a texel's footprint that a run of its gather rays starts from."""

FIT = 0.15
"""The part of gathering that weighs the points."""

Met = Callable[[Array, GatheredHits, int], None]
"""Is given texels that have gathered, what they met, and how many texels they lie apart."""


@dataclass(frozen=True, eq=False)
class KeptPoints:
    """The gather points that stay of an earlier bake.

    before: All of its g runs of rays, and …
    spread: … how its points speak for its texels.
    rows (k,) int: Those that stay, the runs of a point all or none.
    gathered: What these meet now.
    unsure (n,) bool: Texels whose points are weighed again; further points are chosen among them.
    """

    before: GatherPointLayout
    spread: Interpolation
    rows: Array
    gathered: GatheredHits
    unsure: Array

    def of_level(self, level: int) -> tuple[Array, Array, GatheredHits]:
        """Return texel and number of the runs of a level's points, and what they meet."""
        at_level, found = self.before.level[self.rows] == level, self.gathered
        tints = None if found.tints is None else found.tints[at_level]
        kept = GatheredHits(
            found.sources[at_level], found.closeness[at_level], found.aimed.of_points(at_level), tints
        )
        rows = self.rows[at_level]
        return self.before.texel[rows], self.before.run[rows], kept

    def refitted(self, points: GatherPoints, geometry: TexelGeometry) -> Interpolation:
        """Return how `points`, these and further ones, speak for the texels."""
        of_texel = np.full(len(geometry), -1, dtype=np.int32)
        of_texel[points.texel] = np.arange(len(points))
        stays = np.zeros(len(self.before.texel), dtype=bool)
        stays[self.rows] = True
        first, _ = points_of(self.before.run)
        number = np.where(stays[first], of_texel[self.before.texel[first]], -1)
        return refit(points, geometry, self.spread, number, self.unsure)


class _Runs:
    """What the runs of rays of all points meet, in the order of the points.

    rays: Of a run.
    """

    def __init__(self, local: LocalPass, crossings: Crossings, resolve: Resolver, rays: int) -> None:
        self.rays, self.crossings, self._local, self._resolve = rays, crossings, local, resolve
        self._scratch = crossings.geometry.scratch
        self._sources = self._scratch.rows(rays, np.int32)
        self._tints = self._scratch.rows(3 * rays, np.float16) if local.caster.tinted else None
        self._texel, self._run = self._scratch.rows(1, np.int32), self._scratch.rows(1, np.int16)
        self._closeness = self._scratch.rows(1, np.float64)
        self._lists: list[tuple[Array, Array, Array]] = []
        self._aimed: list[AimedRays] = []
        self._first: list[int] = []

    def more(self, count: int) -> tuple[Array, Array | None]:
        """Return where sources (count, rays) and tints (count, rays, 3) of further runs are to be put."""
        self._first.append(len(self._sources))
        tints = None if self._tints is None else self._tints.more(count).reshape(count, self.rays, 3)
        return self._sources.more(count), tints

    def add(self, texel: Array, run: Array, gathered: GatheredHits) -> None:
        """Add what the runs just asked for met: run numbers (r,) at texels (r,), the runs of each in turn."""
        self._lists.append((texel, run, gathered.closeness))
        self._aimed.append(gathered.aimed)

    def gather(
        self, texels: Array, many: Array, progress: Progress, before: Array | None = None
    ) -> Iterator[tuple[Array, Array, GatheredHits]]:
        """Let texels (c,) gather by `many` (c,) runs after those `before` (c,); add and yield what they met.

        Yields the texel and number of each run, and what it met.
        """
        # Across a rim light changes by more than noise: there every ray starts from a point of its own.
        edge = self.crossings.crossed[texels]
        done = 0.0
        for batch, starts in ((~edge, STARTS), (edge, None)):
            texel = np.repeat(texels[batch], many[batch])
            run = run_numbers(many[batch], 0 if before is None else before[batch])
            part, done = done, done + len(texel) / max(int(many.sum()), 1)
            into, of_batch = self.more(len(texel)), progress.part(part, done)
            at = self.crossings.geometry, texel, starts, self.rays, self._resolve
            gathered = gather_at(self._local, *at, into, of_batch, run)
            self.add(texel, run, gathered)
            yield texel, run, gathered

    def points(self) -> tuple[Array, Array]:
        """Return the texels of the points added since the last call, and how close things are to them."""
        texel, run, closeness = (np.concatenate(part) for part in zip(*self._lists, strict=True))
        self._take_up()
        start, count = points_of(run)
        if not len(start):
            return texel, closeness
        return texel[start], np.add.reduceat(closeness, start) / count

    def _take_up(self) -> None:
        """Put what was added where it stays."""
        lists, self._lists = self._lists, []
        for texel, run, closeness in lists:
            for column, values in ((self._texel, texel), (self._run, run), (self._closeness, closeness)):
                for rows in tiles(len(values)):
                    column.extend(values[rows])

    def all(
        self, spread: Interpolation, level: Array, farthest: Array
    ) -> tuple[GatherLinks, GatherPointLayout]:
        """Return the links of all runs, given how the points speak for the texels, and their (p,) levels.

        Points are in the order in which the first of their runs were added.
        """
        self._take_up()
        texel, run, closeness = (each.all()[:, 0] for each in (self._texel, self._run, self._closeness))
        aimed = AimedRays.joined(self._aimed, self._first, self._scratch)
        sources, tints = self._sources.all(), None if self._tints is None else self._tints.all()
        if not _one_after_the_other(texel, run):
            # Runs were added to points that had some.
            first, _ = points_of(run)
            point = np.empty(int(texel.max()) + 1, dtype=np.int64)
            point[texel[first]] = np.arange(len(first))
            order = np.lexsort((run, point[texel]))
            place = np.empty(len(order), dtype=np.int64)
            place[order] = np.arange(len(order))
            aimed = replace(aimed, row=place[aimed.row])
            sources = self._in_order(sources, order)
            tints = None if tints is None else self._in_order(tints, order)
            texel, run, closeness = texel[order], run[order], closeness[order]
        layout = GatherPointLayout(texel, over_runs(level, run), run, closeness, farthest)
        tints = None if tints is None else tints.reshape(len(run), self.rays, 3)
        return GatherLinks(sources, spread, aimed, tints, layout.run), layout

    def _in_order(self, values: Array, order: Array) -> Array:
        result = self._scratch.empty(values.shape, values.dtype)
        for rows in tiles(len(order), CHUNK):
            result[rows] = values[order[rows]]
        return result


def _one_after_the_other(texel: Array, run: Array) -> bool:
    """Return whether all runs of each point are next to each other, in order."""
    for rows in tiles(len(run)):
        before, here = slice(max(rows.start - 1, 0), rows.stop - 1), slice(max(rows.start, 1), rows.stop)
        follows = (texel[here] == texel[before]) & (run[here] == run[before] + 1)
        if not (follows | (run[here] == 0)).all():
            return False
    return True


def gather_texels(
    local: LocalPass,
    crossings: Crossings,
    settings: GatherSettings,
    resolve: Resolver,
    values: Values | None = None,
    kept: KeptPoints | None = None,
    met: Met | None = None,
    progress: Progress = SILENT,
) -> tuple[GatherLinks, GatherPointLayout]:
    """Gather at few texels, densely where others do not reach; `kept` points do not gather again.

    values: What sources send, as far as that is known: more rays go where it varies. None sends as many
        everywhere.
    """
    geometry = crossings.geometry
    points = GatherPoints(geometry, local.caster, crossings.alone, local.threads)
    mean = float(RUNS)
    if kept is not None:
        points.farthest = np.where(kept.unsure, np.inf, kept.before.farthest)
        mean = kept.before.runs(settings.times_rays)
    runs = _Runs(local, crossings, resolve, max(settings.rays // RUNS, 1))
    _gather_levels(points, runs, settings, mean, values, kept, met, progress.part(0.0, 1.0 - FIT))
    if kept is None:
        spread = fit(points, geometry, progress.part(1.0 - FIT, 1.0))
    else:
        spread = kept.refitted(points, geometry)
    level_of_point, farthest = points.level, points.farthest
    del points  # its pairs take as much as those of `spread`
    return runs.all(spread, level_of_point, farthest)


def _gather_levels(
    points: GatherPoints,
    runs: _Runs,
    settings: GatherSettings,
    mean: float,
    values: Values | None,
    kept: KeptPoints | None,
    met: Met | None,
    progress: Progress,
) -> None:
    """Choose points level by level and let them gather, with `mean` runs each on the finest lattice."""
    crossings, variance = runs.crossings, np.zeros(0)
    for level, (stride, of_level) in enumerate(progress.each(settings.strides)):
        found = []
        if kept is not None:
            texel, run, stays = kept.of_level(level)
            sources, tints = runs.more(len(texel))
            sources[:] = stays.sources
            if tints is not None and stays.tints is not None:
                tints[:] = stays.tints
            runs.add(texel, run, stays)
            found.append((run, stays.sources, stays.tints))
        chosen = _choose(points, crossings, kept, stride, settings.support, of_level.part(0.0, 0.15))
        many = runs_of(points, variance, chosen, mean * settings.times_rays[level], of_level.part(0.15, 0.2))
        for texel, run, gathered in runs.gather(chosen, many, of_level.part(0.2, 1.0)):
            if met is not None:
                met(texel, gathered, stride)
            found.append((run, gathered.sources, gathered.tints))
        if values is not None and level + 1 < len(settings.strides):
            of_runs = np.concatenate([variance_of(sources, tints, values) for _, sources, tints in found])
            start, count = points_of(np.concatenate([run for run, _, _ in found]))
            if len(start):
                variance = np.append(variance, np.add.reduceat(of_runs, start) / count)
        points.add(stride, *runs.points())
        crossings.geometry.scratch.give_back()


def gather_more(
    local: LocalPass,
    crossings: Crossings,
    resolve: Resolver,
    links: GatherLinks,
    layout: GatherPointLayout,
    factor: float,
    progress: Progress = SILENT,
) -> tuple[GatherLinks, GatherPointLayout]:
    """Let the points of links, whose sources are numbers, gather with `factor` times as many rays."""
    runs = _Runs(local, crossings, resolve, links.sources.shape[1])
    sources, tints = runs.more(len(links.sources))
    sources[:] = links.sources
    if tints is not None and links.tints is not None:
        tints[:] = links.tints
    runs.add(layout.texel, layout.run, GatheredHits(sources, layout.closeness, links.aimed, tints))
    first, count = points_of(layout.run)
    texel = layout.texel[first]
    more = further_runs(count, texel, factor)
    for _ in runs.gather(texel, more, progress, count):
        pass
    return runs.all(links.spread, layout.level[first], layout.farthest)


def gather_at(
    local: LocalPass,
    geometry: TexelGeometry,
    chosen: Array,
    starts: int | None,
    rays: int,
    resolve: Resolver,
    into: tuple[Array, Array | None] | None = None,
    progress: Progress = SILENT,
    run: Array | None = None,
) -> GatheredHits:
    """Gather at some texels, by one `run` (c,) of their rays. `into` takes sources and tints, if given."""
    at = gather_footprints(geometry, chosen, starts, run)
    expected = geometry.scratch.empty(len(chosen))
    for tile in tiles(len(chosen), CHUNK):
        texels = chosen[tile]
        expected[tile] = local.elements.irradiance_at(geometry.triangle[texels], geometry.barycentric[texels])
    upright = TakenRows(geometry.surface_normal, chosen)
    return local.gather.at(at, upright, rays, resolve, expected, into, progress)


def gather_footprints(
    geometry: TexelGeometry, chosen: Array, starts: int | None, run: Array | None = None
) -> Footprints:
    """Return where texels gather, each from `starts` points, by one run (c,) of their rays."""
    position, normal = TakenRows(geometry.position, chosen), TakenRows(geometry.normal, chosen)
    sampler = partial(sample_of, geometry, chosen)
    return Footprints(position, normal, chosen, sampler, starts=starts, runs=run, scratch=geometry.scratch)


def sample_of(geometry: TexelGeometry, chosen: Array, rows: Array, u: Array) -> Array:
    """Spread points over the footprints of some of the chosen texels."""
    return geometry.sample(chosen[rows], u)


def _choose(
    points: GatherPoints,
    crossings: Crossings,
    kept: KeptPoints | None,
    stride: int,
    support: float,
    progress: Progress,
) -> Array:
    """Find the texels on a lattice that no point so far reaches, among the unsure ones if some points stay.

    Texels next to a crossed one are chosen as well: points in the open do not know how close it is to them.
    """
    candidates = _on_lattice(crossings.geometry, stride)
    if kept is not None:
        candidates &= kept.unsure
        candidates[kept.before.texel[kept.rows]] = False
    if len(points):
        candidates[points.texel] = False
    candidates = row_numbers(candidates)
    if len(points):
        reached = points.support(candidates, support, progress)
        candidates = candidates[(reached < support) | crossings.next_to_crossed[candidates]]
    return candidates


def _on_lattice(geometry: TexelGeometry, stride: int) -> Array:
    """Return (n,) bool: the texels in every `stride`-th row and column of their page."""
    row, column = geometry.row, geometry.column
    return marked(len(geometry), lambda tile: (row[tile] % stride == 0) & (column[tile] % stride == 0))
