"""Irradiance of every texel from a solved scene: direct light, gather points, sweeps.

Direct light is asked for at every texel. Indirect light is gathered at few texels, dense
near contacts, and interpolated. Each gather ray remembers what it hit, most often another
texel: that is a link at the finest level, so a few Jacobi sweeps over the texels, which
trace nothing, remove what the coarse hierarchy got wrong.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..solver.arrays import Array
from ..solver.local_pass import NOTHING, LocalPass, Resolver
from ..solver.scene import Scene
from ..solver.visibility import Hits
from .crossings import Crossings
from .interpolate import GatherPoints, fit
from .sweeps import StoredLinks, TexelLight, sweep
from .texel_geometry import NO_TEXEL, TexelGeometry


@dataclass(frozen=True)
class GatherSettings:
    """How densely indirect light is gathered.

    Parameters
    ----------
    strides : tuple of int
        Lattices of gather points, coarse to fine, in texels; finer ones are used only where
        coarser points do not reach. The last is 1, so that every texel is reached.
    support : float
        A texel whose coarser points weigh less than this together becomes a point itself.
    rays : int
        A gather point.
    sweeps : int
        Jacobi sweeps over the texels, at most.
    """

    strides: tuple[int, ...] = (4, 2, 1)
    support: float = 1.0
    rays: int = 256
    sweeps: int = 64


def reconstruct(
    scene: Scene, local: LocalPass, geometry: TexelGeometry, settings: GatherSettings
) -> Generator[float, None, TexelLight]:
    """Compute direct and indirect irradiance of all texels; yields the fraction done."""
    keys = np.arange(len(geometry))
    lamps = local.direct(geometry.position, geometry.normal, keys, geometry.sample, geometry.neighbourhood)
    yield 0.3
    crossings = Crossings(geometry, local.caster)
    resolve = _resolver(local, geometry, crossings)
    points = GatherPoints(geometry, local.caster, crossings.crossed, local.threads)
    sources: list[Array] = []
    for number, stride in enumerate(settings.strides):
        chosen = _choose(points, geometry, stride, settings.support)
        found, closeness = local.gather(
            geometry.position[chosen],
            geometry.normal[chosen],
            geometry.surface_normal[chosen],
            chosen,
            settings.rays,
            resolve,
            partial(_sample_of, geometry, chosen),
        )
        points.add(stride, chosen, closeness)
        sources.append(found)
        yield 0.3 + 0.5 * (number + 1) / len(settings.strides)
    spread = fit(points, geometry)
    yield 0.85
    stored = StoredLinks(np.concatenate(sources), spread)
    light = sweep(scene, local, geometry, stored, lamps, resolve, settings.sweeps)
    yield 1.0
    return light


def _sample_of(geometry: TexelGeometry, chosen: Array, rows: Array, u: Array) -> Array:
    """Spread points over the footprints of some of the chosen texels."""
    return geometry.sample(chosen[rows], u)


def _choose(points: GatherPoints, geometry: TexelGeometry, stride: int, support: float) -> Array:
    """Return the texels on a lattice that no point so far reaches."""
    on_lattice = (geometry.row % stride == 0) & (geometry.column % stride == 0)
    candidates = np.flatnonzero(on_lattice)
    if len(points):
        candidates = np.setdiff1d(candidates, points.texel, assume_unique=True)
        candidates = candidates[points.support(candidates) < support]
    return candidates.astype(np.int32)


def _resolver(local: LocalPass, geometry: TexelGeometry, crossings: Crossings) -> Resolver:
    """Number hits: texels by their own number, leaf elements after the texels."""

    def resolve(hits: Hits) -> Array:
        texel = crossings.look_up(geometry.texel_at(hits), geometry.positions_of(hits))
        elsewhere = texel == NO_TEXEL
        leaf = local.leaves_of(hits.take(elsewhere))
        texel[elsewhere] = np.where(leaf == NOTHING, NOTHING, leaf + len(geometry))
        return texel

    return resolve
