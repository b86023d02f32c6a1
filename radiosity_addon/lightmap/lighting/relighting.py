"""Texels relit by kept links and gains, without tracing rays.

The same equation as in a bake (`transport/sweeps.py`), with other strengths of the lights: gains times
strengths for what comes straight from lamps, cells of the sky times its radiance, and the hierarchy, solved
once more along its links, to start from and where nobody gathered.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, tiles
from ...solver.element_transport import Relightable
from ...solver.gather import table_end, values_of
from ..texels import TexelGeometry
from ..transport import (
    RelightableTexels,
    SmoothingChoice,
    TexelLight,
    estimated_noise,
    relative_error,
    sweep,
)

SOLVED = 0.3
"""How much is done when the hierarchy is solved; rough."""


def relight_texels(
    kept: RelightableTexels,
    geometry: TexelGeometry,
    solved: Relightable,
    strengths: Array,
    scratch: Scratch | None = None,
    progress: Progress = SILENT,
) -> TexelLight:
    """Light texels by other strengths of the sources.

    Parameters
    ----------
    kept : RelightableTexels
    geometry : TexelGeometry
        Only the places of texels on their pages are used.
    solved : Relightable
    strengths : (s, 3) float64
        See `LightSources.strengths` for units.
    scratch : Scratch or None
        Makes the texels' arrays; None keeps them in memory.
    """
    progress.at(0.0)
    sources, local = solved.sources, solved.local
    given = sources.of_lamps(strengths)
    cells = kept.transport.cells
    links = [
        replace(level, lamps=level.gains.irradiance(given))
        for level in cells.links
        if level.gains is not None
    ]
    assert len(links) == len(cells.links)  # a kept bake keeps them all
    known = kept.warm_start.mixed(strengths)
    if known is None:
        table, left = kept.warm_start.part_of(strengths)
        more = _at_leaves(kept, solved, left)
        reflected = local.elements.reflected(solved.elements.irradiance(left, more))
        first, count = table, len(kept.element)
        for rows in tiles(len(table)):
            after = slice(max(rows.start - count, 0), max(rows.stop - count, 0))
            element = np.concatenate([kept.element[rows], cells.element[after]])
            first[rows] = table[rows] + values_of(reflected, element)
    else:
        first = known
    start, of_cells = first[: len(kept.element)], first[len(kept.element) :]
    progress.at(SOLVED)
    transport = replace(kept.transport, cells=replace(cells, start=of_cells, links=links))
    lamps = kept.gains.irradiance(given)
    beyond = table_end(sources.sky(strengths))
    light = sweep(
        transport,
        start,
        lamps,
        beyond,
        sweeps=kept.sweeps,
        tolerance=kept.tolerance,
        threads=local.threads,
        estimate=False,
        smooth=SmoothingChoice(geometry, kept.smoothing.alike, kept.smoothing),
        scratch=scratch,
        progress=progress.part(SOLVED, 1.0),
    )
    if known is None and light.table is not None:
        kept.warm_start.add(strengths, light.table)
    return light


def estimated_error(
    kept: RelightableTexels, solved: Relightable, strengths: Array, scratch: Scratch | None = None
) -> float:
    """Estimate the relative RMS error of the light of relit texels: the noise of their gather rays.

    strengths (s, 3): They were relit with.
    """
    sources, links, threads = solved.sources, kept.transport.links, solved.local.threads
    solution, beyond = kept.warm_start.mixed(strengths), table_end(sources.sky(strengths))
    assert solution is not None  # it is remembered
    table = np.concatenate([solution, beyond.astype(np.float32)])
    noise = estimated_noise(links, table, threads, scratch)
    direct = kept.gains.irradiance(sources.of_lamps(strengths))
    return relative_error(noise, direct, links.irradiance(table, threads, scratch))


def _at_leaves(kept: RelightableTexels, solved: Relightable, strengths: Array) -> Array | None:
    """Return (e, 3) what lights without links bring leaf elements [W/m²], as texels and cells on them know.

    None if there are none of these lights.
    """
    sources = solved.sources
    lights = np.zeros((len(strengths), 1), dtype=bool)
    lights[: len(sources.lights), 0] = solved.elements.unlinked
    if not strengths[lights[:, 0]].any():
        return None
    given = sources.of_lamps(np.where(lights, strengths, 0.0))
    texels, cells = len(kept.element), kept.transport.cells
    count = solved.local.elements.hierarchy.n_elements
    known = [(kept.element, kept.gains)]
    known += [(cells.element[of.rows - texels], of.gains) for of in cells.links if of.gains is not None]
    total, points = np.zeros((count, 3)), np.zeros(count)
    for element, gains in known:
        there = element >= 0
        arriving = gains.irradiance(given)[there]
        points += np.bincount(element[there], minlength=count)
        for channel in range(3):
            total[:, channel] += np.bincount(element[there], arriving[:, channel], minlength=count)
    return np.asarray(total / np.maximum(points, 1.0)[:, None])


def kept_bytes(kept: RelightableTexels) -> int:
    """Return what kept links and gains take in memory [bytes]."""
    links, cells = kept.transport.links, kept.transport.cells
    total = links.sources.nbytes + links.aimed.sources.nbytes + links.aimed.weights.nbytes
    total += kept.smoothing.alike.nbytes + kept.smoothing.passes.nbytes
    total += kept.gains.nbytes + kept.element.nbytes + kept.transport.reflectance.nbytes
    total += 0 if links.tints is None else links.tints.nbytes
    for level in cells.links:
        total += 0 if level.tints is None else level.tints.nbytes
        total += level.sources.nbytes + (0 if level.gains is None else level.gains.nbytes)
    return int(np.int64(total))
