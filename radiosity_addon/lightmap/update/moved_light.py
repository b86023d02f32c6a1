"""What lamps add where something moved: shadow rays only where it may be, or was, in a lamp's way."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base import Progress
from ...numerics import Array
from ...solver.gather import Footprints, LightGains, LightQuery, LocalPass, RunGains, alike
from ..texels import SmoothLift, TexelGeometry
from ..transport import HitTable, SubCellHits, sample_of
from .previous import PreviousLight


def changed_lights(local: LocalPass, before: LocalPass) -> list[tuple[LightQuery, bool]]:
    """Pair the lights that shine on points with whether they themselves moved."""
    old = {query.number: query.light for query in before.direct.lights()}
    result = []
    for query in local.direct.lights():
        was = old.get(query.number)
        same_as = getattr(query.light, "same_as", None)
        result.append((query, was is None or (same_as is not None and not same_as(was))))
    return result


def texel_gains(previous: PreviousLight, local: LocalPass, progress: Progress) -> LightGains:
    """Return what lights add to texels, asked again where it may have changed."""
    affected = previous.affected
    geometry, lift = affected.geometry, SmoothLift(affected.geometry)
    gains = local.direct.new_gains(len(geometry))
    assert gains is not None  # light is kept apart
    for (query, moved), part in progress.each(changed_lights(local, previous.local)):
        gain = previous.lit.gains.of(query.number)
        touched = affected.texels.copy()
        touched |= moved | affected.boxes.between(geometry.position, query.light, affected.widen)
        # One texel more: a penumbra is followed from neighbor to neighbor.
        around = np.flatnonzero(geometry.neighborhood(touched))
        found = local.direct.gain(query, _footprints(geometry, around, lift), progress=part)
        own = touched[around]
        gain, found = alike(gain, found)
        gain[around[own]] = found[own]
        gains.put(query.number, gain)
    return gains


def sub_cell_gains(
    hits: SubCellHits, table: HitTable, previous: PreviousLight, at: Array, widen: Array, progress: Progress
) -> LightGains:
    """Return what lights add to cells, at (p, 3) anchors, asked again where it may have changed."""
    assert hits.gains is not None  # kept cells keep them
    local, boxes = table.local, previous.affected.boxes
    changed = changed_lights(local, previous.local)
    if isinstance(hits.gains, RunGains):
        # A run is asked as a whole.
        touched = np.zeros(len(hits.number), dtype=bool)
        for query, moved in changed:
            touched |= moved | boxes.between(at, query.light, widen)
        rows = np.flatnonzero(touched)
        points = table.lit_footprints(hits.number[rows], hits.of_element)
        found = local.direct.new_cell_gains(points, hits.shadow_rays)
        assert isinstance(found, RunGains)  # as they were
        local.direct.at(points, hits.shadow_rays, found, progress=progress)
        return hits.gains.replaced(rows, found)
    gains = LightGains(len(hits.number))
    for (query, moved), part in progress.each(changed):
        gain = hits.gains.of(query.number)
        rows = np.flatnonzero(moved | boxes.between(at, query.light, widen))
        points = table.lit_footprints(hits.number[rows], hits.of_element)
        gain, asked = alike(gain, local.direct.gain(query, points, hits.shadow_rays, part))
        gain[rows] = asked
        gains.put(query.number, gain)
    return gains


def _footprints(geometry: TexelGeometry, chosen: Array, lift: SmoothLift) -> Footprints:
    """Return where some texels ask for light, as all of them do in a bake."""
    return Footprints(
        geometry.position[chosen],
        geometry.normal[chosen],
        chosen,
        partial(sample_of, geometry, chosen),
        partial(_neighbors, geometry, chosen),
        lift=lift.of(chosen),
    )


def _neighbors(geometry: TexelGeometry, chosen: Array, mask: Array) -> Array:
    """Grow a mask of some texels by their neighbors among these."""
    every = np.zeros(len(geometry), dtype=bool)
    every[chosen] = mask
    return np.asarray(geometry.neighborhood(every)[chosen])
