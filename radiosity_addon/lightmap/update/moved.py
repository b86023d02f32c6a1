"""Texels lit after something moved: what it does not touch keeps what its rays met.

The order is that of `reconstruction.py`: direct light, crossings, gather points, parts, sweeps. Each step
keeps what was found before and asks anew only where what moved was or is in the way. Sweeps then go over all
texels, for indirect light changes everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array
from ...solver.gather import LocalPass, values_of
from ..lighting import (
    GatherLinks,
    GatherPointLayout,
    HitTable,
    LightingRecord,
    RelightableTexels,
    SubCells,
    TableRows,
    TexelLight,
    TexelTransport,
    WarmStart,
    gather_sub_cells,
    sweep,
)
from ..texels import find_crossings
from .affected import AffectedTexels
from .moved_light import texel_gains
from .moved_points import MovedPoints
from .moved_sub_cells import known_sub_cells, renumbered, trace_again

DIRECT, CROSSED, GATHERED, KNOWN, PARTS = 0.2, 0.25, 0.65, 0.8, 0.85
"""How much is done when a part ends; rough, from rooms at medium quality."""


@dataclass(frozen=True, eq=False)
class PreviousLight:
    """A scene's texels before something moved.

    Attributes
    ----------
    lit : RelightableTexels
    traced : LightingRecord
    local : LocalPass
        Of the scene as it was.
    """

    lit: RelightableTexels
    traced: LightingRecord
    local: LocalPass


def light_after_move(
    before: PreviousLight, local: LocalPass, affected: AffectedTexels, progress: Progress = SILENT
) -> tuple[TexelLight, LocalPass]:
    """Light the texels of a scene in which something moved.

    Parameters
    ----------
    before : PreviousLight
    local : LocalPass
        Of the scene as it is, by the same elements with the light they had, able to ask for every light
        apart.
    affected : AffectedTexels

    Returns
    -------
    light : TexelLight
    local : LocalPass
        With elements that are lit as their texels are.
    """
    lit, traced, geometry = before.lit, before.traced, affected.geometry
    gains = texel_gains(lit.gains, local, before.local, affected, progress.part(0.0, DIRECT))
    direct = local.direct.lit_by(gains)
    more = direct - local.direct.lit_by(lit.gains)
    local = _brightened(local, lit.element, more)
    near = np.flatnonzero(affected.near)
    part = progress.part(DIRECT, CROSSED)
    crossings = find_crossings(geometry, local.caster, local.threads, traced.table.crossings, near, part)
    table = HitTable(local, geometry, crossings)
    divided = affected.divided(traced.table.crossings, crossings)
    number_now = affected.renumbered(traced.table, table, divided)

    bright = traced.bright | local.gather.bright
    moved_points = MovedPoints(
        local,
        before=before.local,
        affected=affected,
        settings=traced.settings,
        crossings=crossings,
        divided=divided,
        resolve=table.number,
        bright=bright,
    )
    old, part = _renumbered(lit.transport.links, traced.rows, number_now), progress.part(CROSSED, GATHERED)
    links, points = moved_points.gather(old, traced.points, part)

    kept = known_sub_cells(lit.transport.cells.links, traced.rows, table, number_now)
    known = [
        trace_again(hits, table, before.local, affected, part)
        for hits, part in progress.part(GATHERED, KNOWN).each(kept)
    ]
    reflectance, part = lit.transport.reflectance, progress.part(KNOWN, PARTS)
    cells, rows = gather_sub_cells(table, links, lit.element, reflectance, known, part)

    transport = TexelTransport(links, cells, reflectance)
    chosen, error = GatherPointLayout.of(points), traced.error
    traced = LightingRecord(traced.settings, table, chosen, rows, bright, error)
    start = _start(before, traced, local, cells, number_now)
    of_texels = np.maximum(start[: len(geometry)] + reflectance * more, 0.0)
    transport = replace(transport, cells=replace(cells, start=start[len(geometry) :]))
    light = sweep(
        transport,
        of_texels,
        direct,
        local.elements.beyond(),
        sweeps=lit.sweeps,
        tolerance=lit.tolerance,
        threads=local.threads,
        estimate=False,
        scratch=geometry.scratch,
        progress=progress.part(PARTS, 1.0),
    )
    assert local.direct.sources is not None  # it asks for lights apart
    assert light.table is not None
    warm_start = WarmStart(local.direct.sources.strengths, light.table)
    lit = replace(lit, transport=transport, gains=gains, warm_start=warm_start)
    light = replace(light, error=error, kept=lit, traced=traced)
    return light, _lit_as(local, lit.element, light)


def _renumbered(links: GatherLinks, rows: TableRows, number_now: Array) -> GatherLinks:
    """Return stored links with sources as hits are numbered now."""
    aimed = replace(links.aimed, sources=renumbered(rows.numbers(links.aimed.sources), number_now))
    return replace(links, sources=renumbered(rows.numbers(links.sources), number_now), aimed=aimed)


def _brightened(local: LocalPass, element: Array, more: Array) -> LocalPass:
    """Add what texels get more of lamps, (n, 3) [W/m²], to their elements' light, in the mean."""
    change, _ = _means(local, element, more)
    return local.with_irradiance(np.maximum(local.elements.state.irradiance + change, 0.0))


def _lit_as(local: LocalPass, element: Array, light: TexelLight) -> LocalPass:
    """Give elements the mean light of their texels, where they have any."""
    mean, count = _means(local, element, light.direct + light.indirect)
    return local.with_irradiance(np.where(count[:, None] > 0, mean, local.elements.state.irradiance))


def _means(local: LocalPass, element: Array, values: Array) -> tuple[Array, Array]:
    """Return (e, 3) texels' mean values over elements, and (e,) how many texels there are."""
    rows, total = element >= 0, local.elements.hierarchy.n_elements
    count = np.bincount(element[rows], minlength=total)
    sums = [np.bincount(element[rows], values[rows, channel], minlength=total) for channel in range(3)]
    return np.stack(sums, axis=1) / np.maximum(count, 1)[:, None], count


def _start(
    before: PreviousLight, traced: LightingRecord, local: LocalPass, cells: SubCells, number_now: Array
) -> Array:
    """Return (rows, 3) what surfaces reflect to start with: what they did, or what the hierarchy says."""
    element = np.concatenate([before.lit.element, cells.element])
    start = values_of(local.elements.reflected(), element)
    old, rows = before.traced.rows, traced.rows
    number = number_now[old.numbers(np.arange(len(old)))]
    stands = number >= 0
    place = np.full(traced.table.end, -1)
    place[rows.numbers(np.arange(len(rows)))] = np.arange(len(rows))
    row = place[number[stands]]
    known = row >= 0
    start[row[known]] = before.lit.warm_start.baked[stands][known]
    return start
