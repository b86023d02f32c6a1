"""The power that lamps bring to surfaces, measured by rays from them, independently of the links."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeGuard

import numpy as np

from ...lights import Emitter, EnvironmentLight, Light, SkyPatch, SunLight
from ...numerics import LAMP_STEP, Array, Stream, irradiance_under_sky, stratified_square
from ...rays import NO_HIT, RayCaster
from ...scene import Faces, Scene
from ..hierarchy import Hierarchy
from ..links import LightLinks

LAMP_RAYS = 1 << 17
"""Rays of all lamps together, …"""

LEAST_RAYS, MOST_RAYS = 1 << 8, 1 << 14
"""… and of each at least and at most."""

STANDARD_ERRORS = 3.0
"""Standard errors by which more may arrive than these rays say, …"""

SOFT = 0.02
"""… and by this part of it: rays leave a soft lamp in parallel, but surfaces look at its middle."""


LYING = 1.0 / 32.0
"""A lamp lies in a surface that is nearer than this part of a ray offset: two float32 steps of the scene."""


def is_stopped(light: Light) -> TypeGuard[Emitter]:
    """Return whether each part of a light's power ends at one surface, or none."""
    return isinstance(light, Emitter) and light.casts_shadow


def fate(hierarchy: Hierarchy, caster: RayCaster, origins: Array, directions: Array) -> tuple[Array, Array]:
    """Return (n,) whether rays end on a black back, and whether they leave the scene."""
    hits = caster.intersect(origins, directions)
    escaped = hits.triangle < 0
    face = hierarchy.faces.of_triangle[(~hits.front).astype(int), hits.triangle]
    return ~escaped & (face < 0), escaped


def lost_by_lamp(
    light: Emitter, scene: Scene, hierarchy: Hierarchy, caster: RayCaster, seed: int, rays: int = MOST_RAYS
) -> tuple[float, float, float]:
    """Return the shares of a lamp's power that end on black backs and leave the scene, and their error.

    caster: Of surfaces; it knows the one for lamps.
    """
    place = stratified_square(np.zeros(1, np.int64), rays, seed + Stream.LAMP_ORIGINS)[0]
    way = stratified_square(np.zeros(1, np.int64), rays, seed + Stream.LAMP_DIRECTIONS)[0]
    origins, directions, share = light.emit(place, way)
    start = _off_surfaces(scene, caster, origins, directions)
    black, escaped = fate(hierarchy, caster.for_lamps, start, directions)
    weight = share / max(float(share.sum()), 1e-300)
    lost = float(weight @ (black | escaped))
    error = float(np.sqrt((weight * weight) @ ((black | escaped) - lost) ** 2))
    return float(weight @ black), float(weight @ escaped), error


def _off_surfaces(scene: Scene, caster: RayCaster, origins: Array, directions: Array) -> Array:
    """Return (n, 3) where rays of lamps start: a surface that a lamp lies in does not shade it."""
    near = LYING * caster.surface_offset
    hits = caster.for_lamps.intersect(origins, directions)
    height = np.abs(np.einsum("nk,nk->n", directions, scene.face_normals[hits.triangle]))
    met = (hits.triangle != NO_HIT) & (height * np.where(height > 0, hits.distance, 0.0) < near)
    beyond = np.where(met, hits.distance + near, 0.0)
    return np.asarray(origins + beyond[:, None] * directions)


def lamps_within_power(
    links: LightLinks, scene: Scene, hierarchy: Hierarchy, caster: RayCaster, seed: int
) -> LightLinks:
    """Return light links that bring surfaces no more of a lamp's power than its own rays do.

    Few samples of a large element next to a lamp may say many times its power, and rays that start above
    thin solids light both their sides. Where links say less, they stay: they are better than rays.
    """
    lamps = [number for number, light in enumerate(scene.lights) if is_stopped(light) and light.flux.any()]
    if not lamps:
        return links
    rays = min(max(LAMP_RAYS // len(lamps), LEAST_RAYS), MOST_RAYS)
    receiver = links.receiver
    gain = hierarchy.area[receiver] * hierarchy.opacity[receiver] * links.gain.mean(axis=1)
    gain *= scene.in_shadows[hierarchy.faces.triangle[hierarchy.face[receiver]]]
    arriving = np.bincount(links.light, gain, minlength=len(scene.lights))
    scale = np.ones(len(scene.lights))
    for number in lamps:
        light = scene.lights[number]
        assert isinstance(light, Emitter)
        power = float(light.flux.mean())
        said = arriving[number] * float(light.strength.mean())
        own_seed = seed + LAMP_STEP * number
        black, escaped, error = lost_by_lamp(light, scene, hierarchy, caster, own_seed, rays)
        most = (1.0 + SOFT) * (1.0 - black - escaped) + STANDARD_ERRORS * (error + 1.0 / rays)
        if said > most * power:
            scale[number] = (1.0 - black - escaped) * power / said
    if (scale == 1.0).all():
        return links
    return replace(links, gain=links.gain * scale[links.light, None].astype(np.float32))


def light_power(scene: Scene, faces: Faces) -> float:
    """Return the power Φ [W] that enters the scene, in its largest channel: the unit of BF_ε.

    Emission of all sides, lamps, and what a sun or sky would send onto the scene's box.
    """
    total = faces.area @ faces.emission
    if len(scene) == 0:
        return 0.0
    corners = scene.triangles.reshape(-1, 3)
    width = corners.max(axis=0) - corners.min(axis=0)
    sides = np.array([width[1] * width[2], width[2] * width[0], width[0] * width[1]])
    for light in scene.lights:
        if isinstance(light, SunLight | SkyPatch):
            total = total + light.strength * float(np.abs(np.asarray(light.direction)) @ sides)
        elif isinstance(light, EnvironmentLight):
            total = total + irradiance_under_sky(light.strength) * float(sides.sum())
        elif isinstance(light, Emitter):
            total = total + light.flux
    return float(np.max(total))
