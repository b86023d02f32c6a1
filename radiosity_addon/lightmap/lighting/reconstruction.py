"""Irradiance of every texel from a solved scene: direct light, gather points, sweeps.

Direct light is evaluated at every texel. Indirect light is gathered at few texels, dense near contacts,
and interpolated. What each gather ray hit is stored, most often another texel: that is a link at the
finest level, so a few Jacobi sweeps over the texels, which trace nothing, remove the errors of the
coarse hierarchy.

After objects moved the steps are the same. Each keeps earlier results and traces again only where the moved
objects were or are in the way; the sweeps go over all texels, because indirect light changes everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, tiles
from ...scene import Scene
from ...solver.gather import Footprints, LightGains, LocalPass
from ..points import alike_neighbors
from ..texels import SmoothLift, TexelGeometry, find_crossings, texel_materials, uneven_texels
from ..transport import (
    GatherPointLayout,
    GatherSettings,
    HitTable,
    LightingRecord,
    RelightableTexels,
    SmoothingChoice,
    TableRows,
    TexelLight,
    TexelTransport,
    WarmStart,
    gather_sub_cells,
    gather_texels,
    sweep,
    with_more_rays,
)
from ..update import PreviousLight, StandingHits, kept_cells, kept_points, texel_gains
from .partial_light import LightSoFar

DIRECT, CROSSED = 0.18, 0.22
"""How much is done when a part ends; rough, from the office, a classroom and a game's level."""

TRACED = 0.85
"""How much of what follows is done when all rays are traced, and sweeps begin."""

GATHER_FRACTION = 0.53
"""The part of tracing that gathers at texels."""

RETRACED = 0.5
"""The part of gathering that goes over rays that were traced before, if any were."""

CHUNK = 1 << 16
"""Texels whose elements are looked up at once; bounds the temporaries to about 20 MB."""


def light_texels(
    scene: Scene,
    local: LocalPass,
    geometry: TexelGeometry,
    settings: GatherSettings,
    previous: PreviousLight | None = None,
    so_far: LightSoFar | None = None,
    more_rays: Callable[[float], float] | None = None,
    progress: Progress = SILENT,
) -> TexelLight:
    """Compute direct and indirect irradiance of all texels.

    Parameters
    ----------
    scene : Scene
    local : LocalPass
        If it evaluates every light separately, the data to relight the texels is kept.
    geometry : TexelGeometry
    settings : GatherSettings
    previous : PreviousLight or None
        The light before something moved; what it does not affect is kept. `local` is then of the same
        elements with the light they had, and evaluates every light separately.
    so_far : LightSoFar or None
        Gets intermediate results.
    more_rays : callable or None
        Is given the estimated error, and returns how many times as many rays to gather with; 1 is enough.
    """
    reflectance, emission = texel_materials(scene, geometry)
    element = elements_below(local, geometry)
    lamps = geometry.scratch.zeros((len(geometry), 3))
    if so_far is not None:
        so_far.begin(local, geometry, element, lamps, (reflectance, emission))
    del emission
    gains = _direct_light(local, geometry, previous, lamps, so_far, progress.part(0.0, DIRECT))
    geometry.scratch.give_back()
    more = None if previous is None else lamps - local.direct.lit_by(previous.lit.gains)
    if more is not None:
        local = _brightened(local, element, more)
    crossings = find_crossings(
        geometry,
        local.caster,
        local.threads,
        before=None if previous is None else previous.traced.table.crossings,
        again=None if previous is None else np.flatnonzero(previous.affected.near),
        progress=progress.part(DIRECT, CROSSED),
    )
    table = HitTable(local, geometry, crossings, uneven_texels(geometry, lamps))
    geometry.scratch.give_back()
    standing = None if previous is None else StandingHits(previous, table)
    turns = iter([progress.part(CROSSED, 1.0)])
    if more_rays is not None:
        turns = progress.part(CROSSED, 1.0).turns(0.5)
    turn = next(turns)
    part = turn.part(0.0, TRACED)
    transport, layout, rows = _trace(table, settings, element, reflectance, standing, so_far, part)
    if standing is None or more is None:
        start = _hierarchy_start(local, element, geometry)
    else:
        start, transport = standing.start(transport, rows, element, more)
    alike = alike_neighbors(geometry, local.caster, crossings.alone, local.threads)
    geometry.scratch.give_back()
    while True:
        light = sweep(
            transport,
            start,
            lamps,
            local.elements.beyond(),
            sweeps=settings.sweeps,
            tolerance=settings.tolerance,
            threads=local.threads,
            smooth=SmoothingChoice(geometry, alike),
            seen=None if so_far is None else so_far.swept,
            scratch=geometry.scratch,
            progress=turn.part(TRACED, 1.0),
        )
        factor = 1.0 if more_rays is None else more_rays(light.error)
        if factor <= 1.0 or light.table is None:
            break
        start = light.table[: len(geometry)]
        del light
        turn = next(turns)
        part = turn.part(0.0, TRACED)
        transport, layout, rows = with_more_rays(
            table, transport, layout, rows, factor, element, settings.cell_rays, part
        )
    # Rays traced again are as many.
    error = light.error if previous is None else previous.traced.error
    light = replace(light, state=crossings.state, error=error)
    progress.at(1.0)
    if gains is None or local.direct.sources is None or light.table is None:
        return light
    assert light.smoothing is not None  # chosen from the noise
    warm_start = WarmStart(local.direct.sources.strengths, light.table)
    lit = RelightableTexels(
        transport, gains, element, settings.sweeps, settings.tolerance, warm_start, light.smoothing
    )
    bright = local.gather.bright if standing is None else standing.bright
    return replace(light, kept=lit, traced=LightingRecord(settings, table, layout, rows, bright, error))


def _direct_light(
    local: LocalPass,
    geometry: TexelGeometry,
    previous: PreviousLight | None,
    lamps: Array,
    so_far: LightSoFar | None,
    progress: Progress,
) -> LightGains | None:
    """Add what lamps and emissive surfaces give texels to `lamps`, (n, 3); return gains if they are kept."""
    if previous is not None:
        gains = texel_gains(previous, local, progress)
        lamps += local.direct.lit_by(gains)
        return gains
    kept = local.direct.new_gains(len(geometry), geometry.scratch)
    on_light = None if so_far is None else so_far.lamp_done
    at = footprints(geometry, local)
    local.direct.at(at, gains=kept, total=lamps, on_light=on_light, progress=progress)
    return kept


def _trace(
    table: HitTable,
    settings: GatherSettings,
    element: Array,
    reflectance: Array,
    standing: StandingHits | None,
    so_far: LightSoFar | None,
    progress: Progress,
) -> tuple[TexelTransport, GatherPointLayout, TableRows]:
    """Gather at texels and at the cells that their rays met, except what stands.

    Returns also where points were chosen, and the rows of the table of radiosity.
    """
    met = None if so_far is None else partial(so_far.met, table)
    gathering, parts = progress.part(0.0, GATHER_FRACTION), progress.part(GATHER_FRACTION, 1.0)
    kept, known = None, []
    if standing is not None:
        kept = kept_points(standing, gathering.part(0.0, RETRACED))
        gathering = gathering.part(RETRACED, 1.0)
    values = partial(table.expected, below=element)
    links, layout = gather_texels(
        table.local, table.crossings, settings, table.number, values, kept, met, gathering
    )
    del kept
    table.geometry.scratch.give_back()
    if standing is not None:
        known = kept_cells(standing, parts.part(0.0, RETRACED))
        parts = parts.part(RETRACED, 1.0)
    cells, rows = gather_sub_cells(table, links, element, reflectance, settings.cell_rays, known, parts)
    return TexelTransport(links, cells, reflectance), layout, rows


def _hierarchy_start(local: LocalPass, element: Array, geometry: TexelGeometry) -> Array:
    """Return (n, 3) float32 what texels reflect by the hierarchy's light [W/m²]."""
    start = geometry.scratch.empty((len(element), 3), np.float32)
    for tile in tiles(len(element)):
        start[tile] = local.elements.reflected_of(element[tile])
    return start


def _brightened(local: LocalPass, element: Array, more: Array) -> LocalPass:
    """Add what texels get more of lamps, (n, 3) [W/m²], to their elements' light, in the mean."""
    change, _ = _means(local, element, more)
    return local.with_irradiance(np.maximum(local.elements.state.irradiance + change, 0.0))


def lit_as_texels(local: LocalPass, element: Array, light: TexelLight) -> LocalPass:
    """Give elements the mean light of their texels, where they have any."""
    mean, count = _means(local, element, light.direct + light.indirect)
    return local.with_irradiance(np.where(count[:, None] > 0, mean, local.elements.state.irradiance))


def _means(local: LocalPass, element: Array, values: Array) -> tuple[Array, Array]:
    """Return (e, 3) texels' mean values over elements, and (e,) how many texels there are."""
    rows, total = element >= 0, local.elements.hierarchy.n_elements
    count = np.bincount(element[rows], minlength=total)
    sums = [np.bincount(element[rows], values[rows, channel], minlength=total) for channel in range(3)]
    return np.stack(sums, axis=1) / np.maximum(count, 1)[:, None], count


def footprints(geometry: TexelGeometry, local: LocalPass) -> Footprints:
    """Return where all texels ask for light, and how much the elements lead them to expect."""
    scratch = geometry.scratch
    keys, expected = scratch.empty(len(geometry), np.int32), scratch.empty(len(geometry))
    for tile in tiles(len(geometry), CHUNK):
        keys[tile] = np.arange(tile.start, tile.stop)
        expected[tile] = local.elements.irradiance_at(geometry.triangle[tile], geometry.barycentric[tile])
    return Footprints(
        geometry.position,
        geometry.normal,
        keys,
        geometry.sample,
        geometry.neighborhood,
        expected=expected,
        lift=SmoothLift(geometry),
        scratch=scratch,
    )


def elements_below(local: LocalPass, geometry: TexelGeometry) -> Array:
    """Return (n,) int32 the leaf elements below the texels, or NOTHING."""
    element = geometry.scratch.empty(len(geometry), np.int32)
    for tile in tiles(len(geometry), CHUNK):
        element[tile] = local.elements.leaf_at_fronts(geometry.triangle[tile], geometry.barycentric[tile])
    return element
