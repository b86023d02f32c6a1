"""Gather points where something moved: most stay with what their rays met.

A point whose surroundings something has come close to no longer speaks for as many texels. So what
speaks for a texel is weighed again where points have been lost or see things much closer, and where the
line of sight to a point may have opened or closed; there further points are chosen as in a bake.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base import Progress
from ...numerics import Array, run_numbers, run_starts
from ...rays import SAGITTA, SIGHT_LIFT
from ...solver.gather import AimedRays, Before, Gathered, LocalPass
from ..points import Interpolation
from ..transport import (
    STARTS,
    GatherLinks,
    GatherPointLayout,
    GatherSettings,
    HitTable,
    KeptPoints,
    gather_footprints,
)
from .affected import AffectedTexels

CLOSER = 1.05
"""Points that see things closer by more than this factor speak for fewer texels than before."""

CELLS_ACROSS = 3.0
"""A gather point that speaks for a texel is no more of its lattice's cells away."""


class MovedPoints:
    """The gather points of a scene in which something moved.

    Parameters
    ----------
    table : HitTable
        Of the scene as it is.
    before : LocalPass
        Of the scene as it was.
    affected : AffectedTexels
    settings : GatherSettings
    divided : (n,) bool
        See `AffectedTexels.divided`.
    bright : (e,) bool
        Elements that rays are or were aimed at.
    """

    def __init__(
        self,
        table: HitTable,
        before: LocalPass,
        affected: AffectedTexels,
        settings: GatherSettings,
        divided: Array,
        bright: Array,
    ) -> None:
        self._table, self._local, self._geometry = table, table.local, table.geometry
        self._before, self._affected = before, affected
        self._moved = affected.traced(before.caster)
        self._settings, self._divided, self._bright = settings, divided, bright

    def kept(self, links: GatherLinks, points: GatherPointLayout, progress: Progress) -> KeptPoints:
        """Return the points that stay, with what their rays meet now.

        Parameters
        ----------
        links : GatherLinks
            Of before, sources numbered as they are now, or UNNUMBERED.
        points : GatherPointLayout
            Of before.
        """
        stays = ~(self._affected.texels | self._divided)[points.texel]
        rows = np.flatnonzero(stays)
        gathered = self._again(links, points, rows, progress)
        closer = ~stays
        closer[rows] = gathered.closeness > CLOSER * points.closeness[rows]
        return KeptPoints(
            points.texel[rows],
            points.level[rows],
            gathered,
            unsure=self._unsure(links.spread, points, closer),
            farthest=points.farthest,
            spread=links.spread,
            old=np.where(stays, points.texel, -1),
        )

    def _again(
        self, links: GatherLinks, points: GatherPointLayout, rows: Array, progress: Progress
    ) -> Gathered:
        """Trace again what is touched of the rays of some points."""
        sources, closeness = links.sources[rows], points.closeness[rows].copy()
        aimed: list[AimedRays] = []
        # Across a rim every ray starts from a point of its own.
        edge = self._table.crossings.crossed[points.texel[rows]]
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
        return local.gather.again_at(at, upright, self._table.number, earlier, expected, progress)

    def _unsure(self, spread: Interpolation, points: GatherPointLayout, closer: Array) -> Array:
        """Return (n,) bool: the texels whose points are to be weighed again."""
        geometry, moved = self._geometry, self._affected
        unsure = moved.texels | geometry.neighborhood(self._divided) | spread.any_of(closer)
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
            unsure[some] |= np.logical_or.reduceat(crosses, run_starts(count))
        return np.asarray(unsure)
