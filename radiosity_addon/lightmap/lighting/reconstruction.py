"""Irradiance of every texel from a solved scene: direct light, gather points, sweeps.

Direct light is asked for at every texel. Indirect light is gathered at few texels, dense
near contacts, and interpolated. Each gather ray remembers what it hit, most often another
texel: that is a link at the finest level, so a few Jacobi sweeps over the texels, which
trace nothing, remove what the coarse hierarchy got wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, marked, row_numbers, tiles
from ...scene import Scene
from ...solver.gather import AimedRays, Footprints, Gathered, LocalPass, Resolver, values_of
from ..points import GatherPoints, fit
from ..texels import (
    Crossings,
    SmoothLift,
    TexelGeometry,
    find_crossings,
    texel_materials,
)
from .gather_links import GatherLinks
from .gather_settings import GatherSettings
from .hit_table import HitTable
from .partial_light import LightSoFar
from .sub_cells import gather_sub_cells
from .sweeps import RelightableTexels, TexelLight, TexelTransport, sweep
from .traced_texels import GatherPointLayout, LightingRecord
from .warm_start import WarmStart

DIRECT, CROSSED, GATHERED, PARTS = 0.25, 0.3, 0.8, 0.9
"""How much is done when a part ends; rough, from rooms at medium quality."""

CHUNK = 1 << 16
"""Texels whose elements are looked up at once; bounds the temporaries to about 20 MB."""

STARTS = 16
"""Points of a texel's footprint that its gather rays start from."""

FIT = 0.15
"""The part of gathering that weighs the points."""


def reconstruct(
    scene: Scene,
    local: LocalPass,
    geometry: TexelGeometry,
    settings: GatherSettings,
    so_far: LightSoFar | None = None,
    progress: Progress = SILENT,
) -> TexelLight:
    """Compute direct and indirect irradiance of all texels.

    If `local` can ask for every light apart, what lights the texels anew is kept. `so_far` is told what is
    known on the way.
    """
    scratch = geometry.scratch
    gains = local.direct.new_gains(len(geometry), scratch)
    lamps = scratch.zeros((len(geometry), 3))
    reflectance, emission = texel_materials(scene, geometry)
    element = elements_below(local, geometry)
    if so_far is not None:
        so_far.begin(local, geometry, element, lamps, (reflectance, emission))
    tell = None if so_far is None else so_far.asked
    at, part = footprints(geometry, local), progress.part(0.0, DIRECT)
    lamps = local.direct.at(at, gains=gains, total=lamps, tell=tell, progress=part)
    del at
    part = progress.part(DIRECT, CROSSED)
    crossings = find_crossings(geometry, local.caster, local.threads, progress=part)
    table = HitTable(local, geometry, crossings)
    met = None if so_far is None else partial(so_far.met, table)
    part = progress.part(CROSSED, GATHERED)
    links, points = gather_texels(local, geometry, settings, crossings, table.number, met, part)
    chosen = GatherPointLayout.of(points) if gains is not None else None
    # How points are found takes more than what they met says.
    del points
    part = progress.part(GATHERED, PARTS)
    cells, rows = gather_sub_cells(table, links, element, reflectance, progress=part)
    transport = TexelTransport(links, cells, reflectance)
    start, reflected = scratch.empty((len(geometry), 3), np.float32), local.elements.reflected()
    for tile in tiles(len(geometry)):
        start[tile] = values_of(reflected, element[tile])
    seen = None if so_far is None else so_far.swept
    light = sweep(
        transport,
        start,
        lamps,
        local.elements.beyond(),
        sweeps=settings.sweeps,
        tolerance=settings.tolerance,
        threads=local.threads,
        seen=seen,
        scratch=scratch,
        progress=progress.part(PARTS, 1.0),
    )
    light = replace(light, state=crossings.state)
    progress.at(1.0)
    if gains is None or chosen is None or local.direct.sources is None or light.table is None:
        return light
    warm_start = WarmStart(local.direct.sources.strengths, light.table)
    lit = RelightableTexels(transport, gains, element, settings.sweeps, settings.tolerance, warm_start)
    traced = LightingRecord(settings, table, chosen, rows, local.gather.bright, light.error)
    return replace(light, kept=lit, traced=traced)


def footprints(geometry: TexelGeometry, local: LocalPass) -> Footprints:
    """Return where all texels ask for light, and how much the elements lead them to expect."""
    scratch = geometry.scratch
    keys, expected = scratch.empty(len(geometry), np.int32), scratch.empty(len(geometry))
    for tile in tiles(len(geometry), CHUNK):
        keys[tile] = np.arange(tile.start, tile.stop)
        expected[tile] = local.elements.irradiance_at(geometry.triangle[tile], geometry.barycentric[tile])
    return Footprints(
        geometry.position,
        geometry.normal,
        keys,
        geometry.sample,
        geometry.neighborhood,
        expected=expected,
        lift=SmoothLift(geometry),
        scratch=scratch,
    )


def elements_below(local: LocalPass, geometry: TexelGeometry) -> Array:
    """Return (n,) int32 the leaf elements below the texels, or NOTHING."""
    element = geometry.scratch.empty(len(geometry), np.int32)
    for tile in tiles(len(geometry), CHUNK):
        element[tile] = local.elements.leaf_at_fronts(geometry.triangle[tile], geometry.barycentric[tile])
    return element


def gather_texels(
    local: LocalPass,
    geometry: TexelGeometry,
    settings: GatherSettings,
    crossings: Crossings,
    resolve: Resolver,
    met: Callable[[Array, Gathered, int], None] | None = None,
    progress: Progress = SILENT,
) -> tuple[GatherLinks, GatherPoints]:
    """Gather at few texels, densely where others do not reach.

    `met` is told of texels that have gathered, and how far they are apart.
    """
    points = GatherPoints(geometry, local.caster, crossings.alone, local.threads)
    found: list[AimedRays] = []
    first: list[int] = []
    sources = geometry.scratch.rows(settings.rays, np.int32)
    count = 0
    for stride, level in progress.part(0.0, 1.0 - FIT).each(settings.strides):
        part = level.part(0.0, 0.2)
        chosen = _choose(points, geometry, stride, settings.support, crossings.beside, part)
        # Across a rim light changes by more than noise: there every ray starts from a point of its own.
        edge = crossings.crossed[chosen]
        done, closeness = 0.2, []
        for some, starts in ((chosen[~edge], STARTS), (chosen[edge], None)):
            before, done = done, done + 0.8 * len(some) / max(len(chosen), 1)
            gathered = gather_at(
                local,
                geometry,
                some,
                starts,
                settings.rays,
                resolve,
                into=sources.more(len(some)),
                progress=level.part(before, done),
            )
            first.append(count)
            found.append(gathered.aimed)
            count += len(some)
            if met is not None:
                met(some, gathered, stride)
            closeness.append(gathered.closeness)
        points.add(stride, np.concatenate([chosen[~edge], chosen[edge]]), np.concatenate(closeness))
    spread = fit(points, geometry, progress.part(1.0 - FIT, 1.0))
    aimed = AimedRays.joined(found, first, geometry.scratch)
    return GatherLinks(sources.all(), spread, aimed), points


def gather_at(
    local: LocalPass,
    geometry: TexelGeometry,
    chosen: Array,
    starts: int | None,
    rays: int,
    resolve: Resolver,
    into: Array | None = None,
    progress: Progress = SILENT,
) -> Gathered:
    """Gather at some texels. `into` (c, rays) int32 takes the sources, if given."""
    at = gather_footprints(geometry, chosen, starts)
    expected, upright = (geometry.scratch.empty((len(chosen), *of)) for of in ((), (3,)))
    for tile in tiles(len(chosen), CHUNK):
        some = chosen[tile]
        expected[tile] = local.elements.irradiance_at(geometry.triangle[some], geometry.barycentric[some])
        upright[tile] = geometry.surface_normal[some]
    return local.gather.at(at, upright, rays, resolve, expected, into, progress)


def gather_footprints(geometry: TexelGeometry, chosen: Array, starts: int | None) -> Footprints:
    """Return where some texels gather, each from so many points."""
    position, normal = (geometry.scratch.empty((len(chosen), 3)) for _ in range(2))
    for tile in tiles(len(chosen)):
        position[tile], normal[tile] = geometry.position[chosen[tile]], geometry.normal[chosen[tile]]
    sampler = partial(sample_of, geometry, chosen)
    return Footprints(position, normal, chosen, sampler, starts=starts, scratch=geometry.scratch)


def sample_of(geometry: TexelGeometry, chosen: Array, rows: Array, u: Array) -> Array:
    """Spread points over the footprints of some of the chosen texels."""
    return geometry.sample(chosen[rows], u)


def _choose(
    points: GatherPoints,
    geometry: TexelGeometry,
    stride: int,
    support: float,
    beside: Array,
    progress: Progress,
) -> Array:
    """Find the texels on a lattice that no point so far reaches.

    Those beside something, (n,) bool, are chosen as well: points in the open do not know how close
    it is to them.
    """
    candidates = on_lattice(geometry, stride)
    if len(points):
        candidates[points.texel] = False
    candidates = row_numbers(candidates)
    if len(points):
        reached = points.support(candidates, progress)
        candidates = candidates[(reached < support) | beside[candidates]]
    return candidates


def on_lattice(geometry: TexelGeometry, stride: int) -> Array:
    """Return (n,) bool: the texels in every so many rows and columns of their page."""
    row, column = geometry.row, geometry.column
    return marked(len(geometry), lambda tile: (row[tile] % stride == 0) & (column[tile] % stride == 0))
