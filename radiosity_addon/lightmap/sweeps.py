"""Jacobi sweeps over the texels along stored gather hits: no ray is traced.

The unknowns are the texels and those leaf elements that gather rays met where no texel is:
backs, and surfaces without a lightmap. Those elements gather too, so that what the coarse
hierarchy smeared across a wall's foot or into a closed box does not come back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..solver.arrays import Array
from ..solver.local_pass import LocalPass, Resolver
from ..solver.scene import Scene
from .interpolate import Interpolation
from .texel_geometry import TexelGeometry

CHUNK_ROWS = 1 << 13
"""Gather points averaged at once; bounds the temporaries to about 60 MB."""

TOLERANCE = 2e-4
"""Largest change of any texel, relative to the mean, at which the sweeps end. Most texels are there
at once; a dark closet next to a bright room, into which the hierarchy's elements leak across the
wall's foot, takes as many sweeps as light would bounce in it."""

LEAF_RAYS = 64
"""Gather rays of a leaf element."""

LEAF_ROUNDS = 3
"""Rounds of asking the leaves that leaves met; beyond, the hierarchy's values stand."""

LEAF_SWEEPS = 24
"""Sweeps among the leaves for each over the texels: they are few."""


@dataclass(frozen=True)
class TexelLight:
    """Irradiance of n texels [W/m²], (n, 3) float64 each; their sum is the whole."""

    direct: Array
    indirect: Array


@dataclass(frozen=True)
class StoredLinks:
    """What the gather points saw, and how they speak for the texels.

    Attributes
    ----------
    sources : (g, rays) int32
        Texels by number, leaf elements after them, NOTHING and SKY negative.
    spread : Interpolation
    """

    sources: Array
    spread: Interpolation


def sweep(
    scene: Scene,
    local: LocalPass,
    geometry: TexelGeometry,
    links: StoredLinks,
    lamps: Array,
    resolve: Resolver,
    sweeps: int,
    tolerance: float = TOLERANCE,
) -> TexelLight:
    """Iterate H = direct + Σ ρ H over the stored hits, started from the hierarchy's solution.

    Parameters
    ----------
    lamps : (n, 3) float64
        Irradiance of the texels straight from lamps and emissive surfaces.
    sweeps : int
        At most so many, …
    tolerance : float
        … or until no texel changes by more than this part of the mean.
    """
    texel_count = len(geometry)
    reflectance = scene.reflectance[geometry.triangle]
    # Rows: texels, leaves, then NOTHING (−2) and SKY (−1).
    table = np.zeros((texel_count + len(local.reflected()) + 2, 3), dtype=np.float32)
    sky = local.sky()
    table[-1] = sky
    direct = lamps
    if sky.any():
        # The sky's light is direct: its share of the same rays.
        direct = lamps + np.maximum(links.spread(_mean(table, links.sources)), 0.0)

    table[:texel_count] = local.reflected_at(geometry.triangle, geometry.barycentric)
    table[texel_count:-2] = local.reflected()
    leaves = _Leaves(local, links.sources, texel_count, resolve, table)
    indirect = np.zeros_like(direct)
    for _ in range(sweeps):
        leaves.sweep(table)
        table[-1] = 0.0
        indirect = np.maximum(links.spread(_mean(table, links.sources)), 0.0)
        table[-1] = sky
        radiosity = (reflectance * (direct + indirect)).astype(np.float32)
        change = np.abs(radiosity - table[:texel_count]).max(initial=0.0)
        table[:texel_count] = radiosity
        if change <= tolerance * radiosity.mean():
            break
    return TexelLight(direct, indirect)


class _Leaves:
    """The leaf elements that gather rays met, and what they see in turn."""

    def __init__(
        self,
        local: LocalPass,
        sources: Array,
        texel_count: int,
        resolve: Resolver,
        table: Array,
    ) -> None:
        met = np.zeros(len(table), dtype=bool)
        known = np.zeros(len(table), dtype=bool)
        met[sources.ravel()] = True
        seen, rows = [], []
        for _ in range(LEAF_ROUNDS):
            row = np.flatnonzero(met[:-2] & ~known[:-2])
            row = row[row >= texel_count]
            if len(row) == 0:
                break
            known[row] = True
            found, _ = local.gather_at_leaves(row - texel_count, LEAF_RAYS, resolve)
            met[found.ravel()] = True
            rows.append(row)
            seen.append(found)
        self._rows = np.concatenate(rows) if rows else np.zeros(0, dtype=np.int64)
        if len(self._rows):
            self._sources = np.concatenate(seen)
            self._reflectance = local.leaf_reflectance(self._rows - texel_count)
            self._lamps = local.leaf_direct(self._rows - texel_count)

    def sweep(self, table: Array) -> None:
        """Update the leaves' rows of the table of reflected radiosity, among themselves to convergence."""
        for _ in range(LEAF_SWEEPS if len(self._rows) else 0):
            irradiance = self._lamps + _mean(table, self._sources)
            table[self._rows] = self._reflectance * irradiance


def _mean(table: Array, sources: Array) -> Array:
    """Return (g, 3): the mean of the table's rows each gather point saw."""
    result = np.empty((len(sources), 3))
    for first in range(0, len(sources), CHUNK_ROWS):
        rows = slice(first, first + CHUNK_ROWS)
        for channel in range(3):
            result[rows, channel] = table[sources[rows], channel].mean(axis=1)
    return result
