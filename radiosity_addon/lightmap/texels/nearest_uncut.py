"""The nearest uncut texels of a divided one; they answer hits in strips too narrow for a cell."""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from ...rays import SIGHT_LIFT, RayCaster, free_segment
from ...solver.gather import NOTHING
from .occlusion import Crossings
from .texel_geometry import NO_TEXEL

MAX_RISE = 0.1
"""A neighbor's center may rise so much over the hit's plane, as a part of its distance."""

NEIGHBOR_COSINE = 0.9
"""Cosine between the normals of a texel and its neighbor: on the page it may be anything."""

_AROUND = np.array([[r, c] for r in (-1, 0, 1) for c in (-1, 0, 1) if r or c])


def whole_neighbor(
    crossings: Crossings, caster: RayCaster, texel: Array, position: Array, below: Array
) -> Array:
    """Return (h,) int32: the nearest whole neighbor of each texel whose center a point sees, or NOTHING.

    texel (h,) int.
    position (h, 3): Points on them.
    below (h,) bool: Whether the points are below a hood: then the neighbor must be as well, and else must
        not.
    """
    geometry = crossings.geometry
    around = np.full((len(texel), len(_AROUND)), NO_TEXEL, dtype=np.int32)
    for page, numbers in enumerate(geometry.index):
        on_page = np.flatnonzero(geometry.page[texel] == page)
        row = geometry.row[texel[on_page]][:, None] + _AROUND[:, 0]
        column = geometry.column[texel[on_page]][:, None] + _AROUND[:, 1]
        inside = (row >= 0) & (row < len(numbers)) & (column >= 0) & (column < len(numbers))
        last = len(numbers) - 1
        near = numbers[np.clip(row, 0, last), np.clip(column, 0, last)]
        around[on_page] = np.where(inside, near, NO_TEXEL)
    whole = (around != NO_TEXEL) & ~crossings.crossed[around]
    whole &= crossings.occluded[around] == below[:, None]
    normal = geometry.surface_normal[texel]
    along = geometry.position[around] - position[:, None]
    distance = np.linalg.norm(along, axis=2)
    whole &= np.abs(np.einsum("hak,hk->ha", along, normal)) <= MAX_RISE * distance
    whole &= np.einsum("hak,hk->ha", geometry.surface_normal[around], normal) > NEIGHBOR_COSINE
    lift = SIGHT_LIFT * caster.surface_offset
    hit, which = np.nonzero(whole)
    end = geometry.position[around[hit, which]] + lift * geometry.surface_normal[around[hit, which]]
    seen = free_segment(caster, position[hit] + lift * normal[hit], end)
    distance = np.where(whole, distance, np.inf)
    distance[hit[~seen], which[~seen]] = np.inf
    best = distance.argmin(axis=1)
    every = np.arange(len(texel))
    return np.where(np.isfinite(distance[every, best]), around[every, best], NOTHING)
