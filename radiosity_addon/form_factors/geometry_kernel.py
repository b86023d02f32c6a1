"""Pairs of points: geometry term, kernel, throughput, visibility.

All are symmetric in the two points: what leaves one for the other finds the same way back.
Whatever the solver samples between two surfaces is one of these.

| function | symbol | unit |
|---|---|---|
| `geometry_term`, `ray_geometry_term` | G = cosθ cosθ' / r² (handout (2.20), (2.21)) | 1/m² |
| `kernel` | κ = G / π, without visibility (2.25); the handout calls it G from its section 3 on | 1/m² |
| `throughput` | T = dω dA = G dA dA' (1.2), (1.3) | m² sr |
| `sees` | V: whether nothing lies between (2.18) | |
"""

from __future__ import annotations

import numpy as np

from ..numerics import Array
from ..rays import RayCaster

MIN_SHARE = 1e-6
"""Lower bound of the shares that cut-outs pass and stop, in results of `visibility_of`."""

_TINY = 1e-150
"""Least square of a distance: keeps a point and itself from 0/0, and its own square above 0."""


def geometry_term(points: Array, normals: Array, other_points: Array, other_normals: Array) -> Array:
    """Return G = cosθ cosθ' / r² [1/m²]; 0 where either faces away from the other.

    points, normals, other_points, other_normals (..., 3): Broadcast against each other; normals are unit.
    Returns geometry (...) float.
    """
    along = other_points - points
    square = np.maximum(np.einsum("...k,...k->...", along, along), _TINY)
    # The cosines of the unit direction, whose two lengths go into the one division by r⁴.
    cosine = np.maximum(np.einsum("...k,...k->...", along, normals), 0.0)
    other = np.maximum(-np.einsum("...k,...k->...", along, other_normals), 0.0)
    return np.asarray(cosine * other / (square * square))


def ray_geometry_term(cosine: Array, other_cosine: Array, distance: Array) -> Array:
    """Return G [1/m²] of rays with known cosines and lengths.

    cosine, other_cosine (...) float: Between the ray and the normals at its two ends; negative ones count as
        0.
    distance (...) float [m]: Where it is 0 the term is 0: a point does not light itself.
    """
    square = distance * distance
    above = np.maximum(cosine, 0.0) * np.maximum(other_cosine, 0.0)
    return np.asarray(above / np.where(square > 0.0, square, np.inf))


def kernel(points: Array, normals: Array, other_points: Array, other_normals: Array) -> Array:
    """Return κ = G/π [1/m²], the share of a matte surface's light that travels between the points, per area.

    B(x) = E(x) + ρ(x) ∫ B(x') κ(x, x') V(x, x') dA' (handout (2.25)). Parameters as for
    `geometry_term`.
    """
    geometry = geometry_term(points, normals, other_points, other_normals)
    geometry /= np.pi
    return geometry


def throughput(geometry: Array, area: Array | float, other_area: Array | float) -> Array:
    """Return T = G dA dA' [m² sr] of pairs of small areas (handout (1.2), (1.3)).

    Radiance times throughput is power, and T/π is what form factors are made of:
    A_i F_ij = ∬ κ dA dA'.

    geometry (...) float [1/m²]: G of the pair.
    area, other_area (...) float [m²]: With an `area` of 1 it is what a square meter there receives per
        radiance.
    """
    return np.asarray(geometry * area * other_area)


def visibility_of(
    caster: RayCaster, points: Array, normals: Array, other_points: Array, other_normals: Array
) -> Array:
    """Return V of pairs of points on surfaces: the share of light that passes between them.

    Both ends leave their surfaces by the caster's offset, so that no surface hides itself.
    The geometry term handles pairs that face away from each other.

    points, normals, other_points, other_normals (n, 3).
    Returns visible (n,) bool or: Never 0 or 1 where a cut-out was met: others may find what few rays between
        do not.
    """
    start = points + caster.surface_offset * normals
    along = other_points + caster.surface_offset * other_normals - start
    distance = np.linalg.norm(along, axis=1)
    return caster.passing(start, along / np.maximum(distance, _TINY)[:, None], distance, MIN_SHARE)
