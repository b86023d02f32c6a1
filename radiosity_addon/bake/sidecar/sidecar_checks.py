"""Whether what a sidecar holds can be relit: types, shapes and ranges of arrays, and bounds of indices.

A sidecar may come from anywhere, and its digest proves only that it is whole. NumPy wraps negative indices
and reads on with NaN, so nothing that was read is used before it has passed here. What depends on the scene
as it is now is checked when the bake is tied to it (`StoredBake.kept`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from ...lightmap.images import Seams
from ...lightmap.points import PASSES, Interpolation, Smoothing
from ...lightmap.texels import TexelGeometry
from ...lightmap.transport import (
    GatherLinks,
    RelightableTexels,
    SubCellLinks,
    SubCells,
    TexelTransport,
    WarmStart,
    number_of_points,
)
from ...lights import Emitter, Light, SkyPatch, SkyTable
from ...options import MAX_RESOLUTION, BakeSettings
from ...solver.element_transport import ElementTransport
from ...solver.emitters import NO_SOURCE, EmitterGroup, LightSources
from ...solver.gather import (
    MOST_RUNS,
    NOTHING,
    AimedRays,
    CompactGains,
    LightGains,
    RunGains,
    lowest_number,
)
from ..scene_diff import as_object_records
from .hierarchy_checks import MOST_LEVELS, MOST_THREADS, check_elements, check_tints
from .value_checks import (
    LARGE,
    SHARE_TOLERANCE,
    array_of,
    instance,
    integers,
    number,
    numbers,
    require,
    whole,
)

MOST_ROUNDS, MOST_RINGS = 1 << 20, 4096

MOST_WEIGHT = 1e3
"""Weights of gather points, which a linear fit may take below 0 and above 1."""


def check_stored(stored: Any) -> None:
    """Refuse what no bake has written.

    Parameters
    ----------
    stored : mapping
        As `sidecar.write_sidecar` describes it.

    Raises
    ------
    ValueError, KeyError, TypeError, IndexError, AttributeError, RadiosityError
        If anything is not as it must be.
    """
    instance(stored["bake_id"], str)
    settings = BakeSettings(**stored["settings"])
    check_settings(settings)
    if settings.method != "hierarchical" or settings.quantity == "residual":
        raise ValueError("a bake that is never kept")
    stored["objects"] = as_object_records(stored["objects"])
    transport = instance(stored["elements"], ElementTransport)
    lit, geometry = instance(stored["lit"], RelightableTexels), instance(stored["geometry"], TexelGeometry)
    emission = stored["emission"]
    triangles = len(emission)
    numbers(emission, (triangles, 3), 0.0)
    _check_named(stored["of_sources"], triangles)
    sources = instance(transport.sources, LightSources)
    lamps = _check_sources(sources, triangles)
    elements = check_elements(transport, len(sources.lights), triangles)
    texels = _check_geometry(geometry, triangles)
    _check_lit(lit, sources, texels, elements, lamps)
    if stored["seams"] is not None:
        _check_seams(instance(stored["seams"], Seams), geometry, triangles)
    whole(stored["rings"], 0, MOST_RINGS)
    numbers(stored["texel_reflectance"], (texels, 3), 0.0, 1.0)
    numbers(stored["texel_emission"], (texels, 3), 0.0)
    for page in instance(stored["pages"], list):
        whole(page, 0, len(geometry.index) - 1)
    _check_report(stored["report"], len(geometry.index))


def check_settings(settings: BakeSettings) -> None:
    """Refuse settings of other types than these."""
    for entry in fields(BakeSettings):
        value = getattr(settings, entry.name)
        allowed: tuple[type, ...] = (type(entry.default),)
        if entry.default is None:
            allowed = (type(None), int, float, str, bool, tuple)
        elif isinstance(entry.default, float):
            allowed = (int, float)
        if type(value) not in allowed:
            raise ValueError(f"setting {entry.name}")
    whole(settings.threads, 0, MOST_THREADS)


def _check_named(named: Any, triangles: int) -> None:
    if named["emitter"] is not None:
        integers(named["emitter"], (triangles,), NO_SOURCE, triangles)
    for name in ("emitter_names", "light_groups", "emitter_groups"):
        if not all(isinstance(text, str) for text in instance(named[name], tuple)):
            raise ValueError(name)
    if len(named) != 4:
        raise ValueError("sources")


def _check_report(report: Any, pages: int) -> None:
    """Refuse a report that is more than text and numbers, or lacks what is shown of it."""
    check_plain(report)
    solver = instance(report["solver"], dict)
    instance(solver["method"], str)
    for name in ("elements", "links", "rays"):
        whole(solver[name], 0, 1 << 62)
    if not all(isinstance(page, dict) for page in instance(report["atlas"], tuple)):
        raise ValueError("atlas")
    if len(report["atlas"]) not in (0, pages):
        raise ValueError("atlas")


def check_plain(value: Any, depth: int = 0) -> None:
    """Refuse what is more than text and numbers."""
    if depth > MOST_LEVELS:
        raise ValueError("too deep")
    if isinstance(value, dict):
        for key, item in value.items():
            instance(key, str)
            check_plain(item, depth + 1)
    elif isinstance(value, list | tuple):
        for item in value:
            check_plain(item, depth + 1)
    elif value is not None and not isinstance(value, bool | int | float | str):
        raise ValueError("neither text nor number")


def _check_sources(sources: LightSources, triangles: int) -> int:
    """Check the sources; return how many gains each point may have: of lights and of emissive groups."""
    lights, groups = instance(sources.lights, tuple), instance(sources.groups, list)
    for light in lights:
        check_light(light)
    count = len(sources.strengths) - len(lights)
    numbers(sources.strengths, (len(lights) + count, 3), 0.0)
    integers(sources.emitter, (triangles,), NO_SOURCE, count - 1)
    shining = np.unique(sources.emitter[sources.emitter >= 0])
    require(sources.strengths[len(lights) + shining].any(axis=1).all(), "emission without strength")
    integers(sources.owner, (len(groups),), 0, count - 1)
    array_of(sources.single, "b", (count,))
    for group in groups:
        numbers(instance(group, EmitterGroup).strength, (3,), 0.0)
    return len(lights) + len(groups)


def check_light(light: Any) -> None:
    """Refuse a light that could not be made: it is made once more, with the checks that this runs."""
    instance(light, Light)
    given = {entry.name: getattr(light, entry.name) for entry in fields(light)}
    with np.errstate(all="ignore"):
        made = type(light)(**given)
    for name, value in given.items():
        if isinstance(value, np.ndarray):
            numbers(value, np.shape(getattr(made, name)), -LARGE)
        elif type(value) not in (str, bool, int, float) or isinstance(value, str) != (
            name in ("name", "shape")
        ):
            raise ValueError(f"a light's {name}")
    numbers(np.asarray(light.strength), (3,), 0.0)
    if isinstance(made, SkyPatch):
        numbers(made.share, np.shape(made.bounds)[:1], 0.0, 1.0 + SHARE_TOLERANCE)


def _check_geometry(geometry: TexelGeometry, triangles: int) -> int:
    """Check where texels are; return their number."""
    pages, n = len(instance(geometry.index, list)), len(geometry.page)
    integers(geometry.page, (n,), 0, pages - 1)
    integers(geometry.triangle, (n,), 0, triangles - 1)
    array_of(geometry.center_inside, "b", (n,))
    numbers(geometry.uv, (triangles, 3, 2), -LARGE)
    integers(geometry.page_of_triangle, (triangles,), -1, pages - 1)
    shown = geometry.uv[geometry.page_of_triangle >= 0]
    require(((shown >= -SHARE_TOLERANCE) & (shown <= 1.0 + SHARE_TOLERANCE)).all(), "UVs outside their page")
    integers(geometry.page_start, (pages + 1,), 0, n)
    require(geometry.page_start[0] == 0 and geometry.page_start[-1] == n, "texels of no page")
    require((np.diff(geometry.page) >= 0).all(), "pages in no order")
    counts = np.bincount(geometry.page, minlength=pages)
    require((counts == np.diff(geometry.page_start)).all(), "texels of no page")
    for page, index in enumerate(geometry.index):
        size = len(index)
        whole(size, 1, MAX_RESOLUTION)
        first, last = int(geometry.page_start[page]), int(geometry.page_start[page + 1])
        integers(index, (size, size), -1, last - 1)
        covered = index[index >= 0]
        require((covered >= first).all(), "texels of another page")
        require(len(covered) == last - first == len(np.unique(covered)), "texels in several places")
    return n


def _check_lit(lit: RelightableTexels, sources: LightSources, texels: int, elements: int, lamps: int) -> None:
    transport = instance(lit.transport, TexelTransport)
    links, cells = instance(transport.links, GatherLinks), instance(transport.cells, SubCells)
    surfaces, lowest = texels + len(cells.start), lowest_number(SkyTable(sources.lights))
    require(surfaces >= texels + elements, "elements without a row")
    gather = len(links.sources)
    rays = np.shape(links.sources)[1]
    require(rays > 0, "no rays")
    integers(links.sources, (gather, rays), lowest, surfaces - 1)
    points = gather
    if links.run is not None:
        _check_runs(links.run, gather)
        points = number_of_points(links.run)
    _check_interpolation(instance(links.spread, Interpolation), texels, points)
    aimed = instance(links.aimed, AimedRays)
    shape = np.shape(aimed.sources)
    integers(aimed.row, shape[:1], 0, gather - 1)
    integers(aimed.sources, (shape[0], shape[1]), lowest, surfaces - 1)
    require(np.shape(aimed.weights)[2:] in ((), (3,)), "weights of no channels")
    numbers(aimed.weights, (*shape, *np.shape(aimed.weights)[2:]), 0.0)
    check_tints(links.tints, (gather, rays))
    integers(aimed.element, (len(aimed.element), shape[1]), NOTHING, elements - 1)
    numbers(transport.reflectance, (texels, 3), 0.0, 1.0)
    numbers(cells.start, (surfaces - texels, 3), 0.0)
    integers(cells.element, (surfaces - texels,), NOTHING, elements - 1)
    for level in instance(cells.links, list):
        count = len(instance(level, SubCellLinks).rows)
        integers(level.rows, (count,), texels, surfaces - 1)
        require(np.shape(level.sources)[1] > 0, "no rays")
        integers(level.sources, (count, np.shape(level.sources)[1]), lowest, surfaces - 1)
        numbers(level.reflectance, (count, 3), 0.0, 1.0)
        check_tints(level.tints, (count, np.shape(level.sources)[1]))
        _check_gains(instance(level.gains, LightGains), count, lamps)
    _check_gains(instance(lit.gains, LightGains), texels, lamps)
    integers(lit.element, (texels,), NOTHING, elements - 1)
    smoothing = instance(lit.smoothing, Smoothing)
    for steps in (smoothing.alike, smoothing.passes):
        array_of(steps, "u", (texels,))
    require(int(smoothing.passes.max(initial=0)) <= PASSES[-1], "too many steps")
    whole(lit.sweeps, 0, MOST_ROUNDS)
    number(lit.tolerance, 0.0)
    known = instance(instance(lit.warm_start, WarmStart).solutions, list)
    require(len(known) > 0, "no light")
    for strengths, table in known:
        numbers(strengths, sources.strengths.shape, 0.0)
        numbers(table, (surfaces, 3), 0.0)


def _check_runs(run: Any, gather: int) -> None:
    integers(run, (gather,), 0, np.iinfo(np.int16).max)
    goes_on = np.diff(run.astype(np.int64)) == 1
    require((goes_on | (run[1:] == 0)).all() and (run[:1] == 0).all(), "runs in no order")


def _check_interpolation(spread: Interpolation, texels: int, points: int) -> None:
    entries = len(spread.point)
    integers(spread.first, (texels,), 0, entries - 1)
    require((np.diff(spread.first) > 0).all() and (spread.first[:1] == 0).all(), "texels without entries")
    integers(spread.point, (entries,), 0, points - 1)
    numbers(spread.weight, (entries,), -MOST_WEIGHT, MOST_WEIGHT)
    if texels:
        sums = np.add.reduceat(spread.weight.astype(np.float64), spread.first)
        require((np.abs(sums - 1.0) < SHARE_TOLERANCE).all(), "weights that do not sum to 1")


def _check_gains(gains: LightGains, count: int, lamps: int) -> None:
    require(gains.count == count, "gains of something else")
    if isinstance(gains, CompactGains):
        require(instance(gains.scale_of, dict).keys() == gains.gain_of.keys(), "gains of no scale")
        for scale in gains.scale_of.values():
            number(scale, 0.0)
    if isinstance(gains, RunGains):
        of_lamps = instance(gains.lamps, tuple)
        require(all(isinstance(lamp, Emitter) for lamp in of_lamps), "lamps of no place")
        integers(gains.numbers, (len(of_lamps),), 0, lamps - 1)
        numbers(gains.points, (count, 3), -LARGE)
        numbers(gains.normals, (count, 3), -1.0 - SHARE_TOLERANCE, 1.0 + SHARE_TOLERANCE)
        runs = np.shape(gains.seen)[1]
        require(0 < runs <= min(len(of_lamps), MOST_RUNS), "runs of no lamps")
        array_of(gains.seen, "u", (count, runs, *_channels(gains.seen[:, 0])))
    for light, (rows, gain) in instance(gains.gain_of, dict).items():
        whole(light, 0, lamps - 1)
        if rows is None:
            numbers(gain, (count, *_channels(gain)), 0.0)
        else:
            integers(rows, (len(rows),), 0, count - 1)
            require((np.diff(rows) > 0).all(), "rows in no order")
            numbers(gain, (len(rows), *_channels(gain)), 0.0)


def _channels(gain: Any) -> tuple[int, ...]:
    """Return the shape of a gain of one point: () or (3,)."""
    channels = np.shape(gain)[1:]
    require(channels in ((), (3,)), "gains of no channels")
    return channels


def _check_seams(seams: Seams, geometry: TexelGeometry, triangles: int) -> None:
    count = len(seams.length)
    pixels = sum(index.size for index in geometry.index)
    integers(seams.texel, (count, 2, 4), 0, pixels - 1)
    numbers(seams.weight, (count, 2, 4), -SHARE_TOLERANCE, 1.0 + SHARE_TOLERANCE)
    numbers(seams.length, (count,), 0.0, 1.0 + SHARE_TOLERANCE)
    integers(seams.triangle, (count, 2), 0, triangles - 1)


def stored_layout(stored: Mapping[str, Any]) -> tuple[int, int]:
    """Return the numbers of triangles, and of objects that have a lightmap, that a stored bake is of."""
    return len(stored["emission"]), len(stored["pages"])
