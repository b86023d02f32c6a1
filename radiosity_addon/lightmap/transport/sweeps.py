"""Jacobi sweeps over the texels along stored gather hits: no ray is traced.

The unknowns are the texels and the parts that gather rays met where no texel answers (`sub_cells.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, across, row_numbers, tiles, trim
from ...solver.gather import LightGains
from ..points import Smoothing, choose_smoothing, columns
from ..texels import TexelGeometry
from .gather_links import GatherLinks
from .ray_runs import noise_weights, runs_with
from .source_means import CHUNK_HITS, SourceMeans, by_channel, mean_of_sources
from .sub_cells import SubCells, SubCellSweeps
from .traced_texels import LightingRecord
from .warm_start import WarmStart

TOLERANCE = 2e-4
"""Largest change of any texel, relative to the mean, at which the sweeps end by default. Most texels are
there at once; a dark closet next to a bright room, into which the hierarchy's elements leak across the
wall's foot, takes as many sweeps as light would bounce in it."""

REST_SHARE = 0.1
"""A row of the table moves once it is off by this part of the tolerance: rows that see only resting rows
are not computed again, and most rest after a few sweeps."""

SWEPT = 0.3
"""A sweep takes this part of the progress left: how many there will be is not known."""


@dataclass(frozen=True)
class TexelLight:
    """Irradiance of n texels.

    Attributes
    ----------
    direct, indirect : (n, 3) float64 [W/m²]
        Their sum is the whole.
    error : float
        Estimate of the whole's RMS error, relative to its mean; 0 if not requested.
    table : (surfaces, 3) float32 or None [W/m²]
        What texels and cells reflected in the end.
    kept : RelightableTexels or None
        The data to relight them, if it is kept, …
    traced : LightingRecord or None
        … and how they were lit.
    noise : (n,) float32 or None [W/m²]
        What `error` is the mean of: the estimated error of each texel.
    state : (n,) uint8 or None
        What geometry does to each, see `TEXEL_STATES`.
    smoothing : Smoothing or None
        How noise was shared, if it was.
    """

    direct: Array
    indirect: Array
    error: float = 0.0
    table: Array | None = None
    kept: RelightableTexels | None = None
    traced: LightingRecord | None = None
    noise: Array | None = None
    state: Array | None = None
    smoothing: Smoothing | None = None


@dataclass(frozen=True)
class TexelTransport:
    """How light gets from texel to texel, whatever the lights: geometry and reflectance alone.

    Attributes
    ----------
    links : GatherLinks
    cells : SubCells
    reflectance : (n, 3) float64
        Of the texels.
    """

    links: GatherLinks
    cells: SubCells
    reflectance: Array


@dataclass(frozen=True)
class RelightableTexels:
    """How light gets to n texels from each light, and on from texel to texel.

    Attributes
    ----------
    transport : TexelTransport
        Its cells keep gains as well.
    gains : LightGains
        Of the texels.
    element : (n,) int32
        The leaf element below each, whose light the sweeps start with, or NOTHING.
    sweeps, tolerance
        As for `sweep`.
    warm_start : WarmStart
        What was solved before, the bake's own light first.
    smoothing : Smoothing
        How noise is shared, chosen for the bake's own light.
    """

    transport: TexelTransport
    gains: LightGains
    element: Array
    sweeps: int
    tolerance: float
    warm_start: WarmStart
    smoothing: Smoothing


@dataclass(frozen=True, eq=False)
class SmoothingChoice:
    """How noise is to be shared: as is `known`, or as is best for the light that is found.

    alike: (n,) uint8, see `Smoothing`.
    """

    geometry: TexelGeometry
    alike: Array
    known: Smoothing | None = None


def sweep(
    transport: TexelTransport,
    start: Array,
    lamps: Array,
    beyond: Array,
    sweeps: int,
    tolerance: float = TOLERANCE,
    threads: int = 0,
    estimate: bool = True,
    smooth: SmoothingChoice | None = None,
    seen: Callable[[Array], None] | None = None,
    scratch: Scratch | None = None,
    progress: Progress = SILENT,
) -> TexelLight:
    """Iterate H = direct + Σ ρ H over the stored hits, started from the hierarchy's solution.

    Parameters
    ----------
    transport : TexelTransport
    start : (n, 3) float64 [W/m²]
        What the texels reflect, by the hierarchy.
    lamps : (n, 3) float64 [W/m²]
        Irradiance of the texels straight from lamps and emissive surfaces.
    beyond : (sky cells + 2, 3) float64 [W/m²]
        Radiosity of the sky and of nothing, see `table_end`.
    sweeps : int
        Maximum number, …
    tolerance : float
        … or until no texel changes by more than this part of the mean.
    estimate : bool
        Whether the error is estimated.
    smooth : SmoothingChoice or None
        How noise is shared between texels in the end; None if it is not.
    seen : callable or None
        Is given the (n, 3) irradiance after every sweep [W/m²], to be looked at.
    scratch : Scratch or None
        Makes the texels' arrays; None keeps them in memory.
    """
    links, reflectance, texel_count = transport.links, transport.reflectance, len(lamps)
    cells = SubCellSweeps(transport.cells, texel_count, threads, scratch)
    # Columns lie one after the other in memory.
    surfaces = texel_count + len(transport.cells.start)
    table = np.zeros((surfaces + len(beyond), 3), dtype=np.float32, order="F")
    table[surfaces:] = beyond
    direct, scratch = lamps, scratch or Scratch()
    if beyond.any():
        # The sky's light is direct: its share of the same rays.
        direct = links.irradiance(table, threads, scratch, progress.part(0.0, 0.1))
        for rows in tiles(texel_count):
            direct[rows] = lamps[rows] + np.maximum(direct[rows], 0.0)

    for rows in tiles(texel_count):
        table[rows] = start[rows]
    del start
    of_cells = table[texel_count:surfaces]
    for rows in tiles(len(of_cells)):
        of_cells[rows] = transport.cells.start[rows]
    reached = _reached(links, cells, direct, len(beyond))
    for rows in tiles(surfaces):
        table[rows][~reached[rows]] = 0.0
    del reached
    indirect = scratch.zeros(direct.shape)
    changed = np.ones(len(table), dtype=bool)
    means = SourceMeans(links.sources, table.shape[1], threads, links.tints, scratch)
    still = REST_SHARE * tolerance * float(table[:texel_count].mean()) if texel_count else 0.0
    for _, turn in zip(range(sweeps), progress.part(0.1, 1.0).turns(SWEPT), strict=False):
        cells.sweep(table, changed, still)
        table[surfaces:] = 0.0
        mean = means.of(table, changed, turn)
        del indirect
        # What aimed rays bring is added to it.
        whole = by_channel(len(mean), table.shape[1], scratch)
        for rows in tiles(len(mean)):
            whole[rows] = mean[rows]
        indirect = links.spread_out(table, whole, threads, scratch)
        del whole
        table[surfaces:] = beyond
        changed[:] = False
        largest, total = 0.0, 0.0
        for rows in tiles(texel_count):
            indirect[rows] = np.maximum(indirect[rows], 0.0)
            radiosity = (reflectance[rows] * (direct[rows] + indirect[rows])).astype(np.float32)
            change = across(np.maximum, np.abs(radiosity - table[rows]))
            moved = change > still
            changed[rows] = moved
            table[rows][moved] = radiosity[moved]
            largest = max(largest, float(change.max()))
            total += float(radiosity.sum(dtype=np.float64))
        if seen is not None:
            seen(direct + indirect)
        if largest <= tolerance * total / max(3 * texel_count, 1):
            break
    noise = estimated_noise(links, table, threads, scratch) if estimate else None
    smoothing, shared = None, None
    if smooth is not None:
        parts = [indirect, *([_difference(direct, lamps, scratch)] if beyond.any() else [])]
        if smooth.known is not None:
            smoothing, shared = smooth.known, smooth.known(smooth.geometry, columns(parts, scratch), threads)
        elif noise is not None:
            smoothing, shared = choose_smoothing(smooth.geometry, smooth.alike, parts, noise, threads)
        del parts
    if shared is not None:
        for rows in tiles(texel_count):
            indirect[rows] = np.maximum(shared[rows, :3], 0.0)
            if beyond.any():
                direct[rows] = lamps[rows] + np.maximum(shared[rows, -3:], 0.0)
    if noise is None:
        return TexelLight(direct, indirect, 0.0, table[:surfaces], smoothing=smoothing)
    error = relative_error(noise, direct, indirect)
    each = scratch.empty(texel_count, np.float32)
    for rows in tiles(texel_count):
        each[rows] = np.sqrt((noise[rows] ** 2).mean(axis=1))
    return TexelLight(direct, indirect, error, table[:surfaces], noise=each, smoothing=smoothing)


def _difference(whole: Array, part: Array, scratch: Scratch) -> Array:
    """Return (n, 3) `whole` without `part`."""
    result = scratch.empty(whole.shape)
    for rows in tiles(len(result)):
        result[rows] = whole[rows] - part[rows]
    return result


def relative_error(noise: Array, *irradiance: Array) -> float:
    """Return the RMS of (n, 3) noise, relative to the mean of the sum of irradiances (n, 3)."""
    squares = total = 0.0
    for rows in tiles(len(noise)):
        squares += float((noise[rows] ** 2).sum())
        total += sum(float(part[rows].sum()) for part in irradiance)
    return float(np.sqrt(squares / noise.size)) / (total / noise.size) if total > 0.0 else 0.0


def estimated_noise(
    links: GatherLinks, table: Array, threads: int = 0, scratch: Scratch | None = None
) -> Array:
    """Estimate (n, 3) the error of texels' irradiance: the noise of the gather rays [W/m²].

    Half of a point's rays guess its irradiance with √2 times the noise of all of them, and share
    that half with the whole: so the two differ by about the noise of the whole. Spread over the
    texels as the irradiance is, noise that interpolation averages away drops out.

    Parameters
    ----------
    links : GatherLinks
    table : (rows, 3) float32
        The radiosity that the links' sources had in the end, the sky's among it.
    """
    half = links.sources.shape[1] // 2
    whole = mean_of_sources(table, links.sources, threads, scratch=scratch, tints=links.tints)
    part = mean_of_sources(table, links.sources, threads, half, scratch, links.tints)
    count = None if links.run is None else runs_with(links.run)
    for rows in tiles(len(part)):
        part[rows] -= whole[rows]
        if links.run is not None and count is not None:
            several = np.flatnonzero(count[rows] > 1)
            weights = noise_weights(links.run[rows][several], count[rows][several])
            part[rows][several] = weights[:, None] * whole[rows][several]
    del whole
    return links.from_runs(part, scratch=scratch)


def _reached(links: GatherLinks, cells: SubCellSweeps, direct: Array, beyond: int) -> Array:
    """Return (table rows − beyond,) bool: what light can get to along the links, after any number of bounces.

    The sweeps' fixed point is 0 elsewhere. Found outright, because from what the hierarchy leaked into
    a sealed box they would only fade, by the reflectance a sweep.
    """
    reached = cells.lit_or_unknown(direct)
    padded = np.append(reached, np.zeros(beyond, dtype=bool))  # nothing, and the sky, whose light is direct
    aims = np.zeros(len(links.sources), dtype=bool)
    while True:
        dark, step = row_numbers(~aims), max(CHUNK_HITS // links.sources.shape[1], 1)
        for first in range(0, len(dark), step):
            chunk = dark[first : first + step]
            aims[chunk] = padded[links.sources[chunk]].any(axis=1)
            trim()
        links.mark_aims(aims, padded)
        more = ~padded[: len(direct)] & links.any_of_runs(aims)
        padded[: len(direct)] |= more
        if not (cells.reach(padded) or more.any()):
            return padded[: len(reached)]
