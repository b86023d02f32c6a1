"""The light of a scene before something moved, and what of it stands."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...numerics import Array
from ...solver.gather import LocalPass
from ..transport import GatherLinks, HitTable, LightingRecord, RelightableTexels, TableRows, TexelTransport
from .affected import AffectedTexels


@dataclass(frozen=True, eq=False)
class PreviousLight:
    """A scene's texels before something moved.

    local: Of the scene as it was.
    affected: What may have changed since.
    """

    lit: RelightableTexels
    traced: LightingRecord
    local: LocalPass
    affected: AffectedTexels


class StandingHits:
    """What of the hits before something moved stands, by the numbers they have now.

    table: Of the scene as it is.
    divided (n,) bool: See `AffectedTexels.divided`.
    bright (e,) bool: The elements that rays are or were aimed at.
    """

    def __init__(self, previous: PreviousLight, table: HitTable) -> None:
        traced, affected = previous.traced, previous.affected
        self.previous, self.table = previous, table
        self.divided = affected.divided(traced.table.crossings, table.crossings)
        self.bright = traced.bright | table.local.gather.bright
        self._number_now = affected.renumbered(traced.table, table, self.divided)

    def numbers(self, rows: Array) -> Array:
        """Return what rows of the earlier table, of any shape, are numbered now, or UNNUMBERED.

        Negative ones stay.
        """
        number = self.previous.traced.rows.numbers(rows)
        return np.asarray(np.where(number >= 0, self._number_now[np.maximum(number, 0)], number))

    def renumbered_links(self) -> GatherLinks:
        """Return the stored links with sources as hits are numbered now."""
        links = self.previous.lit.transport.links
        aimed = replace(links.aimed, sources=self.numbers(links.aimed.sources))
        return replace(links, sources=self.numbers(links.sources), aimed=aimed)

    def start(
        self, transport: TexelTransport, rows: TableRows, element: Array, more: Array
    ) -> tuple[Array, TexelTransport]:
        """Return (n, 3) what texels reflect to start with, and `transport` with what cells do.

        What they did, or what the hierarchy says; texels also what they reflect of `more` light of lamps,
        (n, 3) [W/m²].
        """
        cells, count = transport.cells, len(element)
        start = self.table.local.elements.reflected_of(np.concatenate([element, cells.element]))
        number = self.numbers(np.arange(len(self.previous.traced.rows)))
        stands = number >= 0
        place = np.full(self.table.end, -1)
        place[rows.numbers(np.arange(len(rows)))] = np.arange(len(rows))
        row = place[number[stands]]
        known = row >= 0
        start[row[known]] = self.previous.lit.warm_start.baked[stands][known]
        of_texels = np.maximum(start[:count] + transport.reflectance * more, 0.0)
        return of_texels, replace(transport, cells=replace(cells, start=start[count:]))
