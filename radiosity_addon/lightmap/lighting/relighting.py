"""Texels lit anew by kept links and gains: no ray is traced.

The same equation as in a bake (`sweeps.py`), with other strengths of the lights: gains times strengths
for what comes straight from lamps, cells of the sky times its radiance, and the hierarchy, solved once more
along its links, to start from and where nobody gathered.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, tiles
from ...solver.element_transport import Relightable
from ...solver.gather import values_of
from .sweeps import LitTexels, TexelLight, sweep

SOLVED = 0.3
"""How much is done when the hierarchy is solved; rough."""


def relight_texels(
    kept: LitTexels,
    solved: Relightable,
    strengths: Array,
    scratch: Scratch | None = None,
    progress: Progress = SILENT,
) -> TexelLight:
    """Light texels by other strengths of the sources.

    Parameters
    ----------
    kept : LitTexels
    solved : Relightable
    strengths : (s, 3) float64
        See `LightSources.strengths` for units.
    scratch : Scratch or None
        Makes the texels' arrays; None keeps them in memory.
    """
    progress.at(0.0)
    sources, local = solved.sources, solved.local
    given = sources.of_lamps(strengths)
    parts = kept.transport.parts
    links = [
        replace(some, lamps=some.gains.irradiance(given)) for some in parts.links if some.gains is not None
    ]
    assert len(links) == len(parts.links)  # a kept bake keeps them all
    known = kept.earlier.mixed(strengths)
    if known is None:
        table, left = kept.earlier.part_of(strengths)
        reflected = local.reflected(solved.elements.irradiance(left))
        first, count = table, len(kept.element)
        for rows in tiles(len(table)):
            after = slice(max(rows.start - count, 0), max(rows.stop - count, 0))
            of = np.concatenate([kept.element[rows], parts.element[after]])
            first[rows] = table[rows] + values_of(reflected, of)
    else:
        first = known
    start, of_parts = first[: len(kept.element)], first[len(kept.element) :]
    progress.at(SOLVED)
    transport = replace(kept.transport, parts=replace(parts, start=of_parts, links=links))
    lamps = kept.gains.irradiance(given)
    beyond = local.beyond(sources.sky(strengths))
    light = sweep(
        transport,
        start,
        lamps,
        beyond,
        sweeps=kept.sweeps,
        tolerance=kept.tolerance,
        threads=local.threads,
        estimate=False,
        scratch=scratch,
        progress=progress.part(SOLVED, 1.0),
    )
    if known is None and light.table is not None:
        kept.earlier.add(strengths, light.table)
    return light


def kept_bytes(kept: LitTexels) -> int:
    """Return what kept links and gains take in memory [bytes]."""
    links, parts = kept.transport.links, kept.transport.parts
    total = links.sources.nbytes + links.aimed.sources.nbytes + links.aimed.weights.nbytes
    total += kept.gains.nbytes + kept.element.nbytes + kept.transport.reflectance.nbytes
    for some in parts.links:
        total += some.sources.nbytes + (0 if some.gains is None else some.gains.nbytes)
    return int(np.int64(total))
