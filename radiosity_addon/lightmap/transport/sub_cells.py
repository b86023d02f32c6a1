"""What gather rays met where no texel answers, and what it sees in turn.

Cells of leaf elements answer on backs and surfaces without a lightmap, cells of texels where geometry
divides a texel. They gather as texels do, so that what the coarse hierarchy smeared across a wall's
foot or into a closed box does not come back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, across, marked, row_numbers, tiles
from ...solver.gather import LightGains, joined_gains
from .gather_links import GatherLinks
from .hit_table import TILE_HITS, HitTable, TableRows
from .source_means import SourceMeans

RAYS_OF_MET = ((1, 4), (8, 16), (32, 64))
"""A cell that so many rays met, or more, gathers with so many of its own. Were m rays that met it all of one
point's n, a cell of r rays would add m² / (n r) of the point's own variance to it."""

MOST_MET = 127
"""Rays that met a cell, beyond which it makes no difference how many."""

GATHERED = 128
"""Added to the number of rays that met a cell once it has gathered: both fit into a byte."""

RAYS_PER_SHADOW_RAY = 4
"""Gather rays of a cell for each shadow ray to a lamp."""

ROUNDS = 16
"""Rounds of asking the cells that cells met, at most: each finds about half as many new ones, which count
less and less. What is met in the last has the hierarchy's value."""

SWEEPS = 4
"""Sweeps among the cells for each over the texels, at most: the next one goes on where they ended."""


@dataclass(frozen=True)
class SubCellLinks:
    """What p cells of one kind, that gather with as many rays, see.

    rows (p,) int32: Theirs in the table of radiosity.
    sources (p, rays) int32: Rows of the table, and negative numbers as in `GatherLinks`.
    reflectance (p, 3) float64
    lamps (p, 3) float64: Irradiance straight from lamps and emissive faces [W/m²].
    gains: The same for each light apart, if it is kept.
    tints (p, rays, 3) float16: As in `GatherLinks`.
    """

    STORED = ("rows", "sources", "reflectance", "gains", "tints")

    rows: Array
    sources: Array
    reflectance: Array
    lamps: Array
    gains: LightGains | None = None
    tints: Array | None = None


@dataclass(frozen=True)
class SubCells:
    """The table's rows after the n texels': all elements, then every smaller cell that was met.

    start (r, 3) float64: What they reflect by the hierarchy's light [W/m²].
    element (r,) int: Whose light `start` is, or NOTHING.
    """

    start: Array
    links: Sequence[SubCellLinks]
    element: Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


@dataclass(frozen=True)
class SubCellHits:
    """Cells of one kind that have gathered.

    of_element: Whether they are of elements, or of texels.
    number (p,) int32: Theirs in a `HitTable`.
    sources (p, rays) int32: Numbers of what they hit.
    gains: What lights add, if that is known as well.
    tints (p, rays, 3) float16: As in `GatherLinks`.
    lamps (p, 3): Irradiance straight from lamps and emissive faces [W/m²], if that is known without gains.
    """

    of_element: bool
    number: Array
    sources: Array
    gains: LightGains | None = None
    tints: Array | None = None
    lamps: Array | None = None

    @property
    def rays(self) -> int:
        """That each gathers with."""
        return int(self.sources.shape[1])

    @property
    def shadow_rays(self) -> int:
        """Of each to every lamp."""
        return self.rays // RAYS_PER_SHADOW_RAY

    def take(self, chosen: Array) -> SubCellHits:
        """Return those of some cells, row numbers or a mask."""
        gains = None if self.gains is None else self.gains.take(chosen)
        tints, lamps = (None if part is None else part[chosen] for part in (self.tints, self.lamps))
        return SubCellHits(self.of_element, self.number[chosen], self.sources[chosen], gains, tints, lamps)

    @staticmethod
    def joined(parts: Sequence[SubCellHits]) -> list[SubCellHits]:
        """Put cells of one kind and with as many rays together."""
        kinds: dict[tuple[bool, int], list[SubCellHits]] = {}
        for hits in parts:
            kinds.setdefault((hits.of_element, hits.rays), []).append(hits)
        return [_joined(kind) for kind in kinds.values()]


def _joined(parts: list[SubCellHits]) -> SubCellHits:
    gains = [hits.gains for hits in parts if hits.gains is not None]
    tints = [hits.tints for hits in parts if hits.tints is not None]
    return SubCellHits(
        parts[0].of_element,
        np.concatenate([hits.number for hits in parts]),
        np.concatenate([hits.sources for hits in parts]),
        joined_gains(gains) if gains else None,
        np.concatenate(tints) if tints else None,
    )


def gather_sub_cells(
    table: HitTable,
    links: GatherLinks,
    below: Array,
    reflectance: Array,
    most_rays: int,
    known: Sequence[SubCellHits] = (),
    progress: Progress = SILENT,
) -> tuple[SubCells, TableRows]:
    """Gather from the cells that links met, and from those that these met; return them, and all rows.

    links: Their sources are numbers of the table's, which become rows where they are, for they take more
        memory than all else.
    below (n,) int32: The leaf elements below the texels, or NOTHING.
    reflectance (n, 3): Of the texels.
    most_rays: No cell gathers with more.
    known: Those that need not gather, unless links meet them so often by now that they should have more rays.
        Those that nothing meets are left out.
    """
    gathering = _SubCellGather(table, most_rays, known)
    gathering.count(links.sources)
    gathering.count(links.aimed.sources)
    gathering.forget_coarse()
    gathering.take_known()
    for _, turn in zip(range(ROUNDS), progress.part(0.0, 0.5).turns(0.5), strict=False):
        if not gathering.gather_new(turn):
            break
        gathering.take_known()
        table.geometry.scratch.give_back()
    small = gathering.small()
    rows = TableRows(table.first_small, small)
    made = gathering.links(rows, reflectance, progress.part(0.5, 1.0))
    for sources in (links.sources, links.aimed.sources):
        rows.to_rows(sources)
    del gathering
    number = np.concatenate([np.arange(table.texel_count, table.first_small, dtype=np.int32), small])
    start = table.geometry.scratch.empty((len(number), 3))
    element = np.empty(len(number), dtype=np.int32)
    for tile in tiles(len(number)):
        element[tile] = table.elements_of(number[tile], below)
        start[tile] = table.local.elements.reflected_of(element[tile])
    return SubCells(start, made, element), rows


class _SubCellGather:
    """Gathers round by round from cells that were met. Their counts start with the first element's."""

    def __init__(self, table: HitTable, most_rays: int, known: Sequence[SubCellHits] = ()) -> None:
        self._table, self._first, self._most_rays = table, table.texel_count, most_rays
        self._scratch = table.geometry.scratch
        self._state = np.zeros(table.end - self._first, dtype=np.uint8)
        """Of every number how often it was met, up to `MOST_MET`, and whether it has `GATHERED`."""
        self._found: dict[tuple[bool, int], _FoundCells] = {}
        self._known = [(hits, np.zeros(len(hits.number), dtype=bool)) for hits in known]

    def count(self, sources: Array) -> None:
        """Note which cells were met."""
        for tile in tiles(len(sources), max(TILE_HITS // max(sources.shape[1], 1), 1)):
            number = sources[tile]
            # Few of all cells are met by a tile: sums over all of them would take longer than to sort it.
            cells, met = np.unique(number[number >= self._first] - self._first, return_counts=True)
            state = self._state[cells]
            self._state[cells] = np.minimum((state & MOST_MET) + met, MOST_MET) | (state & GATHERED)

    def forget_coarse(self) -> None:
        """Forget the known cells that were met so often by now that they should have more rays."""
        for number, (hits, _) in enumerate(self._known):
            kept = self._rays(self._state[hits.number - self._first]) <= hits.rays
            self._known[number] = hits.take(kept), np.zeros(int(kept.sum()), dtype=bool)

    def _rays(self, state: Array) -> Array:
        """Return (p,) uint16: with how many rays cells gather, by how often they were met."""
        step = np.searchsorted([least for least, _ in RAYS_OF_MET], np.arange(MOST_MET + 1), side="right") - 1
        rays = np.array([rays for _, rays in RAYS_OF_MET], dtype=np.uint16)[np.maximum(step, 0)]
        # Looked up: there may be millions, while memory is short.
        return np.asarray(np.minimum(rays, self._most_rays).astype(np.uint16)[state & MOST_MET])

    def take_known(self) -> None:
        """Take the known cells that were met, and those that these met in turn.

        What nobody meets any more has no row in the table.
        """
        more = True
        while more:
            more = False
            for hits, taken in self._known:
                cell = hits.number - self._first
                met = np.flatnonzero(~taken & (self._state[cell] > 0))
                if len(met):
                    more = taken[met] = True
                    self._state[cell[met]] |= GATHERED
                    self.count(hits.sources[met])

    def gather_new(self, progress: Progress) -> bool:
        """Gather from the cells that were met and have not gathered yet; return whether there were any."""
        found = [(np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.uint16))]
        for tile in tiles(len(self._state)):
            state = self._state[tile]
            new = np.flatnonzero((state > 0) & (state < GATHERED))
            found.append(((self._first + tile.start + new).astype(np.int32), self._rays(state[new])))
            state[new] |= GATHERED
        number, rays_of = (np.concatenate(part) for part in zip(*found, strict=True))
        del found
        is_elements = number < self._table.first_cell
        groups = [
            (of_element, rays)
            for of_element in (True, False)
            for rays in sorted({min(rays, self._most_rays) for _, rays in RAYS_OF_MET})
        ]
        for (of_element, rays), part in progress.each(groups):
            cells = number[(is_elements == of_element) & (rays_of == rays)]
            for tile, of_tile in part.each(list(tiles(len(cells)))):
                kind = self._found.get((of_element, rays))
                if kind is None:
                    kind = self._found[of_element, rays] = _FoundCells(self._table, of_element, rays)
                self.count(kind.gather(cells[tile], of_tile))
        return len(number) > 0

    def small(self) -> Array:
        """Return (s,) int32, ascending: smaller cells of elements that were met, and of texels that gathered.

        Where nobody gathered, the hierarchy's values stand; a cell of a texel has none.
        """
        table = self._table
        first, first_cell = table.first_small - self._first, table.first_cell - self._first
        met = row_numbers(self._state[first:first_cell] > 0) + np.int32(table.first_small)
        of_texels = row_numbers(self._state[first_cell:] >= GATHERED) + np.int32(table.first_cell)
        return np.concatenate([met, of_texels])

    def links(self, rows: TableRows, reflectance: Array, progress: Progress) -> list[SubCellLinks]:
        """Make the links of the cells that gathered, (n, 3) being the reflectance of the texels."""
        table = self._table
        gathered = [*(hits.take(taken) for hits, taken in self._known if taken.any())]
        gathered += [found.all() for found in self._found.values()]
        self._found = {}
        made = []
        for hits, part in progress.each(gathered):
            if hits.gains is not None:
                gains, lamps = hits.gains, table.local.direct.lit_by(hits.gains)
            elif hits.lamps is not None:
                gains, lamps = None, hits.lamps
            else:
                gains, lamps = self._lit(hits, part)
            of_cells = self._scratch.empty((len(hits.number), 3))
            for tile in tiles(len(of_cells)):
                of_cells[tile] = table.reflectance(hits.number[tile], hits.of_element, reflectance)
            rows.to_rows(hits.sources)
            made.append(
                SubCellLinks(rows.rows(hits.number), hits.sources, of_cells, lamps, gains, hits.tints)
            )
        return made

    def _lit(self, hits: SubCellHits, progress: Progress) -> tuple[LightGains | None, Array]:
        """Return what each light adds to cells, if it is kept, and (p, 3) what all add [W/m²]."""
        direct, lamps = self._table.local.direct, self._scratch.empty((len(hits.number), 3))
        kept = []
        for tile, part in progress.each(list(tiles(len(lamps)))):
            at = self._table.lit_footprints(hits.number[tile], hits.of_element)
            gains = direct.new_cell_gains(at, hits.shadow_rays)
            lamps[tile] = direct.at(at, hits.shadow_rays, gains, progress=part)
            if gains is not None:
                kept.append(gains)
        return joined_gains(kept) if kept else None, lamps


class _FoundCells:
    """Cells of one kind that gather, as many at a time as fit."""

    def __init__(self, table: HitTable, of_element: bool, rays: int) -> None:
        self._table, self._of_element, self._rays = table, of_element, rays
        scratch = table.geometry.scratch
        self._numbers: list[Array] = []
        self._sources = scratch.rows(rays, np.int32)
        self._tints = scratch.rows(3 * rays, np.float16) if table.local.caster.tinted else None

    def gather(self, number: Array, progress: Progress) -> Array:
        """Gather from further cells; return (p, rays) int32 the numbers of what they hit."""
        sources, tints = self._sources.more(len(number)), None
        if self._tints is not None:
            tints = self._tints.more(len(number)).reshape(len(number), self._rays, 3)
        self._table.gather(number, self._of_element, self._rays, (sources, tints), progress)
        self._numbers.append(number)
        return sources

    def all(self) -> SubCellHits:
        """Return all that gathered."""
        number, sources = np.concatenate(self._numbers), self._sources.all()
        tints = None if self._tints is None else self._tints.all().reshape(*sources.shape, 3)
        return SubCellHits(self._of_element, number, sources, tints=tints)


class SubCellSweeps:
    """Updates the cells' rows of a table of reflected radiosity.

    Parameters
    ----------
    cells : SubCells
    texel_count, threads : int
    scratch : Scratch or None
        Makes the cells' arrays; None keeps them in memory.
    """

    def __init__(
        self, cells: SubCells, texel_count: int, threads: int, scratch: Scratch | None = None
    ) -> None:
        self._links, self._surfaces = cells.links, texel_count + len(cells.start)
        self._texel_count = texel_count
        self._means = [
            SourceMeans(links.sources, links.lamps.shape[1], threads, links.tints, scratch)
            for links in cells.links
        ]
        self._unseen: Array | None = None

    def lit_or_unknown(self, direct: Array) -> Array:
        """Return (table rows − beyond,) bool: what direct light (n, 3) meets, and cells that gather none."""
        lit = np.ones(self._surfaces, dtype=bool)
        lit[: self._texel_count] = marked(self._texel_count, lambda rows: direct[rows].any(axis=1))
        for links in self._links:
            for tile in tiles(len(links.rows)):
                lit[links.rows[tile]] = across(np.logical_or, links.lamps[tile])
        return lit

    def reach(self, reached: Array) -> bool:
        """Mark the cells that see something marked in a (table rows,) mask; False if they all were."""
        more = False
        for links in self._links:
            unseen = np.empty(len(links.rows), dtype=bool)
            for tile in tiles(len(unseen)):
                unseen[tile] = ~reached[links.rows[tile]]
            dark = row_numbers(unseen)
            seen = [
                dark[tile][across(np.logical_or, reached[links.sources[dark[tile]]])]
                for tile in tiles(len(dark))
            ]
            for rows in seen:
                reached[links.rows[rows]] = True
                more |= len(rows) > 0
        return more

    def sweep(self, table: Array, changed: Array, still: float) -> None:
        """Update the cells' rows, among themselves until they rest, in `SWEEPS` sweeps at most.

        Parameters
        ----------
        changed : (table rows,) bool
            What changed since the last call; rows that change now are added.
        still : float
            Rows that would change by less stay as they are.
        """
        fresh = changed.copy() if self._unseen is None else changed | self._unseen
        for _ in range(SWEEPS):
            news = []
            for links, means in zip(self._links, self._means, strict=True):
                for own, mean in means.renewed(table, fresh):
                    rows = links.rows[own]
                    reflected = (links.reflectance[own] * (links.lamps[own] + mean)).astype(np.float32)
                    moved = across(np.maximum, np.abs(reflected - table[rows])) > still
                    if moved.any():
                        news.append((rows[moved], reflected[moved]))
            fresh[:] = False
            for rows, values in news:
                table[rows] = values
                fresh[rows] = changed[rows] = True
            if not news:
                break
        # What changed last no cell has seen yet: the next call begins with it.
        self._unseen = fresh
