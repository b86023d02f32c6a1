"""What gather rays met where no texel answers, and what it sees in turn.

Parts of leaf elements answer on backs and surfaces without a lightmap, cells of texels where geometry
divides a texel. They gather as texels do, so that what the coarse hierarchy smeared across a wall's
foot or into a closed box does not come back.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..solver.arrays import Array
from ..solver.local_pass import NOTHING, LocalPass, Resolver
from ..solver.steps import drain, scaled
from .source_means import Means
from .stored_links import StoredLinks
from .texel_cells import TexelCells

LEAF_RAYS = 64
"""Gather rays of a part of a leaf element."""

ROUNDS = 3
"""Rounds of asking the parts that parts met; beyond, the hierarchy's values stand for leaves."""

SWEEPS = 4
"""Sweeps among the parts for each over the texels, at most: they are few."""


@dataclass(frozen=True)
class PartLinks:
    """What p parts of one kind see.

    Attributes
    ----------
    rows : (p,) int64
        Theirs in the table of radiosity.
    sources : (p, rays) int32
        Rows of the table, and negative numbers as in `StoredLinks`.
    reflectance : (p, 3) float64
    lamps : (p, 3) float64 [W/m²]
        Irradiance straight from lamps and emissive faces.
    """

    rows: Array
    sources: Array
    reflectance: Array
    lamps: Array


@dataclass(frozen=True)
class Parts:
    """The table's rows after the n texels': all elements, then every smaller part that was met.

    Attributes
    ----------
    start : (r, 3) float64 [W/m²]
        What the hierarchy says that they reflect.
    links : sequence of PartLinks
    """

    start: Array
    links: Sequence[PartLinks]


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


def gather_parts(
    numbers: HitNumbers, links: StoredLinks, resolve: Resolver, reflected: Array, reflectance: Array
) -> Generator[float, None, tuple[StoredLinks, Parts]]:
    """Look from the parts that links met, and from those that these met; yields the fraction done.

    Parameters
    ----------
    links : StoredLinks
        Their sources are as `resolve` numbers them.
    reflected, reflectance : (n, 3)
        Of the texels: what the hierarchy says they reflect, and the part of irradiance that they do.

    Returns
    -------
    links : StoredLinks
        Their sources are rows of the table.
    parts : Parts
    """
    local, cells = numbers.local, numbers.cells
    met = np.zeros(numbers.end + len(local.beyond()), dtype=bool)
    met[links.sources.ravel()] = True
    met[links.aimed.sources.ravel()] = True
    known = np.zeros_like(met)
    known[: numbers.texel_count] = known[numbers.end :] = True
    of_leaves, of_cells, stages = _Found(), _Found(), ROUNDS + 1
    for turn in range(ROUNDS):
        new = np.flatnonzero(met & ~known)
        if len(new) == 0:
            break
        known[new] = True
        leaf, cell = new[new < numbers.first_cell], new[new >= numbers.first_cell]
        rays = local.gather_at_parts(leaf - numbers.texel_count, LEAF_RAYS, resolve)
        found = yield from scaled(rays, turn / stages, (turn + 0.5) / stages)
        of_leaves.add(leaf, found)
        met[found.ravel()] = True
        rays = cells.gather(cell - numbers.first_cell, resolve)
        found = yield from scaled(rays, (turn + 0.5) / stages, (turn + 1) / stages)
        of_cells.add(cell, found)
        met[found.ravel()] = True
    # Whole elements have rows whether met or not: where nobody gathered, the hierarchy's values stand.
    small = np.flatnonzero(met[: numbers.first_cell])
    small = small[small >= numbers.elements]
    rows = _Rows(numbers, np.concatenate([small, of_cells.number]))
    start = np.concatenate(
        [
            local.reflected(),
            local.reflected()[local.parts.leaf_of(small - numbers.texel_count)],
            reflected[cells.texel_of(of_cells.number - numbers.first_cell)],
        ]
    )
    made = []
    if len(of_leaves.number):
        part = of_leaves.number - numbers.texel_count
        lamps = yield from scaled(local.part_direct(part), ROUNDS / stages, (ROUNDS + 0.5) / stages)
        made.append(of_leaves.links(rows, local.part_reflectance(part), lamps))
    if len(of_cells.number):
        cell = of_cells.number - numbers.first_cell
        lamps = yield from scaled(cells.direct(cell), (ROUNDS + 0.5) / stages, 1.0)
        made.append(of_cells.links(rows, reflectance[cells.texel_of(cell)], lamps))
    aimed = replace(links.aimed, sources=rows(links.aimed.sources))
    return replace(links, sources=rows(links.sources), aimed=aimed), Parts(start, made)


class _Found:
    """Gathers round by round what parts saw."""

    def __init__(self) -> None:
        self._numbers: list[Array] = [np.zeros(0, dtype=np.int64)]
        self._sources: list[Array] = []

    def add(self, number: Array, sources: Array) -> None:
        self._numbers.append(number)
        self._sources.append(sources)

    @property
    def number(self) -> Array:
        """All parts, by ascending number."""
        return np.sort(np.concatenate(self._numbers))

    def links(self, rows: _Rows, reflectance: Array, lamps: Array) -> PartLinks:
        """Return links of the parts, given by ascending number as what they reflect and get from lamps."""
        order = np.argsort(np.concatenate(self._numbers))
        sources = np.concatenate(self._sources)[order]
        return PartLinks(rows(self.number), rows(sources), reflectance, lamps)


class _Rows:
    """Gives numbers of what was hit the rows of the table: small parts come after the elements.

    Parameters
    ----------
    numbers : HitNumbers
    small : (s,) int64
        Ascending. What else is small answers nothing.
    """

    def __init__(self, numbers: HitNumbers, small: Array) -> None:
        self._first, self._small = numbers.elements, small

    def __call__(self, sources: Array) -> Array:
        """Return the rows of sources of any shape."""
        doubtful = sources >= self._first
        if not doubtful.any():
            return sources
        result, wanted = sources.copy(), sources[doubtful]
        place = np.searchsorted(self._small, wanted)
        there = self._small.take(place, mode="clip") == wanted
        result[doubtful] = np.where(there, self._first + place, NOTHING)
        return result


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

    def lit_or_unknown(self, direct: Array) -> Array:
        """Return (table rows − beyond,) bool: what direct light (n, 3) meets, and parts that gather none."""
        lit = np.ones(self._surfaces, dtype=bool)
        lit[: self._texel_count] = direct.any(axis=1)
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
        """Update the parts' rows, among themselves to convergence.

        Parameters
        ----------
        changed : (table rows,) bool
            What changed since the last call; rows that change now are added.
        still : float
            Rows that would change by less stay as they are.
        """
        fresh = changed.copy()
        for _ in range(SWEEPS):
            news = []
            for links, means in zip(self._links, self._means, strict=True):
                irradiance = links.lamps + drain(means.steps(table, fresh))
                reflected = (links.reflectance * irradiance).astype(np.float32)
                moved = np.abs(reflected - table[links.rows]).max(axis=1) > still
                if moved.any():
                    news.append((links.rows[moved], reflected[moved]))
            if not news:
                break
            fresh[:] = False
            for rows, values in news:
                table[rows] = values
                fresh[rows] = changed[rows] = True
