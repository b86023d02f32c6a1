"""The light of a scene before something moved, and what of it stands."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...base import Progress
from ...numerics import Array
from ...solver.gather import LightGains, LocalPass, values_of
from ..transport import (
    GatherLinks,
    HitTable,
    KeptPoints,
    LightingRecord,
    RelightableTexels,
    SubCellHits,
    TableRows,
    TexelTransport,
)
from .affected import AffectedTexels
from .moved_light import texel_gains
from .moved_points import MovedPoints
from .moved_sub_cells import known_sub_cells, renumbered, trace_again


@dataclass(frozen=True, eq=False)
class PreviousLight:
    """A scene's texels before something moved.

    Attributes
    ----------
    lit : RelightableTexels
    traced : LightingRecord
    local : LocalPass
        Of the scene as it was.
    affected : AffectedTexels
        What may have changed since.
    """

    lit: RelightableTexels
    traced: LightingRecord
    local: LocalPass
    affected: AffectedTexels

    def gains(self, local: LocalPass, progress: Progress) -> LightGains:
        """Return what lights add to texels in the scene as it is, asked again where it may differ."""
        return texel_gains(self.lit.gains, local, self.local, self.affected, progress)


class StandingHits:
    """What of the hits before something moved stands, by the numbers they have now.

    Parameters
    ----------
    previous : PreviousLight
    table : HitTable
        Of the scene as it is.

    Attributes
    ----------
    bright : (e,) bool
        The elements that rays are or were aimed at.
    """

    def __init__(self, previous: PreviousLight, table: HitTable) -> None:
        traced, affected = previous.traced, previous.affected
        self._previous, self._table = previous, table
        self._divided = affected.divided(traced.table.crossings, table.crossings)
        self._number_now = affected.renumbered(traced.table, table, self._divided)
        self.bright = traced.bright | table.local.gather.bright

    def points(self, progress: Progress) -> KeptPoints:
        """Return the gather points that stay; rays that may meet something else are retraced."""
        previous = self._previous
        moved = MovedPoints(
            self._table,
            before=previous.local,
            affected=previous.affected,
            settings=previous.traced.settings,
            divided=self._divided,
            bright=self.bright,
        )
        return moved.kept(self._links(), previous.traced.points, progress)

    def cells(self, progress: Progress) -> list[SubCellHits]:
        """Return the cells that stay; rays that may meet something else are retraced."""
        previous, table = self._previous, self._table
        links = previous.lit.transport.cells.links
        known = known_sub_cells(links, previous.traced.rows, table, self._number_now)
        return [
            trace_again(hits, table, previous.local, previous.affected, part)
            for hits, part in progress.each(known)
        ]

    def start(
        self, transport: TexelTransport, rows: TableRows, element: Array, more: Array
    ) -> tuple[Array, TexelTransport]:
        """Return (n, 3) what texels reflect to start with, and `transport` with what cells do.

        What they did, or what the hierarchy says; texels also what they reflect of `more` light of lamps,
        (n, 3) [W/m²].
        """
        cells, count = transport.cells, len(element)
        start = values_of(self._table.local.elements.reflected(), np.concatenate([element, cells.element]))
        old = self._previous.traced.rows
        number = self._number_now[old.numbers(np.arange(len(old)))]
        stands = number >= 0
        place = np.full(self._table.end, -1)
        place[rows.numbers(np.arange(len(rows)))] = np.arange(len(rows))
        row = place[number[stands]]
        known = row >= 0
        start[row[known]] = self._previous.lit.warm_start.baked[stands][known]
        of_texels = np.maximum(start[:count] + transport.reflectance * more, 0.0)
        return of_texels, replace(transport, cells=replace(cells, start=start[count:]))

    def _links(self) -> GatherLinks:
        """Return the stored links with sources as hits are numbered now."""
        links, rows = self._previous.lit.transport.links, self._previous.traced.rows
        sources, aimed = (
            renumbered(rows.numbers(hits), self._number_now) for hits in (links.sources, links.aimed.sources)
        )
        return replace(links, sources=sources, aimed=replace(links.aimed, sources=aimed))
