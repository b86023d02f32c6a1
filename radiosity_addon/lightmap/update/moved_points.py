"""Gather points where something moved: most stay with what their rays met, a few are chosen anew.

A point whose surroundings something has come close to no longer speaks for as many texels. So what
speaks for a texel is weighed again where points have been lost or see things much closer, and where the
line of sight to a point may have opened or closed; there further points are chosen as in a bake.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base import Progress
from ...numerics import Array, row_numbers, run_numbers, run_starts
from ...rays import SAGITTA, SIGHT_LIFT
from ...solver.gather import AimedRays, Before, Gathered, LocalPass, Resolver
from ..lighting import (
    STARTS,
    GatherLinks,
    GatherPointLayout,
    GatherSettings,
    gather_at,
    gather_footprints,
    on_lattice,
)
from ..points import GatherPoints, Interpolation, refit
from ..texels import Crossings
from .affected import AffectedTexels

CLOSER = 1.05
"""Points that see things closer by more than this factor speak for fewer texels than before."""

CELLS_ACROSS = 3.0
"""A gather point that speaks for a texel is no more of its lattice's cells away."""

Entries = tuple[Array, Array, Array]
"""Of texels one after the other: how many each has, and all their points and weights."""


class MovedPoints:
    """The gather points of a scene in which something moved.

    Parameters
    ----------
    local, before : LocalPass
        Of the scene as it is, and was.
    affected : AffectedTexels
    settings : GatherSettings
    crossings : Crossings
    divided : (n,) bool
        See `AffectedTexels.divided`.
    resolve : callable
    bright : (e,) bool
        Elements that rays are or were aimed at.
    """

    def __init__(
        self,
        local: LocalPass,
        before: LocalPass,
        affected: AffectedTexels,
        settings: GatherSettings,
        crossings: Crossings,
        divided: Array,
        resolve: Resolver,
        bright: Array,
    ) -> None:
        self._local, self._before, self._affected = local, before, affected
        self._moved = affected.traced(before.caster)
        self._settings, self._crossings, self._resolve = settings, crossings, resolve
        self._divided, self._bright = divided, bright
        self._geometry = affected.geometry

    def gather(
        self, links: GatherLinks, points: GatherPointLayout, progress: Progress
    ) -> tuple[GatherLinks, GatherPoints]:
        """Gather where it is needed.

        Parameters
        ----------
        links : GatherLinks
            Of before, sources numbered as they are now, or UNNUMBERED.
        points : GatherPointLayout
            Of before.
        """
        stays = ~(self._affected.texels | self._divided)[points.texel]
        rows = np.flatnonzero(stays)
        kept = self._again(links, points, rows, progress.part(0.0, 0.5))
        closer = ~stays
        closer[rows] = kept.closeness > CLOSER * points.closeness[rows]
        doubted = self._doubted(links.spread, points, closer)
        found, new, number = self._choose(points, rows, kept, doubted, progress.part(0.5, 0.9))
        spread = _merged(links.spread, number, doubted, refit(new, self._geometry, np.flatnonzero(doubted)))
        progress.at(1.0)
        return GatherLinks(found.sources, spread, found.aimed), new

    def _again(
        self, links: GatherLinks, points: GatherPointLayout, rows: Array, progress: Progress
    ) -> Gathered:
        """Trace again what is touched of the rays of some points."""
        sources, closeness = links.sources[rows], points.closeness[rows].copy()
        aimed: list[AimedRays] = []
        # Across a rim every ray starts from a point of its own.
        edge = self._crossings.crossed[points.texel[rows]]
        place = np.full(len(points.texel), -1)
        for (mine, starts), part in progress.each(((~edge, STARTS), (edge, None))):
            some = rows[mine]
            chosen = np.zeros(len(points.texel), dtype=bool)
            chosen[some] = True
            place[some] = np.arange(len(some))
            before = Gathered(sources[mine], closeness[mine], links.aimed.of_points(chosen))
            found = self._regather(before, points.texel[some], starts, part)
            sources[mine], closeness[mine] = found.sources, found.closeness
            aimed.append(replace(found.aimed, row=np.flatnonzero(mine)[found.aimed.row]))
        return Gathered(sources, closeness, AimedRays.joined(aimed, [0, 0]))

    def _regather(self, before: Gathered, texel: Array, starts: int | None, progress: Progress) -> Gathered:
        geometry, local = self._geometry, self._local
        corners = self._before.elements.hierarchy.corners[before.aimed.element]
        low, high = corners.min(axis=2), corners.max(axis=2)
        aimed_at = 0.5 * (low + high), 0.5 * (high - low)
        hierarchy = local.elements.hierarchy
        hosts = np.zeros(len(geometry.triangles), dtype=bool)
        hosts[hierarchy.faces.triangle[hierarchy.face[self._bright]]] = True
        widen = self._affected.widen[texel]
        earlier = Before(before, aimed_at, self._moved, widen, self._bright, hosts)
        expected = local.elements.irradiance_at(geometry.triangle[texel], geometry.barycentric[texel])
        at = gather_footprints(geometry, texel, starts)
        upright = geometry.surface_normal[texel]
        return local.gather.again_at(at, upright, self._resolve, earlier, expected, progress)

    def _doubted(self, spread: Interpolation, points: GatherPointLayout, closer: Array) -> Array:
        """Return (n,) bool: the texels whose points are to be weighed again."""
        geometry, moved = self._geometry, self._affected
        doubted = moved.texels | geometry.neighborhood(self._divided) | spread.any_of(closer)
        # A texel's points are in cells beside its own, no wider than the coarsest lattice.
        farthest = CELLS_ACROSS * max(*self._settings.strides, 1.5) * geometry.texel_size
        some = np.flatnonzero(moved.boxes.near(geometry.position, np.full(len(geometry), farthest)))
        ends = np.append(spread.first, len(spread.point))
        count = ends[some + 1] - ends[some]
        texel, point = np.repeat(some, count), points.texel[spread.point[run_numbers(count, ends[some])]]
        start, normal = geometry.position[texel], geometry.normal[texel]
        along = geometry.position[point] - start
        bend = np.sqrt(np.maximum(1.0 - np.einsum("pk,pk->p", normal, geometry.normal[point]), 0.0))
        rise = SIGHT_LIFT * self._local.caster.surface_offset + SAGITTA * np.linalg.norm(along, axis=1) * bend
        crosses = moved.boxes.met_by(start, along[:, None], rise, 1.0)[:, 0]
        if len(some):
            doubted[some] |= np.logical_or.reduceat(crosses, run_starts(count))
        return np.asarray(doubted)

    def _choose(
        self,
        points: GatherPointLayout,
        rows: Array,
        kept: Gathered,
        doubted: Array,
        progress: Progress,
    ) -> tuple[Gathered, GatherPoints, Array]:
        """Add points among the doubted texels, level by level.

        Returns
        -------
        gathered : Gathered
        points : GatherPoints
        number : (g,) int32
            The new number of each old point, or −1.
        """
        geometry, local, settings = self._geometry, self._local, self._settings
        new = GatherPoints(geometry, local.caster, self._crossings.alone, local.threads)
        new.farthest = np.where(doubted, np.inf, points.farthest)
        taken = np.zeros(len(geometry), dtype=bool)
        taken[points.texel[rows]] = True
        number = np.full(len(points.texel), -1, dtype=np.int32)
        blocks: list[Gathered] = []
        first: list[int] = []
        total = 0
        for (level, stride), of_level in progress.each(list(enumerate(settings.strides))):
            mine = points.level[rows] == level
            chosen = self._lacking(new, doubted & ~taken, stride, of_level.part(0.0, 0.2))
            taken[chosen] = True
            number[rows[mine]] = total + np.arange(int(mine.sum()))
            part = Gathered(kept.sources[mine], kept.closeness[mine], kept.aimed.of_points(mine))
            texel, level_blocks = [points.texel[rows[mine]]], [part]
            edge = self._crossings.crossed[chosen]
            kinds = (chosen[~edge], STARTS), (chosen[edge], None)
            for (some, starts), of_kind in of_level.part(0.2, 1.0).each(kinds):
                texel.append(some)
                level_blocks.append(
                    gather_at(local, geometry, some, starts, settings.rays, self._resolve, progress=of_kind)
                )
            for block in level_blocks:
                first.append(total)
                total += len(block.sources)
            blocks += level_blocks
            closeness = np.concatenate([block.closeness for block in level_blocks])
            new.add(stride, np.concatenate(texel), closeness)
        aimed = AimedRays.joined([block.aimed for block in blocks], first)
        sources = np.concatenate([block.sources for block in blocks])
        return Gathered(sources, new.closeness, aimed), new, number

    def _lacking(self, points: GatherPoints, among: Array, stride: int, progress: Progress) -> Array:
        """Find the texels of some, (n,) bool, on a lattice, that no point so far reaches."""
        candidates = row_numbers(on_lattice(self._geometry, stride) & among)
        if len(points):
            reached = points.support(candidates, progress)
            lacks = (reached < self._settings.support) | self._crossings.beside[candidates]
            candidates = candidates[lacks]
        return np.asarray(candidates)


def _merged(before: Interpolation, number: Array, anew: Array, entries: Entries) -> Interpolation:
    """Put new weights of some texels, (n,) bool, in place of the old ones, and number points anew."""
    old_count = np.diff(np.append(before.first, len(before.point)))
    count = old_count.copy()
    new_count, new_point, new_weight = entries
    count[anew] = new_count
    first = run_starts(count)
    point = np.empty(int(count.sum()), dtype=np.int32)
    weight = np.empty(len(point), dtype=np.float32)
    for some, counts, points, weights in (
        (~anew, old_count[~anew], *_entries_of(before, ~anew, old_count, number)),
        (anew, new_count, new_point, new_weight),
    ):
        place = run_numbers(counts, first[some])
        point[place], weight[place] = points, weights
    return Interpolation(first, point, weight)


def _entries_of(before: Interpolation, chosen: Array, count: Array, number: Array) -> tuple[Array, Array]:
    """Return the points, numbered anew, and weights of some texels, (n,) bool."""
    mine = np.repeat(chosen, count)
    return number[before.point[mine]], before.weight[mine]
