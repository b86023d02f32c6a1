"""Form factors from a point to round shapes: caps, which discs and spheres subtend, and ellipses.

The same outline integral as for polygons, F = 1/(2π) n · ∮ ω × dω, along a curve.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

Float64Array = npt.NDArray[np.float64]

PANEL = 16
"""Gauss nodes a panel of an ellipse's arc; also the first number of nodes on a whole one."""

MAX_NODES = 4096
"""Nodes on an ellipse at most; points within 1/500 of the rim reach this limit."""

ELLIPSE_TOLERANCE = 1e-8
"""Change of an ellipse's factor between a number of nodes and its double that ends the doubling."""

_CHUNK_NODES = 1 << 18
"""Nodes worked on at a time; some ten arrays of 2 MB each."""


def cap_cosine(cosine: npt.ArrayLike, sine_half: npt.ArrayLike) -> Float64Array:
    """Return the factor that replaces cosθ where a lamp is a round cap instead of a point.

    The projected solid angle of a spherical cap of half angle α about a direction at θ from
    the normal, clipped to the horizon, divided by π sin²α. It is cosθ while the whole cap is
    up (θ + α ≤ π/2), 0 once it has set, and in between, with cosφ = −cotα cotθ where the
    cap's rim meets the horizon, the outline integral along rim and horizon (the closed form
    of Snyder 1996 in another guise):

        atan2(sinα sinφ, cosα sinθ − sinα cosθ cosφ) + φ sin²α cosθ − sinα cosα sinθ sinφ

    cosine (...) float: cosθ between the receiver's normal and the cap's axis.
    sine_half (...) float in [0, 1]: sinα; α ≤ π/2.
    Returns effective (...) float64 in [0, 1].
    """
    cosine, sine_half = np.broadcast_arrays(np.asarray(cosine, np.float64), np.asarray(sine_half, np.float64))
    effective = np.array(np.maximum(cosine, 0.0))
    rows = np.abs(cosine) < sine_half
    if not rows.any():
        return effective
    height, sin_a = cosine[rows], sine_half[rows]
    cos_a = np.sqrt(np.maximum(1.0 - sin_a * sin_a, 0.0))
    sin_t = np.sqrt(np.maximum(1.0 - height * height, 0.0))
    cos_p = np.clip(-height * cos_a / np.maximum(sin_a * sin_t, np.finfo(float).tiny), -1.0, 1.0)
    sin_p = np.sqrt(1.0 - cos_p * cos_p)
    horizon = np.arctan2(sin_a * sin_p, cos_a * sin_t - sin_a * height * cos_p)
    rim = np.arccos(cos_p) * sin_a * sin_a * height - sin_a * cos_a * sin_t * sin_p
    effective[rows] = np.maximum(horizon + rim, 0.0) / (np.pi * sin_a * sin_a)
    return effective


def point_to_ellipse(
    points: npt.ArrayLike,
    normals: npt.ArrayLike,
    center: npt.ArrayLike,
    axis_u: npt.ArrayLike,
    axis_v: npt.ArrayLike,
) -> Float64Array:
    """Return the form factor from oriented points to one ellipse, seen from its front.

    Unoccluded and clipped to the receiver's horizon. The outline is integrated on the true
    curve: by the trapezoidal rule, which converges exponentially on a closed smooth curve,
    or by Gauss panels on the arc above the horizon; nodes are doubled until the factor
    changes by less than `ELLIPSE_TOLERANCE`. Points closer to the rim than about 1/500 of
    the radius stop at `MAX_NODES` and may be off by some 1e-3.

    points, normals (n, 3).
    center (3,).
    axis_u, axis_v (3,): Conjugate half axes; the outline is center + u cosφ + v sinφ and the front is where u
        × v points.
    Returns factors (n,) float64 in [0, 1].
    """
    points, normals = np.asarray(points, dtype=np.float64), np.asarray(normals, dtype=np.float64)
    u, v = np.asarray(axis_u, dtype=np.float64), np.asarray(axis_v, dtype=np.float64)
    factors = np.zeros(len(points))
    offset = np.asarray(center, dtype=np.float64) - points
    height = np.einsum("ij,ij->i", offset, normals)
    swing = np.hypot(normals @ u, normals @ v)
    in_front = offset @ np.cross(u, v) < 0.0
    for cut in (False, True):
        rows = np.flatnonzero(in_front & ((np.abs(height) < swing) if cut else (height >= swing)))
        nodes, factor = PANEL, np.full(len(rows), np.inf)
        while len(rows) and nodes <= MAX_NODES:
            step = max(_CHUNK_NODES // nodes, 1)
            finer = np.concatenate(
                [
                    _arc_factor(offset[part], normals[part], u, v, nodes, cut)
                    for part in (rows[start : start + step] for start in range(0, len(rows), step))
                ]
            )
            factors[rows] = finer
            moved = np.abs(finer - factor) > ELLIPSE_TOLERANCE
            rows, factor, nodes = rows[moved], finer[moved], 2 * nodes
    return np.clip(factors, 0.0, 1.0)


def _arc_factor(
    offset: Float64Array, normals: Float64Array, u: Float64Array, v: Float64Array, nodes: int, cut: bool
) -> Float64Array:
    """Return (m,) factors from the arc above the horizon, or the whole ellipse, with a number of nodes."""
    height, rise_u, rise_v = np.einsum("ij,ij->i", offset, normals), normals @ u, normals @ v
    summit = np.arctan2(rise_v, rise_u)
    if cut:
        half = np.arccos(np.clip(-height / np.hypot(rise_u, rise_v), -1.0, 1.0))
        where, weight = _gauss_panels(nodes)
    else:
        half = np.full(len(offset), np.pi)
        where, weight = (2.0 * np.arange(nodes) + 1.0) / nodes - 1.0, np.full(nodes, 2.0 / nodes)
    angle = summit[:, None] + half[:, None] * where
    cosine, sine = np.cos(angle), np.sin(angle)

    # r × dr/dφ = c × v cosφ − c × u sinφ + u × v, and |r|², along r = c + u cosφ + v sinφ.
    turn_v = np.einsum("ij,ij->i", np.cross(offset, v), normals)
    turn_u = np.einsum("ij,ij->i", np.cross(offset, u), normals)
    turn = turn_v[:, None] * cosine - turn_u[:, None] * sine + (normals @ np.cross(u, v))[:, None]
    square = (
        np.einsum("ij,ij->i", offset, offset)[:, None]
        + 2.0 * ((offset @ u)[:, None] * cosine + (offset @ v)[:, None] * sine)
        + (u @ u) * cosine * cosine + (v @ v) * sine * sine + 2.0 * (u @ v) * sine * cosine
    )  # fmt: skip
    total = ((turn / square) @ weight) * half
    if cut:
        ends = summit + np.array([[-1.0], [1.0]]) * half
        rim = offset + np.cos(ends)[..., None] * u + np.sin(ends)[..., None] * v
        total += _horizon_turn(rim[1], rim[0], normals)
    return -total / (2.0 * np.pi)


def _horizon_turn(start: Float64Array, end: Float64Array, normals: Float64Array) -> Float64Array:
    """Return the angle about the normal from one direction in the horizon to another, within ±π."""
    sine = np.einsum("ij,ij->i", np.cross(start, end), normals)
    return np.arctan2(sine, np.einsum("ij,ij->i", start, end))


@lru_cache(maxsize=16)
def _gauss_panels(nodes: int) -> tuple[Float64Array, Float64Array]:
    """Return nodes in (-1, 1) and weights of equal panels of `PANEL` Gauss-Legendre nodes each."""
    panels = nodes // PANEL
    where, weight = np.polynomial.legendre.leggauss(PANEL)  # type: ignore[no-untyped-call, unused-ignore]
    centers = (2.0 * np.arange(panels) + 1.0) / panels - 1.0
    return (centers[:, None] + where / panels).ravel(), np.tile(weight / panels, panels)
