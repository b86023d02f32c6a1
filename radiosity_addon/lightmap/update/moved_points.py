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
from ...solver.gather import AimedRays, Before, GatheredHits
from ..points import Interpolation
from ..transport import STARTS, GatherLinks, KeptPoints, gather_footprints
from .previous import StandingHits

CLOSER = 1.05
"""Points that see things closer by more than this factor speak for fewer texels than before."""

CELLS_ACROSS = 3.0
"""A gather point that speaks for a texel is no more of its lattice's cells away."""


def kept_points(standing: StandingHits, progress: Progress) -> KeptPoints:
    """Return the gather points that stay, with what their rays meet now."""
    previous = standing.previous
    points, links = previous.traced.points, standing.renumbered_links()
    stays = ~(previous.affected.texels | standing.divided)[points.texel]
    rows = np.flatnonzero(stays)
    gathered = _traced_again(standing, links, rows, progress)
    closer = ~stays
    closer[rows] = gathered.closeness > CLOSER * points.closeness[rows]
    unsure = _unsure(standing, links.spread, links.any_of_runs(closer))
    return KeptPoints(points, links.spread, rows, gathered, unsure)


def _traced_again(
    standing: StandingHits, links: GatherLinks, rows: Array, progress: Progress
) -> GatheredHits:
    """Trace again what is touched of the rays of some points."""
    points = standing.previous.traced.points
    sources, closeness = links.sources[rows], points.closeness[rows].copy()
    tints = None if links.tints is None else links.tints[rows]
    aimed: list[AimedRays] = []
    # Across a rim every ray starts from a point of its own.
    edge = standing.table.crossings.crossed[points.texel[rows]]
    for (group, starts), part in progress.each(((~edge, STARTS), (edge, None))):
        chosen = np.zeros(len(points.texel), dtype=bool)
        chosen[rows[group]] = True
        of_group = None if tints is None else tints[group]
        before = GatheredHits(sources[group], closeness[group], links.aimed.of_points(chosen), of_group)
        found = _gathered_again(standing, before, rows[group], starts, part)
        sources[group], closeness[group] = found.sources, found.closeness
        if tints is not None:
            tints[group] = found.tints
        aimed.append(replace(found.aimed, row=np.flatnonzero(group)[found.aimed.row]))
    return GatheredHits(sources, closeness, AimedRays.joined(aimed, [0, 0]), tints)


def _gathered_again(
    standing: StandingHits, before: GatheredHits, rows: Array, starts: int | None, progress: Progress
) -> GatheredHits:
    previous, table = standing.previous, standing.table
    texel, run = previous.traced.points.texel[rows], previous.traced.points.run[rows]
    geometry, local = table.geometry, table.local
    corners = previous.local.elements.hierarchy.corners[before.aimed.element]
    low, high = corners.min(axis=2), corners.max(axis=2)
    hierarchy = local.elements.hierarchy
    hosts = np.zeros(len(geometry.triangles), dtype=bool)
    hosts[hierarchy.faces.triangle[hierarchy.face[standing.bright]]] = True
    earlier = Before(
        before,
        aimed_at=(0.5 * (low + high), 0.5 * (high - low)),
        moved=previous.affected.traced(previous.local.caster),
        widen=previous.affected.widen[texel],
        bright=standing.bright,
        hosts=hosts,
    )
    expected = local.elements.irradiance_at(geometry.triangle[texel], geometry.barycentric[texel])
    at = gather_footprints(geometry, texel, starts, run.astype(np.int64))
    return local.gather.again_at(
        at, geometry.surface_normal[texel], table.number, earlier, expected, progress
    )


def _unsure(standing: StandingHits, spread: Interpolation, closer: Array) -> Array:
    """Return (n,) bool: texels whose points are weighed again: those with `closer` (n,) or hidden ones."""
    traced, moved, geometry = standing.previous.traced, standing.previous.affected, standing.table.geometry
    unsure = moved.texels | geometry.neighborhood(standing.divided) | closer
    # A texel's points are in cells next to its own, no wider than the coarsest lattice.
    farthest = CELLS_ACROSS * max(*traced.settings.strides, 1.5) * geometry.texel_size * 2.0**geometry.scale
    near = np.flatnonzero(moved.boxes.near(geometry.position, farthest[geometry.triangle]))
    ends = np.append(spread.first, len(spread.point))
    count = ends[near + 1] - ends[near]
    texel = np.repeat(near, count)
    of_point = traced.points.texel[traced.points.run == 0]
    point = of_point[spread.point[run_numbers(count, ends[near])]]
    start, normal = geometry.position[texel], geometry.normal[texel]
    along = geometry.position[point] - start
    bend = np.sqrt(np.maximum(1.0 - np.einsum("pk,pk->p", normal, geometry.normal[point]), 0.0))
    lift = SIGHT_LIFT * standing.table.local.caster.surface_offset
    rise = lift + SAGITTA * np.linalg.norm(along, axis=1) * bend
    crosses = moved.boxes.met_by(start, along[:, None], rise, 1.0)[:, 0]
    if len(near):
        unsure[near] |= np.logical_or.reduceat(crosses, run_starts(count))
    return np.asarray(unsure)
