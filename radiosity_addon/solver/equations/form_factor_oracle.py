"""Decides by form factors alone which pairs are linked (handout §4.2, Oracle1).

The handout estimates the fraction of what leaves a source that reaches a receiver, cheaply
and without occlusion. Here the estimate is a *bound*: no pair accepted by it exchanges more.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array
from ..hierarchy import Hierarchy

HEIGHT_TOLERANCE = 1e-9
"""Heights below this share of the two radii count as 0, as in `pairs.element_factors`."""

CHUNK = 1 << 18
"""Pairs bounded at once; their temporaries take some 100 MB."""


def source_factor_bounds(hierarchy: Hierarchy, receiver: Array, source: Array) -> Array:
    """Bound F_sr, the fraction of what leaves the source that can reach the receiver.

    From the smaller side the other one, of area A, has at most

        min(1, cosθ cosθ' A / (π d²))

    with the shortest distance d that bounding spheres and planes allow, and each cosine that
    of the highest corner over the other's plane at that distance. Far away this is the disk
    approximation. A_s F_sr = A_r F_rs gives the fraction of the source.

    receiver, source (n,) int: Elements.
    Returns bounds (n,) float64 in [0, 1]: 0 exactly where either lies wholly behind the other's plane.
    """
    bounds = np.empty(len(receiver))
    for start in range(0, len(receiver), CHUNK):
        rows = slice(start, start + CHUNK)
        bounds[rows] = _chunk_bounds(hierarchy, receiver[rows], source[rows])
    return bounds


def _chunk_bounds(hierarchy: Hierarchy, receiver: Array, source: Array) -> Array:
    receiver_corners, source_corners = hierarchy.corners[receiver], hierarchy.corners[source]
    center_to, center_of = receiver_corners.mean(axis=1), source_corners.mean(axis=1)
    sizes = _radius(receiver_corners, center_to) + _radius(source_corners, center_of)
    over_to = np.einsum("nck,nk->nc", source_corners - center_to[:, None], hierarchy.normal[receiver])
    over_of = np.einsum("nck,nk->nc", receiver_corners - center_of[:, None], hierarchy.normal[source])
    rise_to, rise_of = over_to.max(axis=1), over_of.max(axis=1)
    mutual = (rise_to > HEIGHT_TOLERANCE * sizes) & (rise_of > HEIGHT_TOLERANCE * sizes)

    apart = np.linalg.norm(center_of - center_to, axis=1) - sizes
    nearest = np.maximum.reduce(
        [apart, over_to.min(axis=1), over_of.min(axis=1), np.zeros(len(receiver_corners))]
    )
    area_to, area_of = hierarchy.area[receiver], hierarchy.area[source]
    # cosθ = height / distance, for the nearest possible points.
    heights = np.minimum(rise_to, nearest) * np.minimum(rise_of, nearest)
    widest = np.pi * nearest**4
    full = np.maximum(area_to, area_of) * heights
    from_smaller = np.where(full < widest, full / np.where(widest > 0, widest, 1.0), 1.0)
    of_source = np.minimum(area_to / area_of, 1.0) * from_smaller
    return np.where(mutual, of_source, 0.0)


def _radius(corners: Array, center: Array) -> Array:
    """Return (n,) the distance from each center to its farthest corner."""
    return np.asarray(np.linalg.norm(corners - center[:, None], axis=2).max(axis=1))


def oracle1(bound: Array, area_to: Array, area_of: Array, error: float, min_area: float) -> Array:
    """Return (n,) whether pairs are linked as they are (handout §4.2, Oracle1).

    They are if both sides are smaller than A_ε, or if F_sr < F_ε.

    bound (n,): F_sr of `source_factor_bounds`.
    area_to, area_of (n,) [m²]: Of receivers and sources.
    error: F_ε.
    min_area: A_ε [m²].
    """
    return np.asarray((bound < error) | ((area_to < min_area) & (area_of < min_area)))
