"""What gather rays met where no texel answers, and what it sees in turn.

Parts of leaf elements answer on backs and surfaces without a lightmap, cells of texels where geometry
divides a texel. They gather as texels do, so that what the coarse hierarchy smeared across a wall's
foot or into a closed box does not come back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, marked, tiles
from ...solver.gather import NOTHING, Footprints, LightGains, LocalPass, Resolver, values_of
from ..texels import TexelCells
from .gather_links import StoredLinks
from .source_means import Means

OFTEN = 32
"""A part that so many rays met matters: …"""

RAYS, MANY_RAYS = 16, 64
"""… it gathers with more rays. Parts that few rays met answer few, and their noise averages out."""

SHADOW_RAYS = 4
"""Of a part to each lamp for `RAYS` gather rays; in proportion for more."""

ROUNDS = 3
"""Rounds of asking the parts that parts met; beyond, the hierarchy's values stand for leaves."""

TILE_HITS = 1 << 22
"""Stored hits that are counted or numbered at once; bounds the temporaries to about 60 MB."""

SWEEPS = 4
"""Sweeps among the parts for each over the texels, at most: the next one goes on where they ended."""


@dataclass(frozen=True)
class PartLinks:
    """What p parts of one kind, that gather with as many rays, see.

    Attributes
    ----------
    rows : (p,) int64
        Theirs in the table of radiosity.
    sources : (p, rays) int32
        Rows of the table, and negative numbers as in `StoredLinks`.
    reflectance : (p, 3) float64
    lamps : (p, 3) float64 [W/m²]
        Irradiance straight from lamps and emissive faces.
    gains : LightGains or None
        The same for each light apart, if it is kept.
    """

    STORED = ("rows", "sources", "reflectance", "gains")

    rows: Array
    sources: Array
    reflectance: Array
    lamps: Array
    gains: LightGains | None = None


@dataclass(frozen=True)
class Parts:
    """The table's rows after the n texels': all elements, then every smaller part that was met.

    Attributes
    ----------
    start : (r, 3) float64 [W/m²]
        What the hierarchy says that they reflect.
    links : sequence of PartLinks
    element : (r,) int
        Whose light `start` is, or NOTHING.
    small : (r − elements,) int64
        Which parts the rows after the elements' are: their numbers less n (see `HitNumbers`), ascending.
    """

    start: Array
    links: Sequence[PartLinks]
    element: Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    small: Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


class HitNumbers:
    """Numbers what rays hit: n texels, parts of leaf elements after them, cells of texels at last.

    Parameters
    ----------
    local : LocalPass
    cells : TexelCells
    texel_count : int
    """

    def __init__(self, local: LocalPass, cells: TexelCells, texel_count: int) -> None:
        self.local, self.cells, self.texel_count = local, cells, texel_count
        self.elements = texel_count + len(local.reflected())
        """Where the sixteenths of elements begin."""
        self.first_cell = texel_count + len(local.parts)
        self.end = self.first_cell + len(cells)

    def cell(self, part: Array) -> Array:
        """Return (p,) the cells' own numbers of those that are cells, numbered less n."""
        return np.asarray(part - (self.first_cell - self.texel_count))


@dataclass(frozen=True)
class PartHits:
    """Parts of one kind that have looked already.

    Attributes
    ----------
    is_leaf : bool
        Parts of leaves, or cells.
    part : (p,) int
        Their numbers less n (see `HitNumbers`).
    sources : (p, rays) int32
        Numbered likewise.
    gains : LightGains or None
        What lights add, if that is known as well.
    """

    is_leaf: bool
    part: Array
    sources: Array
    gains: LightGains | None = None

    @property
    def rays(self) -> int:
        """That each gathers with."""
        return int(self.sources.shape[1])

    @property
    def shadow_rays(self) -> int:
        """Of each to every lamp."""
        return SHADOW_RAYS * self.rays // RAYS

    def take(self, chosen: Array) -> PartHits:
        """Return those of some parts, row numbers or a mask."""
        gains = None if self.gains is None else self.gains.take(chosen)
        return PartHits(self.is_leaf, self.part[chosen], self.sources[chosen], gains)


def gather_parts(
    numbers: HitNumbers,
    links: StoredLinks,
    resolve: Resolver,
    element: Array,
    reflectance: Array,
    known: Sequence[PartHits] = (),
    progress: Progress = SILENT,
) -> tuple[StoredLinks, Parts]:
    """Look from the parts that links met, and from those that these met.

    Parameters
    ----------
    links : StoredLinks
        Their sources are as `resolve` numbers them; they are numbered anew where they are, for they take
        more memory than all else.
    element : (n,) int32
        Of the texels: the leaf elements below them, or NOTHING.
    reflectance : (n, 3)
        Theirs.
    known : sequence of PartHits
        Those that need not be asked. Those that nothing meets are left out.

    Returns
    -------
    links : StoredLinks
        Their sources are rows of the table.
    parts : Parts
    """
    gathering = _SubCellGather(numbers, resolve, known)
    gathering.count(links.sources)
    gathering.count(links.aimed.sources)
    gathering.take_up()
    for _, part in progress.part(0.0, 0.7).each(range(ROUNDS)):
        gathering.ask_new(part)
        gathering.take_up()
    made, of = gathering.links(element, reflectance, progress.part(0.7, 1.0))
    start = values_of(numbers.local.reflected(), of)
    for sources in (links.sources, links.aimed.sources):
        gathering.rows.number(sources)
    return links, Parts(start, made, of, gathering.small)


def lit_footprints(numbers: HitNumbers, parts: PartHits) -> Footprints:
    """Return where parts ask for lamps' light."""
    if parts.is_leaf:
        return numbers.local.lit_parts(parts.part)
    return numbers.cells.lit(numbers.cell(parts.part))


class _SubCellGather:
    """Gathers round by round what parts see.

    Parameters
    ----------
    numbers : HitNumbers
    resolve : callable
    known : sequence of PartHits
    """

    def __init__(self, numbers: HitNumbers, resolve: Resolver, known: Sequence[PartHits] = ()) -> None:
        self._numbers, self._resolve = numbers, resolve
        self._local, self._cells = numbers.local, numbers.cells
        self._met = np.zeros(numbers.end - numbers.texel_count, dtype=np.int32)
        self._asked = np.zeros(len(self._met), dtype=bool)
        self._found: list[PartHits] = []
        self._known = [(some, np.zeros(len(some.part), dtype=bool)) for some in known]

    def count(self, sources: Array) -> None:
        """Note which parts were met."""
        for rows in tiles(len(sources), max(TILE_HITS // max(sources.shape[1], 1), 1)):
            some = sources[rows]
            parts = some[some >= self._numbers.texel_count] - self._numbers.texel_count
            self._met += np.bincount(parts, minlength=len(self._met)).astype(np.int32)

    def take_up(self) -> None:
        """Take the known parts that were met, and those that these met in turn.

        What nobody meets any more has no row in the table.
        """
        more = True
        while more:
            more = False
            for some, taken in self._known:
                met = np.flatnonzero(~taken & (self._met[some.part] > 0))
                if len(met):
                    more = taken[met] = self._asked[some.part[met]] = True
                    self.count(some.sources[met])

    def ask_new(self, progress: Progress) -> None:
        """Look from the parts that were met but not asked yet."""
        new = np.flatnonzero((self._met > 0) & ~self._asked)
        self._asked[new] = True
        often, leaf = self._met[new] >= OFTEN, new < self._numbers.first_cell - self._numbers.texel_count
        groups = [
            (is_leaf, rays, new[(leaf == is_leaf) & (often == (rays > RAYS))])
            for is_leaf in (True, False)
            for rays in (RAYS, MANY_RAYS)
        ]
        for (is_leaf, rays, part), of_group in progress.each(groups):
            if len(part) == 0:
                continue
            sources = self._gather(is_leaf, rays, part, of_group)
            self.count(sources)
            self._found.append(PartHits(is_leaf, part, sources))

    def _gather(self, is_leaf: bool, rays: int, part: Array, progress: Progress) -> Array:
        if is_leaf:
            return self._local.gather_at_parts(part, rays, self._resolve, progress)
        return self._cells.gather(self._numbers.cell(part), rays, self._resolve, progress)

    @cached_property
    def small(self) -> Array:
        """(s,) int64, ascending: the sixteenths of elements that were met, and the cells that were asked.

        Whole elements have rows whether met or not. Where nobody gathered, the hierarchy's values
        stand; a cell has none.
        """
        elements, leaf_parts = len(self._local.reflected()), len(self._local.parts)
        met = np.flatnonzero(self._met[elements:leaf_parts]) + elements
        return np.concatenate([met, np.flatnonzero(self._asked[leaf_parts:]) + leaf_parts])

    @cached_property
    def rows(self) -> _Rows:
        """What gives sources the rows of the table."""
        return _Rows(self._numbers.elements, self.small + self._numbers.texel_count)

    def links(self, element: Array, reflectance: Array, progress: Progress) -> tuple[list[PartLinks], Array]:
        """Make the links of the parts asked, and tell whose light rows start with."""
        local, cells, first = self._local, self._cells, self._numbers.texel_count
        of_leaves = self.small[self.small < len(local.parts)]
        of_cells = self._numbers.cell(self.small[len(of_leaves) :])
        whole = np.arange(self._numbers.elements - first)
        start = [whole, local.parts.leaf_of(of_leaves), element[cells.texel_of(of_cells)]]
        asked = [*(some.take(taken) for some, taken in self._known if taken.any()), *self._found]
        made = []
        for found, of_kind in progress.each(asked):
            part = found.part
            if found.is_leaf:
                share = local.part_reflectance(part)
            else:
                share = reflectance[cells.texel_of(self._numbers.cell(part))]
            if found.gains is None:
                gains = local.new_gains(len(part))
                at = lit_footprints(self._numbers, found)
                lamps = local.direct(at, found.shadow_rays, gains, progress=of_kind)
            else:
                gains, lamps = found.gains, local.lit_by(found.gains)
            rows, sources = self.rows(first + part), self.rows(found.sources)
            made.append(PartLinks(rows, sources, reflectance=share, lamps=lamps, gains=gains))
        return made, np.concatenate(start)


class _Rows:
    """Gives numbers of what was hit the rows of the table: small parts come after the elements.

    Parameters
    ----------
    first : int
        The first row of a small part.
    small : (s,) int64
        The numbers of those that have a row, ascending. What else is small answers nothing.
    """

    def __init__(self, first: int, small: Array) -> None:
        self._first, self.small = first, small

    def __call__(self, sources: Array) -> Array:
        """Return the rows of (k, …) sources."""
        result = sources.copy()
        self.number(result)
        return result

    def number(self, sources: Array) -> None:
        """Turn (k, …) sources into rows where they are."""
        for some in tiles(len(sources), max(TILE_HITS // max(sources[:1].size, 1), 1)):
            doubtful = sources[some] >= self._first
            if not doubtful.any():
                continue
            wanted = sources[some][doubtful]
            place = np.searchsorted(self.small, wanted)
            there = self.small.take(place, mode="clip") == wanted
            sources[some][doubtful] = np.where(there, self._first + place, NOTHING)


class PartSweeps:
    """Updates the parts' rows of a table of reflected radiosity.

    Parameters
    ----------
    parts : Parts
    texel_count, threads : int
    """

    def __init__(self, parts: Parts, texel_count: int, threads: int) -> None:
        self._links, self._surfaces = parts.links, texel_count + len(parts.start)
        self._texel_count = texel_count
        self._means = [Means(links.sources, links.lamps.shape[1], threads) for links in parts.links]
        self._unseen: Array | None = None

    def lit_or_unknown(self, direct: Array) -> Array:
        """Return (table rows − beyond,) bool: what direct light (n, 3) meets, and parts that gather none."""
        lit = np.ones(self._surfaces, dtype=bool)
        lit[: self._texel_count] = marked(self._texel_count, lambda rows: direct[rows].any(axis=1))
        for links in self._links:
            lit[links.rows] = links.lamps.any(axis=1)
        return lit

    def reach(self, reached: Array) -> bool:
        """Mark the parts that see something marked in a (table rows,) mask; False if they all were."""
        more = False
        for links in self._links:
            dark = np.flatnonzero(~reached[links.rows])
            seen = dark[reached[links.sources[dark]].any(axis=1)]
            reached[links.rows[seen]] = True
            more |= len(seen) > 0
        return more

    def sweep(self, table: Array, changed: Array, still: float) -> None:
        """Update the parts' rows, among themselves until they rest, in `SWEEPS` sweeps at most.

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
                irradiance = links.lamps + means.of(table, fresh)
                reflected = (links.reflectance * irradiance).astype(np.float32)
                moved = np.abs(reflected - table[links.rows]).max(axis=1) > still
                if moved.any():
                    news.append((links.rows[moved], reflected[moved]))
            fresh[:] = False
            for rows, values in news:
                table[rows] = values
                fresh[rows] = changed[rows] = True
            if not news:
                break
        # What changed last no part has seen yet: the next call begins with it.
        self._unseen = fresh
