"""Gather rays that something which moved may have stopped, or stops now, traced again; all others stay.

Rays depend on their point's key, their number and the seed alone, so any of them can be made again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, map_chunks
from ...rays import RayCaster
from .boxes import Boxes
from .bright_patches import AimedRays, BrightElements
from .final_gather import CHUNK_RAYS, Gathered, Gathering
from .hit_numbers import UNNUMBERED

RENEWED = 0.3
"""A point whose closeness falls by more than this part is gathered again: what single rays take off
a sum that a few very short ones dominate may leave anything, even less than nothing."""


@dataclass(frozen=True)
class Moved:
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
    gathered : Gathered
        Sources numbered as they are now, or UNNUMBERED.
    aimed_at : (a, k, 3) float64 twice
        Of its aimed rays: the middles of the boxes around the elements aimed at, and half their sizes.
    moved : Moved
    widen : (g,) float64 [m]
        How far from a point its rays start.
    bright, hosts : (e,) bool, (t,) bool
        Elements that are or were bright enough to aim at, and triangles that have some.
    """

    gathered: Gathered
    aimed_at: tuple[Array, Array]
    moved: Moved
    widen: Array
    bright: Array
    hosts: Array


class Retracing:
    """Traces again what the boxes touch.

    Which bright elements a point aims at decides what its other rays leave out. So where an aimed ray is
    touched, or another one meets a bright element now, the point is gathered again as a whole.

    Parameters
    ----------
    gathering : Gathering
        Of the same points, rays and seed as before.
    before : Before
    """

    def __init__(self, gathering: Gathering, before: Before) -> None:
        self._gathering, self._before = gathering, before
        gathering.take_up(before.gathered)

    def trace(
        self, bright: BrightElements | None, irradiance: Array, progress: Progress = SILENT
    ) -> Gathered:
        """Trace what is touched. Parameters as of `Gathering.trace`."""
        before, gathering = self._before, self._gathering
        count, rays = before.gathered.sources.shape
        whole = np.zeros(count, dtype=bool)
        aims = np.zeros(count, dtype=bool)
        aims[before.gathered.aimed.row] = True
        aims_past = self._aims_past_boxes(count)

        def trace(part: slice) -> AimedRays | None:
            rows = np.arange(part.start, part.stop)
            stale = before.gathered.sources[rows] == UNNUMBERED
            asked = stale.any(axis=1) | aims_past[rows]
            points, normals = gathering.planes(rows)
            asked |= before.moved.boxes.above(points, normals, before.widen[rows])
            rows, stale = rows[asked], stale[asked]
            if len(rows) == 0:
                return None
            directions, upward = gathering.directions(rows)
            points, _ = gathering.planes(rows)
            touched = before.moved.boxes.met_by(points, directions, before.widen[rows])
            touched = (touched | stale) & upward
            past = aims_past[rows]
            touched[past] = False
            row, ray = np.nonzero(touched)
            changed, hits, nearer = gathering.trace_again(
                rows[row],
                ray,
                directions=directions[row, ray],
                stale=stale[row, ray],
                casters=(before.moved.alone, before.moved.before),
            )
            past[row[changed[gathering.on_any(before.bright, before.hosts, hits)]]] = True
            closer = np.bincount(row[changed], nearer, minlength=len(rows))
            renewed = -closer > RENEWED * before.gathered.closeness[rows]
            again, shares = rows[past | renewed], None
            if bright is not None and len(bright) and len(again):
                shares = gathering.shares(again, bright, irradiance)
                wanted = aims[again] | shares.any(axis=1) | renewed[past | renewed]
                again, shares = again[wanted], shares[wanted]
            else:
                again = rows[renewed | (past & aims[rows])]
            if len(again) == 0:
                return None
            whole[again] = True
            found = gathering.trace_rows(again, bright, shares)
            return None if found is None else replace(found, row=again[found.row])

        chunks = map_chunks(trace, count, max(CHUNK_RAYS // rays, 1), gathering.threads, progress)
        new = [found for _, found in chunks if found is not None]
        aimed = before.gathered.aimed
        kept = aimed.entries(~whole[aimed.row])
        parts = [kept, *new]
        return gathering.gathered(AimedRays.joined(parts, [0] * len(parts)))

    def _aims_past_boxes(self, count: int) -> Array:
        """Return (g,) which points aim rays that a box may stop, or might have stopped."""
        before = self._before
        row = before.gathered.aimed.row
        found = np.zeros(count, dtype=bool)
        if len(row) == 0:
            return found
        points, _ = self._gathering.planes(row)
        middle, half = before.aimed_at
        along = middle - points[:, None]
        found[row] = before.moved.boxes.met_by_fans(points, along, half, before.widen[row]).any(axis=1)
        found[row] |= (before.gathered.aimed.sources == UNNUMBERED).any(axis=1)
        return found
