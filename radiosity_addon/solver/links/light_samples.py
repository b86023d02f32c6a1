"""Light at points by few rays: a lamp's, and the sky's."""

from __future__ import annotations

import numpy as np

from ...lights import EnvironmentLight, Lamp, LampGroup
from ...numerics import Array, Stream, cosine_hemisphere, stratified_square, to_world
from ...rays import RayCaster, passing_light

CHUNK = 1 << 13
"""Elements measured at once; bounds the temporaries to some 30 MB a thread."""


def largest(values: Array) -> Array:
    """Return (n,) values, of (n, 3) by channel the largest."""
    return values if values.ndim == 1 else np.asarray(values.max(axis=1))


def lamp_light(
    light: Lamp, points: Array, normals: Array, unit: Array, caster: RayCaster
) -> tuple[Array, Array]:
    """Measure a lamp's light at points, one shadow ray each.

    points (n, k, 3).
    normals (n, 3).
    unit (n, k, 2): Places the point of the lamp each ray goes to.
    Returns gain (n, k): Unoccluded irradiance per unit of strength.
    Returns share (n,) or (n, 3): How much of it arrives, over the k points together.
    """
    flat = points.reshape(-1, 3)
    facing = np.repeat(normals, points.shape[1], axis=0)
    if isinstance(light, LampGroup):
        # What one ray stands for is the closed form of all lamps, in the mean.
        rays = light.rays_from(points, normals, unit)
        gain = points.shape[1] * rays[2].ravel()
        rows = np.flatnonzero(gain > 0)
        directions, distances, above = rays[0].reshape(-1, 3)[rows], rays[1].ravel()[rows], gain[rows]
    else:
        gain = light.unit_irradiance(flat, facing)
        rows = np.flatnonzero(gain > 0)
        directions, distances, above = (
            each[:, 0] for each in light.shadow_rays(flat[rows], facing[rows], unit.reshape(-1, 1, 2)[rows])
        )
    lamps = caster.for_lamps
    channels = (3,) if lamps.tinted else ()
    weights, passed = np.zeros(len(flat)), np.zeros((len(flat), *channels))
    start = flat[rows] + caster.surface_offset * facing[rows]
    free = passing_light(lamps, start, directions, distances) if light.casts_shadow else 1.0
    # A lamp point below the horizon is ignored: the closed form has clipped it already.
    weights[rows] = np.where(above > 0, gain[rows], 0.0)
    passed[rows] = (weights[rows].T * np.asarray(free).T).T
    shape = unit.shape[:2]
    total = weights.reshape(shape).sum(axis=1)
    arrived = passed.reshape(*shape, *channels).sum(axis=1)
    share = np.where(total > 0, arrived.T / np.where(total > 0, total, 1.0), 0.0).T
    return gain.reshape(shape), share


def sky_share(
    light: EnvironmentLight,
    points: Array,
    normals: Array,
    rays: int,
    caster: RayCaster,
    keys: Array,
    seed: int,
) -> tuple[Array, Array]:
    """Measure a sky's light at points, relative to an open sky of its radiance.

    `points` are (n, 3), or (n, rays, 3) to start every ray elsewhere.

    Returns share (n,) or (n, 3): The cosine-weighted share of each hemisphere that meets no surface, weighted
        by the relative radiance there.
    Returns error (n,): Its standard error, were the rays independent.
    """
    share = np.empty((len(points), 3) if caster.tinted else len(points))
    error = np.empty(len(points))
    for first in range(0, len(points), CHUNK):
        rows = slice(first, first + CHUNK)
        unit = stratified_square(keys[rows], rays, seed + Stream.LIGHT_RAYS)
        directions = to_world(cosine_hemisphere(unit), normals[rows])
        start = points[rows] if points.ndim == 3 else points[rows, None]
        start = np.broadcast_to(start + caster.surface_offset * normals[rows, None], directions.shape)
        endless = np.full(directions.shape[0] * rays, np.inf)
        free = passing_light(caster, start.reshape(-1, 3), directions.reshape(-1, 3), endless)
        relative = light.relative(directions)
        if caster.tinted:
            relative = relative[..., None]
        found = free.reshape(-1, rays, *free.shape[1:]) * relative
        share[rows] = found.mean(axis=1)
        error[rows] = largest(found.std(axis=1)) / np.sqrt(rays)
    return share, error
