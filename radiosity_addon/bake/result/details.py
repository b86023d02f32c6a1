"""What more is known after of a bake: the light summed up, errors, texels that are not what they seem."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from ...lightmap.images import light_statistics, lit_texels
from ...lightmap.texels import ENCLOSED, NO_TEXEL_HERE, TOUCHED, TexelGeometry, texel_areas
from ...lightmap.transport import TexelLight
from ...numerics import Array, luminous, tiles
from ...options import EFFICACY
from ...scene import BakeObject
from ...solver import Solution
from ...solver.state import LinkRecord
from .result import BakeDetails, BakedObject, PageDetails

MEANS = np.full(3, 1.0 / 3.0)
"""Weights of the channels in what the report gives in W/m²."""

CHUNK = 1 << 16
"""Texels looked up at once; bounds the temporaries to about 30 MB."""

More: TypeAlias = tuple[tuple[dict[str, Any], ...], BakeDetails | None]
"""Statistics of the objects' light, and what overlays show, if that is known."""


def more_of(
    solution: Solution,
    baked: Sequence[BakeObject],
    geometry: TexelGeometry,
    light: TexelLight | None,
    part: str,
) -> More:
    """Return the `statistics` of the objects' light and what overlays show; of a residual only the links."""
    links = solution.link_record()
    if light is None:
        return (), BakeDetails(links, ())
    return statistics(baked, geometry, light, part), details(solution, links, geometry, light)


def details(solution: Solution, links: LinkRecord, geometry: TexelGeometry, light: TexelLight) -> BakeDetails:
    """Keep what overlays show.

    Parameters
    ----------
    light : TexelLight
        With noise and state.
    """
    local, scratch = solution.local_pass, geometry.scratch
    misfit = scratch.empty(len(geometry))
    noise = scratch.zeros(len(geometry), np.float32) if light.noise is None else light.noise
    unit = 0.0
    for rows in tiles(len(geometry), CHUNK):
        irradiance = (light.direct[rows] + light.indirect[rows]) @ MEANS
        expected = local.elements.irradiance_at(geometry.triangle[rows], geometry.barycentric[rows])
        misfit[rows] = expected - irradiance
        unit = max(unit, float(np.abs(misfit[rows]).max()), float(noise[rows].max()))
    unit = unit or 1.0
    state = texel_state(light)
    pages = []
    for index in geometry.index:
        states, errors = scratch.empty(index.shape, np.uint8), scratch.empty((2, *index.shape), np.float16)
        for rows in tiles(len(index), max(CHUNK // len(index), 1)):
            here = index[rows] >= 0
            number = index[rows][here]
            states[rows], errors[:, rows] = NO_TEXEL_HERE, 0.0
            states[rows][here] = state[number]
            errors[0, rows][here] = noise[number] / unit
            errors[1, rows][here] = misfit[number] / unit
        pages.append(PageDetails(states, errors[0], errors[1], unit))
    return BakeDetails(links, tuple(pages))


def texel_state(light: TexelLight) -> Array:
    """Return (n,) uint8 the state of texels: what geometry does to them, or that they are shut in."""
    state = np.zeros(len(light.direct), dtype=np.uint8) if light.state is None else light.state.copy()
    for rows in tiles(len(state)):
        lit = (light.direct[rows] + light.indirect[rows]).any(axis=1)
        state[rows][((state[rows] == 0) | (state[rows] == TOUCHED)) & ~lit] = ENCLOSED
    return state


def statistics(
    baked: Sequence[BakeObject], geometry: TexelGeometry, light: TexelLight, part: str
) -> tuple[dict[str, Any], ...]:
    """Sum up the light on the fronts of objects, for the report.

    Parameters
    ----------
    part : "all", "direct" or "indirect"
        Which light.

    Returns
    -------
    statistics : tuple of dict
        Of each object: "irradiance_W_m2" (the mean of the channels) and "illuminance_lx" (at `EFFICACY`),
        each with "minimum", "mean" (by area), "maximum" and "uniformity"; empty without texels.
    """
    parts = {"direct": (light.direct,), "indirect": (light.indirect,)}.get(
        part, (light.direct, light.indirect)
    )
    state = texel_state(light)
    # By object, for a page may have thousands of them; by texel within.
    ends = np.cumsum([0, *(int(geometry.counts[item.rows].sum()) for item in baked)])
    texels, place = geometry.scratch.empty(int(ends[-1]), np.int32), ends[:-1].copy()
    owner = np.full(len(geometry.triangles), -1, dtype=np.int32)
    for number, item in enumerate(baked):
        owner[item.rows] = number
    for rows in tiles(len(geometry), CHUNK):
        object_of = owner[geometry.triangle[rows]]
        order = np.argsort(object_of, kind="stable")
        numbers, first, count = np.unique(object_of[order], return_index=True, return_counts=True)
        for number, start, run in zip(numbers, first, count, strict=True):
            if number >= 0:
                texels[place[number] : place[number] + run] = rows.start + order[start : start + run]
                place[number] += run
    found: list[dict[str, Any]] = []
    for start, stop in pairwise(ends):
        watts, lumens, areas = lit_values(texels[start:stop], parts, geometry, state)
        of_watts, of_lumens = light_statistics(watts, areas), light_statistics(lumens, areas)
        if of_watts is None or of_lumens is None:
            found.append({})
            continue
        found.append({"irradiance_W_m2": of_watts.as_dict(), "illuminance_lx": of_lumens.as_dict()})
    return tuple(found)


def baked_with_figures(
    baked: Sequence[BakeObject], pages: Sequence[int], geometry: TexelGeometry, areas: Array
) -> tuple[BakedObject, ...]:
    """Return objects with their lightmap UVs, page, texels per meter, and share of the page's texels.

    pages: Parallel to `baked`.
    areas (t,): Of the scene's triangles [m²].
    """
    found = []
    for item, page in zip(baked, pages, strict=True):
        uv, own = geometry.uv[item.rows], areas[item.rows]
        there = geometry.page_of_triangle[item.rows] == page
        size = np.where(there, texel_areas(uv, own, len(geometry.index[page])), np.inf)
        texels = geometry.counts[item.rows].sum()
        share = float(texels / max(geometry.page_start[page + 1] - geometry.page_start[page], 1))
        found.append(BakedObject(item, uv, page, _density(size, own), share))
    return tuple(found)


def _density(texel_area: Array, areas: Array) -> float | None:
    """Return the texels per meter of an object, the median over its surface; None if it has none.

    texel_area (t,): Of each of its triangles; endless where it has no texels.
    """
    density = 1.0 / np.sqrt(np.maximum(texel_area, 1e-300))
    order = np.argsort(density, kind="stable")
    surface = np.cumsum(areas[order])
    if surface[-1] <= 0.0:
        return None
    return float(density[order[np.searchsorted(surface, 0.5 * surface[-1])]])


def lit_values(
    texels: Array, parts: Sequence[Array], geometry: TexelGeometry, state: Array
) -> tuple[Array, Array, Array]:
    """Return irradiance, illuminance and area of an object's `lit_texels`: (k,) each."""
    lit = lit_texels(state[texels]) if len(texels) else np.zeros(0, dtype=bool)
    watts, lumens, areas = (geometry.scratch.empty(np.count_nonzero(lit)) for _ in range(3))
    at = 0
    for rows in tiles(len(texels), CHUNK):
        covered = texels[rows][lit[rows]]
        irradiance = np.asarray(sum(part[covered] for part in parts))
        here = slice(at, at + len(covered))
        watts[here], lumens[here] = irradiance @ MEANS, luminous(irradiance, EFFICACY)
        areas[here] = geometry.texel_area[geometry.triangle[covered]] * geometry.share[covered]
        at += len(covered)
    return watts, lumens, areas
