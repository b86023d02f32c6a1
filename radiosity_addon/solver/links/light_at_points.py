"""The direct irradiance of lamps and sky at points, for equations at points."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ...lights import EnvironmentLight, Lamp, LampGroup, Light
from ...numerics import LIGHT_STEP, Array, Stream, fill_chunks, irradiance_under_sky, stratified_square
from ...rays import RayCaster
from .light_samples import lamp_light, sky_share

SHADOW_RAYS = 32
"""From a point to each lamp."""
SKY_RAYS = 256
"""From a point to the sky."""

CHUNK = 1 << 11
"""Points that a thread processes together; their sky rays take about 25 MB."""


def lamp_irradiance(
    lights: Sequence[Light], points: Array, normals: Array, caster: RayCaster, seed: int, threads: int = 0
) -> Array:
    """Return (n, 3) the direct irradiance of lamps and sky at points [W/m²].

    A lamp's closed form times the share of its shadow rays that pass; the sky by rays alone.

    points, normals (n, 3): On surfaces; unit normals.
    """
    total = np.empty((len(points), 3))
    add = partial(_irradiance, lights, points, normals, caster, seed)
    fill_chunks(add, total, len(points), CHUNK, threads)
    return total


def _irradiance(
    lights: Sequence[Light], points: Array, normals: Array, caster: RayCaster, seed: int, rows: slice
) -> Array:
    keys, facing = np.arange(rows.start, rows.stop), normals[rows]
    total = np.zeros((len(keys), 3))
    gain: Array
    for number, light in enumerate(lights):
        own_seed = seed + LIGHT_STEP * number
        if isinstance(light, EnvironmentLight):
            share, _ = sky_share(light, points[rows], facing, SKY_RAYS, caster, keys, own_seed)
            gain = irradiance_under_sky(1.0) * share
        elif isinstance(light, Lamp):
            repeated = np.repeat(points[rows, None], SHADOW_RAYS, axis=1)
            unit = stratified_square(keys, SHADOW_RAYS, own_seed + Stream.LIGHT_RAYS)
            open_gain, share = lamp_light(light, repeated, facing, unit, caster)
            # Of many lamps each ray measures the closed form a little differently.
            own = open_gain.mean(axis=1) if isinstance(light, LampGroup) else open_gain[:, 0]
            gain = (own * share.T).T
        else:
            continue
        total += (gain if gain.ndim == 2 else gain[:, None]) * light.strength
    return total
