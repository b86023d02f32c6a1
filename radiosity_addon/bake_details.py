"""What more is known after of a bake: the light summed up, errors, texels that are not what they seem."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from .bake_scene import NO_TEXEL_HERE, SHUT_IN, TOUCHED, BakeDetails, BakeObject, PageDetails
from .lightmap.light_statistics import light_statistics, told_texels
from .lightmap.sweeps import TexelLight
from .lightmap.texel_geometry import TexelGeometry
from .settings import EFFICACY
from .solver import Solution
from .solver.arrays import Array
from .solver.link_record import LinkRecord
from .solver.radiometry import luminous

MEANS = np.full(3, 1.0 / 3.0)
"""Weights of the channels in what the report gives in W/m²."""

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
    irradiance = (light.direct + light.indirect) @ MEANS
    local = solution.local_pass
    misfit = local.irradiance_at(geometry.triangle, geometry.barycentric) - irradiance
    noise = np.zeros(len(geometry)) if light.noise is None else light.noise
    unit = max(float(np.abs(misfit).max(initial=0.0)), float(noise.max(initial=0.0))) or 1.0
    state = texel_state(light)
    pages = []
    for index in geometry.index:
        here = index >= 0
        number = index[here]
        of = np.full(index.shape, NO_TEXEL_HERE, dtype=np.uint8)
        errors = np.zeros((2, *index.shape), dtype=np.float16)
        of[here] = state[number]
        errors[:, here] = noise[number] / unit, misfit[number] / unit
        pages.append(PageDetails(of, errors[0], errors[1], unit))
    return BakeDetails(links, tuple(pages))


def texel_state(light: TexelLight) -> Array:
    """Return (n,) uint8 the state of texels: what geometry does to them, or that they are shut in."""
    lit = (light.direct + light.indirect).any(axis=1)
    known = np.zeros(len(lit), dtype=np.uint8) if light.state is None else light.state
    return np.where(((known == 0) | (known == TOUCHED)) & ~lit, SHUT_IN, known).astype(np.uint8)


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
    irradiance = {"direct": light.direct, "indirect": light.indirect}.get(part, light.direct + light.indirect)
    areas = geometry.texel_area[geometry.triangle] * geometry.share
    state = texel_state(light)
    order = np.argsort(geometry.triangle, kind="stable")
    of = geometry.triangle[order]
    found: list[dict[str, Any]] = []
    for item in baked:
        mine = order[np.searchsorted(of, item.first) : np.searchsorted(of, item.first + item.count)]
        mine = mine[told_texels(state[mine])] if len(mine) else mine
        of_watts = light_statistics(irradiance[mine] @ MEANS, areas[mine])
        of_lumens = light_statistics(luminous(irradiance[mine], EFFICACY), areas[mine])
        if of_watts is None or of_lumens is None:
            found.append({})
            continue
        found.append({"irradiance_W_m2": of_watts.as_dict(), "illuminance_lx": of_lumens.as_dict()})
    return tuple(found)
