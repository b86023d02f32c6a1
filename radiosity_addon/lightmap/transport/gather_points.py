"""Gathering at few texels: level by level, dense near contacts, and interpolated between.

After something moved most points of the bake before stay; others are chosen only among texels that these
may no longer speak for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, marked, row_numbers, tiles
from ...solver.gather import AimedRays, Footprints, GatheredHits, LocalPass, Resolver
from ..points import GatherPoints, Interpolation, fit, refit
from ..texels import Crossings, TexelGeometry
from .gather_links import GatherLinks
from .gather_settings import GatherSettings
from .traced_texels import GatherPointLayout

CHUNK = 1 << 16
"""Texels whose elements are looked up at once; bounds the temporaries to about 20 MB."""

STARTS = 16
"""Points of a texel's footprint that its gather rays start from."""

FIT = 0.15
"""The part of gathering that weighs the points."""

Met = Callable[[Array, GatheredHits, int], None]
"""Is given texels that have gathered, what they met, and how many texels they lie apart."""


@dataclass(frozen=True, eq=False)
class KeptPoints:
    """The gather points that stay of an earlier bake.

    before: All of its g points, and …
    spread: … how they speak for its texels.
    rows (k,) int: Those that stay.
    gathered: What these meet now.
    unsure (n,) bool: Texels whose points are weighed again; further points are chosen among them.
    """

    before: GatherPointLayout
    spread: Interpolation
    rows: Array
    gathered: GatheredHits
    unsure: Array

    def of_level(self, level: int) -> tuple[Array, GatheredHits]:
        """Return the texels of a level's points, and what they meet."""
        at_level, found = self.before.level[self.rows] == level, self.gathered
        kept = GatheredHits(
            found.sources[at_level], found.closeness[at_level], found.aimed.of_points(at_level)
        )
        return self.before.texel[self.rows[at_level]], kept

    def refitted(self, points: GatherPoints, geometry: TexelGeometry) -> Interpolation:
        """Return how `points`, these and further ones, speak for the texels."""
        of_texel = np.full(len(geometry), -1, dtype=np.int32)
        of_texel[points.texel] = np.arange(len(points))
        number = np.full(len(self.before.texel), -1, dtype=np.int32)
        number[self.rows] = of_texel[self.before.texel[self.rows]]
        return refit(points, geometry, self.spread, number, self.unsure)


def gather_texels(
    local: LocalPass,
    crossings: Crossings,
    settings: GatherSettings,
    resolve: Resolver,
    kept: KeptPoints | None = None,
    met: Met | None = None,
    progress: Progress = SILENT,
) -> tuple[GatherLinks, GatherPoints]:
    """Gather at few texels, densely where others do not reach; `kept` points do not gather again."""
    geometry = crossings.geometry
    points = GatherPoints(geometry, local.caster, crossings.alone, local.threads)
    if kept is not None:
        points.farthest = np.where(kept.unsure, np.inf, kept.before.farthest)
    aimed: list[AimedRays] = []
    first: list[int] = []
    sources = geometry.scratch.rows(settings.rays, np.int32)
    for level, (stride, of_level) in enumerate(progress.part(0.0, 1.0 - FIT).each(settings.strides)):
        texels, closeness = [], []
        if kept is not None:
            texel, stays = kept.of_level(level)
            first.append(len(sources))
            sources.more(len(texel))[:] = stays.sources
            texels.append(texel)
            closeness.append(stays.closeness)
            aimed.append(stays.aimed)
        chosen = _choose(points, crossings, kept, stride, settings.support, of_level.part(0.0, 0.2))
        # Across a rim light changes by more than noise: there every ray starts from a point of its own.
        edge = crossings.crossed[chosen]
        done = 0.2
        for batch, starts in ((chosen[~edge], STARTS), (chosen[edge], None)):
            before, done = done, done + 0.8 * len(batch) / max(len(chosen), 1)
            part = of_level.part(before, done)
            first.append(len(sources))
            into = sources.more(len(batch))
            gathered = gather_at(local, geometry, batch, starts, settings.rays, resolve, into, part)
            if met is not None:
                met(batch, gathered, stride)
            texels.append(batch)
            closeness.append(gathered.closeness)
            aimed.append(gathered.aimed)
        points.add(stride, np.concatenate(texels), np.concatenate(closeness))
    if kept is None:
        spread = fit(points, geometry, progress.part(1.0 - FIT, 1.0))
    else:
        spread = kept.refitted(points, geometry)
    return GatherLinks(sources.all(), spread, AimedRays.joined(aimed, first, geometry.scratch)), points


def gather_at(
    local: LocalPass,
    geometry: TexelGeometry,
    chosen: Array,
    starts: int | None,
    rays: int,
    resolve: Resolver,
    into: Array | None = None,
    progress: Progress = SILENT,
) -> GatheredHits:
    """Gather at some texels. `into` (c, rays) int32 takes the sources, if given."""
    at = gather_footprints(geometry, chosen, starts)
    expected, upright = (geometry.scratch.empty((len(chosen), *shape)) for shape in ((), (3,)))
    for tile in tiles(len(chosen), CHUNK):
        texels = chosen[tile]
        expected[tile] = local.elements.irradiance_at(geometry.triangle[texels], geometry.barycentric[texels])
        upright[tile] = geometry.surface_normal[texels]
    return local.gather.at(at, upright, rays, resolve, expected, into, progress)


def gather_footprints(geometry: TexelGeometry, chosen: Array, starts: int | None) -> Footprints:
    """Return where texels gather, each from `starts` points."""
    position, normal = (geometry.scratch.empty((len(chosen), 3)) for _ in range(2))
    for tile in tiles(len(chosen)):
        position[tile], normal[tile] = geometry.position[chosen[tile]], geometry.normal[chosen[tile]]
    sampler = partial(sample_of, geometry, chosen)
    return Footprints(position, normal, chosen, sampler, starts=starts, scratch=geometry.scratch)


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
        reached = points.support(candidates, progress)
        candidates = candidates[(reached < support) | crossings.next_to_crossed[candidates]]
    return candidates


def _on_lattice(geometry: TexelGeometry, stride: int) -> Array:
    """Return (n,) bool: the texels in every `stride`-th row and column of their page."""
    row, column = geometry.row, geometry.column
    return marked(len(geometry), lambda tile: (row[tile] % stride == 0) & (column[tile] % stride == 0))
