"""Links from lamps and the sky to elements: their direct irradiance, refined like any link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .hierarchy import LEAF, Hierarchy, split_in_four
from .lights import EnvironmentLight, Light
from .links import points_in
from .sampling import cosine_hemisphere, stratified_square, to_world
from .visibility import RayCaster

LAMP_SAMPLES = 4
"""Lamp samples of each of an element's four sample points."""
SKY_RAYS = 16
"""Hemisphere rays of each of an element's four sample points."""
CHUNK = 1 << 14
"""Elements measured at once; bounds the temporaries to some 60 MB."""


@dataclass(frozen=True)
class LightLinks:
    """How strongly each light lights each linked element, per unit of its strength.

    Attributes
    ----------
    receiver : (l,) int32
    light : (l,) int32
        Row of the scene's lights.
    gain : (l,) float32
        Area mean of irradiance per unit of strength, visibility included.
    """

    receiver: np.ndarray
    light: np.ndarray
    gain: np.ndarray

    def __len__(self) -> int:
        return len(self.receiver)

    def irradiance(self, strengths: np.ndarray, n_elements: int) -> np.ndarray:
        """Return (n_elements, 3): each element's own share for (n_lights, 3) strengths."""
        total = np.zeros((n_elements, 3))
        for channel in range(3):
            total[:, channel] = np.bincount(
                self.receiver, self.gain * strengths[self.light, channel], minlength=n_elements
            )
        return total


def light_strengths(lights: Sequence[Light]) -> np.ndarray:
    """Return (n_lights, 3): what each light's gain is multiplied with."""
    return np.array([light.strength for light in lights], dtype=np.float64).reshape(-1, 3)


def link_lights(
    hierarchy: Hierarchy,
    lights: Sequence[Light],
    caster: RayCaster,
    misplaced_power: float,
    min_area: float,
    seed: int,
) -> LightLinks:
    """Link every light to the elements it reaches, splitting where its light varies.

    Parameters
    ----------
    misplaced_power : float
        BF_ε [W]: an element is split while (spread of irradiance) × area exceeds it.
    min_area : float
        A_ε [m²]: no element becomes smaller.
    """
    receivers, numbers, gains = [], [], []
    for number, light in enumerate(lights):
        strength = float(np.max(light.strength))
        if strength <= 0.0:
            continue
        waiting = np.arange(len(hierarchy.faces))
        while len(waiting):
            gain, doubt = measure_light(hierarchy, light, caster, waiting, seed + 101 * number)
            area = hierarchy.area[waiting]
            split = (doubt * area * strength > misplaced_power) & (
                (hierarchy.first_child[waiting] != LEAF) | (area >= 4 * min_area)
            )
            kept = ~split & (gain > 0)
            receivers.append(waiting[kept])
            gains.append(gain[kept])
            numbers.append(np.full(int(kept.sum()), number))
            parents = waiting[split]
            hierarchy.subdivide(parents[hierarchy.first_child[parents] == LEAF])
            waiting = (hierarchy.first_child[parents][:, None] + np.arange(4)).ravel()
    empty = [np.zeros(0)]
    return LightLinks(
        np.concatenate(receivers or empty).astype(np.int32),
        np.concatenate(numbers or empty).astype(np.int32),
        np.concatenate(gains or empty).astype(np.float32),
    )


def measure_light(
    hierarchy: Hierarchy, light: Light, caster: RayCaster, elements: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Measure one light's mean irradiance on elements, per unit of strength, and its doubt.

    Returns
    -------
    gain, doubt : (n,) float64
    """
    gain, doubt = np.empty(len(elements)), np.empty(len(elements))
    for first in range(0, len(elements), CHUNK):
        rows = slice(first, min(first + CHUNK, len(elements)))
        chosen = elements[rows]
        quarters = split_in_four(hierarchy.corners[chosen])
        points = points_in(quarters, stratified_square(chosen, 4, seed)).reshape(-1, 3)
        keys = (4 * chosen[:, None] + np.arange(4)).ravel()
        normals = np.repeat(hierarchy.normal[chosen], 4, axis=0)
        if isinstance(light, EnvironmentLight):
            open_share = sky_visibility(points, normals, SKY_RAYS, caster, keys, seed)
            values = np.pi * open_share.reshape(-1, 4)
            # Expected noise of a quarter's mean is not a difference between quarters.
            noise = np.pi * np.sqrt(open_share * (1 - open_share) / SKY_RAYS).reshape(-1, 4).mean(axis=1)
            gain[rows] = values.mean(axis=1)
            doubt[rows] = np.maximum(values.std(axis=1) - noise, 0.0)
            continue
        open_gain = light.unit_irradiance(points, normals)
        share = lamp_visibility(light, points, normals, open_gain > 0, LAMP_SAMPLES, caster, keys, seed)
        values = (open_gain * share).reshape(-1, 4)
        gain[rows] = values.mean(axis=1)
        missed = open_gain.reshape(-1, 4).mean(axis=1) / (4 * LAMP_SAMPLES + 2.0)
        doubt[rows] = np.hypot(values.std(axis=1), missed)
    return gain, doubt


def lamp_visibility(
    light: Light,
    points: np.ndarray,
    normals: np.ndarray,
    facing: np.ndarray,
    samples: int,
    caster: RayCaster,
    keys: np.ndarray,
    seed: int,
) -> np.ndarray:
    """Return (n,) the share of each lit point's irradiance that is not blocked, by shadow rays.

    Parameters
    ----------
    facing : (n,) bool
        Points the lamp can reach at all; the others return 0.
    keys : (n,) int
        With `seed`, what places each point's samples.
    """
    share = np.zeros(len(points))
    rows = np.flatnonzero(facing)
    if len(rows) == 0:
        return share
    unit = stratified_square(keys[rows], samples, seed)
    directions, distances, weights = light.shadow_rays(points[rows], normals[rows], unit)
    free = np.zeros(weights.shape, dtype=bool)
    point, sample = np.nonzero(weights > 0)
    start = points[rows][point] + caster.surface_offset * normals[rows][point]
    free[point, sample] = caster.visible(start, directions[point, sample], distances[point, sample])
    total = weights.sum(axis=1)
    share[rows] = np.where(total > 0, (weights * free).sum(axis=1) / np.maximum(total, 1e-300), 0.0)
    return share


def sky_visibility(
    points: np.ndarray, normals: np.ndarray, rays: int, caster: RayCaster, keys: np.ndarray, seed: int
) -> np.ndarray:
    """Return (n,) the cosine-weighted share of each point's hemisphere that meets no surface."""
    unit = stratified_square(keys, rays, seed)
    directions = to_world(cosine_hemisphere(unit), normals).reshape(-1, 3)
    start = np.repeat(points + caster.surface_offset * normals, rays, axis=0)
    free = caster.visible(start, directions, np.full(len(start), np.inf))
    return np.asarray(free.reshape(-1, rays).mean(axis=1))
