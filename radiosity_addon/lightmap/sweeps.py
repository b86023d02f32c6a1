"""Jacobi sweeps over the texels along stored gather hits: no ray is traced.

The unknowns are the texels and those parts of leaf elements that gather rays met where no texel is:
backs, and surfaces without a lightmap. Those parts gather too, so that what the coarse hierarchy
smeared across a wall's foot or into a closed box does not come back.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field, replace

import numpy as np

from ..solver.aiming import AimedRays
from ..solver.arrays import Array
from ..solver.local_pass import LocalPass, Resolver
from ..solver.parallel import chunk_steps
from ..solver.scene import Scene
from ..solver.steps import drain, scaled
from .interpolate import Interpolation
from .texel_geometry import TexelGeometry
from .texel_materials import texel_materials

CHUNK_HITS = 1 << 18
"""Hits averaged at once: their values stay in the processor's cache."""

TOLERANCE = 2e-4
"""Largest change of any texel, relative to the mean, at which the sweeps end by default. Most texels are
there at once; a dark closet next to a bright room, into which the hierarchy's elements leak across the
wall's foot, takes as many sweeps as light would bounce in it."""

LEAF_RAYS = 64
"""Gather rays of a part of a leaf element."""

LEAF_ROUNDS = 3
"""Rounds of asking the leaves that leaves met; beyond, the hierarchy's values stand."""

STILL = 0.1
"""A row of the table moves once it is off by this part of the tolerance: what sees only rows that rest
need not be asked again, and most rest after a few sweeps."""

SWEPT = 0.7
"""A sweep takes the other part of the progress left: how many there will be is not known."""

LEAF_SWEEPS = 24
"""Sweeps among the leaves for each over the texels, at most: they are few."""


@dataclass(frozen=True)
class TexelLight:
    """Irradiance of n texels.

    Attributes
    ----------
    direct, indirect : (n, 3) float64 [W/m²]
        Their sum is the whole.
    error : float
        Estimate of the whole's RMS error, relative to its mean.
    """

    direct: Array
    indirect: Array
    error: float = 0.0


@dataclass(frozen=True)
class StoredLinks:
    """What the gather points saw, and how they speak for the texels.

    Attributes
    ----------
    sources : (g, rays) int32
        Texels by number, parts of leaf elements after them, NOTHING and the sky negative.
    spread : Interpolation
    aimed : AimedRays
        What some of the points ask apart.
    """

    sources: Array
    spread: Interpolation
    aimed: AimedRays = field(default_factory=AimedRays.none)

    def irradiance_steps(self, table: Array, threads: int = 0) -> Generator[float, None, Array]:
        """Compute (n, 3) what a table of radiosity sends to the texels; yields the fraction done."""
        mean = yield from mean_steps(table, self.sources, threads)
        return self.spread_out(table, mean, threads)

    def spread_out(self, table: Array, mean: Array, threads: int = 0) -> Array:
        """Add what aimed rays brought to (g, 3) `mean`, and carry it from the gather points to the texels."""
        aimed = self.aimed
        for channel in range(table.shape[1] if len(aimed.row) else 0):
            values = table[:, channel][aimed.sources]
            values[aimed.sources < 0] = 0.0
            mean[aimed.row, channel] += np.einsum("ak,ak->a", values, aimed.weights)
        return self.spread(mean, threads)


def sweep_steps(
    scene: Scene,
    local: LocalPass,
    geometry: TexelGeometry,
    links: StoredLinks,
    lamps: Array,
    resolve: Resolver,
    sweeps: int,
    tolerance: float = TOLERANCE,
    gain: Array | None = None,
) -> Generator[float, None, TexelLight]:
    """Iterate H = direct + Σ ρ H over the stored hits, started from the hierarchy's solution.

    Parameters
    ----------
    lamps : (n, 3) float64
        Irradiance of the texels straight from lamps and emissive surfaces.
    sweeps : int
        At most so many, …
    tolerance : float
        … or until no texel changes by more than this part of the mean.
    gain : (n,) float64 or None
        How much brighter than their mean the texels are where hits ask them; None is 1.

    Yields
    ------
    fraction : float
        Of an unknown number of sweeps: each takes its part of what is left.
    """
    texel_count = len(geometry)
    reflectance, _ = texel_materials(scene, geometry)
    if gain is not None:
        reflectance = reflectance * gain[:, None]
    leaves = _Leaves(local, texel_count)
    links = yield from scaled(leaves.gather_steps(links, resolve), 0.0, 0.1)
    # Rows: texels, elements, their cells that were met, then the sky and nothing. Columns lie one
    # after the other in memory.
    sky = local.beyond()
    surfaces = texel_count + len(leaves.element)
    table = np.zeros((surfaces + len(sky), 3), dtype=np.float32, order="F")
    table[surfaces:] = sky
    direct = lamps
    if sky.any():
        # The sky's light is direct: its share of the same rays.
        from_sky = yield from scaled(links.irradiance_steps(table, local.threads), 0.1, 0.2)
        direct = lamps + np.maximum(from_sky, 0.0)

    table[:texel_count] = local.reflected_at(geometry.triangle, geometry.barycentric)
    table[texel_count:surfaces] = local.reflected()[leaves.element]
    table[:surfaces][~_reached(links, leaves, direct, len(sky))] = 0.0
    indirect, left = np.zeros_like(direct), 0.8
    changed = np.ones(len(table), dtype=bool)
    means = _Means(links.sources, table.shape[1], local.threads)
    still = STILL * tolerance * float(table[:texel_count].mean()) if texel_count else 0.0
    for _ in range(sweeps):
        leaves.sweep(table, changed, still)
        table[surfaces:] = 0.0
        steps = means.steps(table, changed)
        mean = yield from scaled(steps, 1.0 - left, 1.0 - SWEPT * left)
        left *= SWEPT
        indirect = np.maximum(links.spread_out(table, mean.copy(), local.threads), 0.0)
        table[surfaces:] = sky
        radiosity = (reflectance * (direct + indirect)).astype(np.float32)
        change = np.abs(radiosity - table[:texel_count]).max(axis=1)
        changed[:] = False
        changed[:texel_count] = change > still
        table[:texel_count][changed[:texel_count]] = radiosity[changed[:texel_count]]
        if change.max(initial=0.0) <= tolerance * radiosity.mean():
            break
    return TexelLight(direct, indirect, estimated_error(links, table, direct + indirect, local.threads))


def estimated_error(links: StoredLinks, table: Array, irradiance: Array, threads: int = 0) -> float:
    """Estimate the RMS error of texels' irradiance, relative to its mean: the noise of the gather rays.

    Half of a point's rays guess its irradiance with √2 times the noise of all of them, and share
    that half with the whole: so the two differ by about the noise of the whole. Spread over the
    texels as the irradiance is, noise that interpolation averages away drops out.

    Parameters
    ----------
    links : StoredLinks
    table : (rows, 3) float32
        The radiosity that the links' sources had in the end, the sky's among it.
    irradiance : (n, 3) float64
        Of the texels, direct and indirect.
    """
    mean = float(irradiance.mean()) if len(irradiance) else 0.0
    if mean <= 0.0:
        return 0.0
    half = links.sources.shape[1] // 2
    whole = drain(mean_steps(table, links.sources, threads))
    part = drain(mean_steps(table, np.ascontiguousarray(links.sources[:, :half]), threads))
    noise = links.spread(part - whole)
    return float(np.sqrt((noise**2).mean())) / mean


def _reached(links: StoredLinks, leaves: _Leaves, direct: Array, beyond: int) -> Array:
    """Return (table rows − beyond,) bool: what light can get to along the links, after any number of bounces.

    The sweeps' fixed point is 0 elsewhere. Found outright, because from what the hierarchy leaked into
    a sealed box they would only fade, by the reflectance a sweep.
    """
    reached = leaves.lit_or_unknown(direct)
    padded = np.append(reached, np.zeros(beyond, dtype=bool))  # nothing, and the sky, whose light is direct
    aims = np.zeros(len(links.sources), dtype=bool)
    while True:
        dark, step = np.flatnonzero(~aims), max(CHUNK_HITS // links.sources.shape[1], 1)
        for first in range(0, len(dark), step):
            some = dark[first : first + step]
            aims[some] = padded[links.sources[some]].any(axis=1)
        aims[links.aimed.row[padded[links.aimed.sources].any(axis=1)]] = True
        more = ~padded[: len(direct)] & links.spread.any_of(aims)
        padded[: len(direct)] |= more
        if not (leaves.reach(padded) or more.any()):
            return padded[: len(reached)]


class _Leaves:
    """The parts of leaf elements that gather rays met, and what they see in turn.

    Attributes
    ----------
    element : (k,) int
        The elements that the table's rows after the texels are of: all of them, then one more row for
        each cell met.
    """

    def __init__(self, local: LocalPass, texel_count: int) -> None:
        self._local, self._texel_count = local, texel_count
        self._rows = np.zeros(0, dtype=np.int64)
        self._means: _Means | None = None
        self._cells = np.zeros(0, dtype=np.int64)
        self.element = np.arange(len(local.reflected()))

    def gather_steps(self, links: StoredLinks, resolve: Resolver) -> Generator[float, None, StoredLinks]:
        """Look from the parts the links met, and from those that these met; yields the fraction done.

        Returns
        -------
        links : StoredLinks
            Their sources are rows of the table.
        """
        local, texel_count = self._local, self._texel_count
        surfaces = texel_count + len(local.parts)
        met = np.zeros(surfaces + len(local.beyond()), dtype=bool)
        known = np.zeros_like(met)
        met[links.sources.ravel()] = True
        met[links.aimed.sources.ravel()] = True
        seen, parts, stages = [], [np.zeros(0, dtype=np.int64)], LEAF_ROUNDS + 1
        for turn in range(LEAF_ROUNDS):
            part = np.flatnonzero(met[texel_count:surfaces] & ~known[texel_count:surfaces])
            if len(part) == 0:
                break
            known[texel_count + part] = True
            rays = local.gather_at_parts(part, LEAF_RAYS, resolve)
            found = yield from scaled(rays, turn / stages, (turn + 1) / stages)
            met[found.ravel()] = True
            parts.append(part)
            seen.append(found)
        if not seen:
            return links
        elements = len(self.element)
        self._cells = elements + np.flatnonzero(met[texel_count + elements : surfaces])
        self.element = np.append(self.element, local.parts.leaf_of(self._cells))
        gathered = np.concatenate(parts)
        self._rows = self._renumbered(texel_count + gathered)
        self._sources = self._renumbered(np.concatenate(seen))
        self._reflectance = local.part_reflectance(gathered)
        self._lamps = yield from scaled(local.part_direct(gathered), LEAF_ROUNDS / stages, 1.0)
        aimed = replace(links.aimed, sources=self._renumbered(links.aimed.sources))
        return replace(links, sources=self._renumbered(links.sources), aimed=aimed)

    def _renumbered(self, sources: Array) -> Array:
        """Give the cells the rows that follow the elements'."""
        first = len(self.element) - len(self._cells) + self._texel_count
        cells = sources >= first
        if not cells.any():
            return sources
        result = sources.copy()
        result[cells] = first + np.searchsorted(self._cells, sources[cells] - self._texel_count)
        return result

    def lit_or_unknown(self, direct: Array) -> Array:
        """Return (table rows − 2,) bool: what direct light (n, 3) meets, and parts that gather none."""
        lit = np.ones(self._texel_count + len(self.element), dtype=bool)
        lit[: self._texel_count] = direct.any(axis=1)
        if len(self._rows):
            lit[self._rows] = self._lamps.any(axis=1)
        return lit

    def reach(self, reached: Array) -> bool:
        """Mark the leaves that see something marked in a (table rows,) mask; False if they all were."""
        dark = np.flatnonzero(~reached[self._rows])
        if len(dark) == 0:
            return False
        seen = reached[self._sources[dark]].any(axis=1)
        reached[self._rows[dark[seen]]] = True
        return bool(seen.any())

    def sweep(self, table: Array, changed: Array, still: float) -> None:
        """Update the leaves' rows of the table of reflected radiosity, among themselves to convergence.

        Parameters
        ----------
        changed : (table rows,) bool
            What changed since the last call; rows that change now are added.
        still : float
            Rows that would change by less stay as they are.
        """
        if not len(self._rows):
            return
        if self._means is None:
            self._means = _Means(self._sources, table.shape[1], self._local.threads)
        fresh = changed.copy()
        for _ in range(LEAF_SWEEPS):
            irradiance = self._lamps + drain(self._means.steps(table, fresh))
            reflected = (self._reflectance * irradiance).astype(np.float32)
            moved = np.abs(reflected - table[self._rows]).max(axis=1) > still
            if not moved.any():
                break
            rows = self._rows[moved]
            table[rows] = reflected[moved]
            fresh[:] = False
            fresh[rows] = changed[rows] = True


class _Means:
    """Means over rows of sources, of which only those are made anew that see something changed.

    Parameters
    ----------
    sources : (g, rays) int32
    channels, threads : int
    """

    def __init__(self, sources: Array, channels: int, threads: int) -> None:
        self._sources, self._threads = sources, threads
        self._mean = np.zeros((len(sources), channels))
        self._known = False

    def steps(self, table: Array, changed: Array) -> Generator[float, None, Array]:
        """Compute (g, channels) the means of the table's rows; yields the fraction done.

        Parameters
        ----------
        changed : (table rows,) bool
            Which rows changed since the last call; the first call asks all.
        """
        columns = _columns(table)

        def average(rows: slice) -> None:
            seen = self._sources[rows]
            if not self._known:
                self._mean[rows] = _mean_of(columns, seen)
                return
            again = np.flatnonzero(changed.take(seen, mode="wrap").any(axis=1))
            if len(again):
                self._mean[rows.start + again] = _mean_of(columns, seen[again])

        if not self._known or changed.any():
            chunk = max(CHUNK_HITS // max(self._sources.shape[1], 1), 1)
            yield from chunk_steps(average, len(self._sources), chunk, self._threads)
        self._known = True
        return self._mean


def mean_of_sources(table: Array, sources: Array) -> Array:
    """Return (g, 3): the mean of the table's rows each gather point saw."""
    return drain(mean_steps(table, sources, 1))


def mean_steps(table: Array, sources: Array, threads: int) -> Generator[float, None, Array]:
    """Compute the same; yields the fraction done."""
    result = np.empty((len(sources), table.shape[1]))
    columns = _columns(table)

    def average(rows: slice) -> None:
        result[rows] = _mean_of(columns, sources[rows])

    yield from chunk_steps(average, len(sources), max(CHUNK_HITS // max(sources.shape[1], 1), 1), threads)
    return result


def _columns(table: Array) -> list[Array]:
    """Return the table's channels, each in one piece of memory."""
    return [np.ascontiguousarray(table[:, channel]) for channel in range(table.shape[1])]


def _mean_of(columns: list[Array], sources: Array) -> Array:
    """Return (r, channels) means over the columns' values at (r, rays) sources."""
    # "wrap" lets negative numbers count from the end.
    seen = sources.astype(np.intp)
    return np.stack([column.take(seen, mode="wrap").mean(axis=1) for column in columns], axis=1)
