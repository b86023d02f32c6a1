"""Gather rays that something which moved may have stopped, or stops now, traced again; all others stay.

Rays depend on their point's key, their number and the seed alone, so any of them can be made again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, map_chunks
from ...rays import RayCaster
from .boxes import Boxes
from .bright_patches import AimedRays, BrightElements
from .final_gather import CHUNK_RAYS, FinalGather, GatheredHits
from .hit_numbers import UNNUMBERED

RENEWED = 0.3
"""A point whose closeness falls by more than this part is gathered again: what single rays take off
a sum that a few very short ones dominate may leave anything, even less than nothing."""


@dataclass(frozen=True)
class MovedGeometry:
    """What moved, where it was and where it is.

    Attributes
    ----------
    boxes : Boxes
        Around it.
    alone : RayCaster
        Of it alone, at both places.
    before : RayCaster
        Of the scene as it was.
    """

    boxes: Boxes
    alone: RayCaster
    before: RayCaster


@dataclass(frozen=True)
class Before:
    """What the rays of g points met before something moved.

    Attributes
    ----------
    gathered : GatheredHits
        Sources numbered as they are now, or UNNUMBERED.
    aimed_at : (a, k, 3) float64 twice
        Of its aimed rays: the middles of the boxes around the elements aimed at, and half their sizes.
    moved : MovedGeometry
    widen : (g,) float64 [m]
        How far from a point its rays start.
    bright, hosts : (e,) bool, (t,) bool
        Elements that are or were bright enough to aim at, and triangles that have some.
    """

    gathered: GatheredHits
    aimed_at: tuple[Array, Array]
    moved: MovedGeometry
    widen: Array
    bright: Array
    hosts: Array


def retrace(
    gathering: FinalGather,
    before: Before,
    bright: BrightElements | None,
    irradiance: Array,
    progress: Progress = SILENT,
) -> GatheredHits:
    """Trace again what the boxes touch. Parameters as of `FinalGather.trace`.

    Which bright elements a point aims at decides what its other rays leave out. So where an aimed ray is
    touched, or another one meets a bright element now, the point is gathered again as a whole.

    gathering: Of the same points, rays and seed as before.
    """
    sources, closeness = before.gathered.sources.copy(), before.gathered.closeness.copy()
    count, rays = sources.shape
    aimed = before.gathered.aimed
    whole, aims = np.zeros((2, count), dtype=bool)
    aims[aimed.row] = True
    aims_past = _aims_past_boxes(gathering, before)
    again = partial(_retrace, gathering, before, bright, irradiance, aims, aims_past)
    new: list[AimedRays] = []
    for _, found in map_chunks(again, count, max(CHUNK_RAYS // rays, 1), gathering.threads, progress):
        if found is None:
            continue
        sources[found.row, found.ray] = found.sources
        np.add.at(closeness, found.row, found.nearer)
        whole[found.whole] = True
        sources[found.whole], closeness[found.whole] = found.gathered.sources, found.gathered.closeness
        rays_aimed = found.gathered.aimed
        new.append(replace(rays_aimed, row=found.whole[rays_aimed.row]))
    parts = [aimed.entries(~whole[aimed.row]), *new]
    return GatheredHits(sources, closeness, AimedRays.joined(parts, [0] * len(parts)))


class _RetracedRays(NamedTuple):
    """What changes at points.

    row, ray (c,) int: Rays that meet something else now; `sources` (c,) and how much `nearer` (c,) that is.
    whole (w,) int: Points that gather again with all their rays, and what they `gathered`.
    """

    row: Array
    ray: Array
    sources: Array
    nearer: Array
    whole: Array
    gathered: GatheredHits


def _retrace(
    gathering: FinalGather,
    before: Before,
    bright: BrightElements | None,
    irradiance: Array,
    aims: Array,
    aims_past: Array,
    part: slice,
) -> _RetracedRays | None:
    """Trace again what is touched of a run of points.

    aims, aims_past (g,) bool: Which points aim rays, and which such that a box may stop.
    """
    rows = np.arange(part.start, part.stop)
    stale = before.gathered.sources[rows] == UNNUMBERED
    retraced = stale.any(axis=1) | aims_past[rows]
    retraced |= before.moved.boxes.above(*gathering.planes(rows), before.widen[rows])
    rows, stale = rows[retraced], stale[retraced]
    if len(rows) == 0:
        return None
    directions, upward = gathering.directions(rows)
    points, _ = gathering.planes(rows)
    touched = before.moved.boxes.met_by(points, directions, before.widen[rows])
    touched = (touched | stale) & upward
    past = aims_past[rows]
    touched[past] = False
    row, ray = np.nonzero(touched)
    changed, sources, hits, nearer = gathering.trace_again(
        rows[row],
        ray,
        directions=directions[row, ray],
        stale=stale[row, ray],
        casters=(before.moved.alone, before.moved.before),
    )
    past[row[changed[gathering.on_any(before.bright, before.hosts, hits)]]] = True
    closer = np.bincount(row[changed], nearer, minlength=len(rows))
    renewed = -closer > RENEWED * before.gathered.closeness[rows]
    whole, shares = rows[past | renewed], None
    if bright is not None and len(bright) and len(whole):
        shares = gathering.shares(whole, bright, irradiance)
        wanted = aims[whole] | shares.any(axis=1) | renewed[past | renewed]
        whole, shares = whole[wanted], shares[wanted]
    else:
        whole = rows[renewed | (past & aims[rows])]
    gathered = gathering.trace_rows(whole, bright, shares)
    return _RetracedRays(rows[row[changed]], ray[changed], sources, nearer, whole, gathered)


def _aims_past_boxes(gathering: FinalGather, before: Before) -> Array:
    """Return (g,) which points aim rays that a box may stop, or might have stopped."""
    row = before.gathered.aimed.row
    found = np.zeros(len(before.gathered.sources), dtype=bool)
    if len(row) == 0:
        return found
    points, _ = gathering.planes(row)
    middle, half = before.aimed_at
    along = middle - points[:, None]
    found[row] = before.moved.boxes.met_by_fans(points, along, half, before.widen[row]).any(axis=1)
    found[row] |= (before.gathered.aimed.sources == UNNUMBERED).any(axis=1)
    return found
