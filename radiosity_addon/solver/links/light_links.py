"""Links from lamps and the sky to elements: their direct irradiance, refined like any link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...lights import EnvironmentLight, Lamp, LampGroup, Light, SpotLight
from ...numerics import (
    LIGHT_STEP,
    Array,
    Stream,
    fill_chunks,
    irradiance_under_sky,
    points_on_triangles,
    split_in_four,
    stratified_square,
)
from ...rays import RayCaster
from ..hierarchy import LEAF, Hierarchy
from .light_samples import CHUNK, lamp_light, largest, sky_share
from .transport import push

LAMP_SAMPLES = 4
"""Shadow rays of each quarter of an element, each from a point of its own."""
GROUP_SAMPLES = 16
"""The same of many lamps together, each to one of them."""
SKY_RAYS = 16
"""Hemisphere rays of each quarter of an element."""
MAX_ELEMENTS_SHARE = 512
"""An element larger than the scene's area over this is split before its light is measured."""

NEAR_ANGLE = 0.5
"""So is one that looks larger than this (radius over distance) from the lamp, or than this part
of a spot's cone."""

SMALL, SMALL_DIVISOR = 2e-5, 4
"""Elements below this share of all area get fewer samples by this divisor: there are many of them."""

TINY = 2.5e-6
"""Those below this share get a quarter of that, over the whole element."""


@dataclass(frozen=True)
class LightLinks:
    """How strongly each light lights each linked element, per unit of its strength.

    receiver (l,) int32.
    light (l,) int32: Row of the scene's lights.
    gain (l, 4) float32: Irradiance per unit of strength on each quarter of the receiver, visibility included;
        (l, 4, 3) by channel where light passes glass.
    """

    receiver: Array
    light: Array
    gain: Array

    def __len__(self) -> int:
        return len(self.receiver)

    def take(self, chosen: Array) -> LightLinks:
        """Return some of them, row numbers or a mask."""
        return LightLinks(self.receiver[chosen], self.light[chosen], self.gain[chosen])

    @property
    def mean_gain(self) -> Array:
        """(l,) float32: the mean over quarters and channels."""
        return self.gain.mean(axis=1) if self.gain.ndim == 2 else self.gain.mean(axis=(1, 2))

    def irradiance(self, strengths: Array, n_elements: int) -> Array:
        """Return (n_elements, 4, k): each element's share on its quarters, for (n_lights, k) strengths."""
        total = np.zeros((n_elements, 4, strengths.shape[1]))
        for channel in range(strengths.shape[1]):
            total[..., channel] = self._of_channel(channel, strengths, n_elements)
        return total

    def _of_channel(self, channel: int, strengths: Array, n_elements: int) -> Array:
        """Return (n_elements, 4): the shares of one channel."""
        total = np.zeros((n_elements, 4))
        for quarter in range(4):
            gain = self.gain[:, quarter] if self.gain.ndim == 2 else self.gain[:, quarter, channel]
            arriving = gain * strengths[self.light, channel]
            total[:, quarter] = np.bincount(self.receiver, arriving, minlength=n_elements)
        return total

    def at_leaves(self, hierarchy: Hierarchy, strengths: Array) -> Array:
        """Return (e, 3) the irradiance, ancestors' included, for (n_lights, 3) strengths [W/m²]."""
        total = np.empty((hierarchy.n_elements, 3))
        # One channel at a time: quarters of all elements are large.
        for channel in range(3):
            own = self._of_channel(channel, strengths, hierarchy.n_elements)
            total[:, channel] = push(hierarchy, own[..., None])[:, 0]
        return total


def no_light_links() -> LightLinks:
    """Return an empty set of light links."""
    none = np.zeros(0, dtype=np.int32)
    return LightLinks(none, none, np.zeros((0, 4), dtype=np.float32))


def join_light_links(one: LightLinks, other: LightLinks) -> LightLinks:
    """Return the links of both."""
    return LightLinks(
        np.concatenate([one.receiver, other.receiver]),
        np.concatenate([one.light, other.light]),
        _join_gains([one.gain, other.gain]),
    )


def _join_gains(parts: list[Array]) -> Array:
    """Put gains (l, 4) and (l, 4, 3) one after the other: by channel if any are."""
    if any(gain.ndim == 3 for gain in parts):
        parts = [np.repeat(gain[..., None], 3, axis=2) if gain.ndim == 2 else gain for gain in parts]
    return np.concatenate(parts)


def link_lights(
    hierarchy: Hierarchy,
    lights: Sequence[Light],
    caster: RayCaster,
    misplaced_power: float,
    min_area: float,
    seed: int,
    threads: int = 0,
    most_elements: int = 1 << 30,
    as_if: Array | None = None,
    progress: Progress = SILENT,
) -> LightLinks:
    """Link every light to the elements it reaches, splitting where its light varies.

    misplaced_power: BF_ε [W]: an element is split while (spread of irradiance) × area exceeds it.
    min_area: A_ε [m²]: no element becomes smaller.
    most_elements: Limit of the hierarchy's elements; the largest and least certain are split first.
    as_if (n_lights,): What the lights count for instead of their strengths; those at 0 get no links.
    """
    receivers, numbers, gains = [], [], []
    coarse_area = float(hierarchy.faces.area.sum()) / MAX_ELEMENTS_SHARE
    for (number, light), part in progress.each(list(enumerate(lights))):
        strength = float(np.max(light.strength)) if as_if is None else float(as_if[number])
        if strength <= 0.0 or not isinstance(light, Lamp | EnvironmentLight):
            continue
        waiting = np.arange(len(hierarchy.faces))
        while len(waiting):
            area = hierarchy.area[waiting]
            may_split = (hierarchy.first_child[waiting] != LEAF) | (area >= 4 * min_area)
            # Where few samples may miss the light altogether, none are taken.
            blind = may_split & ((area > coarse_area) | too_near(light, hierarchy, waiting))
            blind = _affordable(hierarchy, waiting, blind, area, most_elements)
            gain = np.zeros((len(waiting), 4, *_channels(light, caster)))
            error = np.zeros(len(waiting))
            seeing = np.flatnonzero(~blind)
            gain[seeing], error[seeing] = measure_light(
                hierarchy, light, caster, waiting[seeing], seed + LIGHT_STEP * number, threads, part
            )
            misplaced = np.where(blind, np.inf, error * area * strength)
            split = may_split & (misplaced > misplaced_power)
            split = _affordable(hierarchy, waiting, split, misplaced, most_elements)
            kept = ~split & (gain > 0).any(axis=tuple(range(1, gain.ndim)))
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
        _join_gains(gains or [np.zeros((0, 4))]).astype(np.float32),
    )


def _channels(light: Lamp | EnvironmentLight, caster: RayCaster) -> tuple[int, ...]:
    """Return the shape of a gain: (3,) where what a light meets may be glass."""
    return (3,) if (caster.for_lamps if isinstance(light, Lamp) else caster).tinted else ()


def _affordable(hierarchy: Hierarchy, elements: Array, wanted: Array, weight: Array, most: int) -> Array:
    """Return which of the elements `wanted` may be split with no more than `most` in all: the weightiest."""
    new = np.flatnonzero(wanted & (hierarchy.first_child[elements] == LEAF))
    room = max((most - hierarchy.n_elements) // 4, 0)
    if len(new) <= room:
        return wanted
    kept = wanted.copy()
    kept[new[np.argsort(-weight[new], kind="stable")[room:]]] = False
    return kept


def too_near(light: Light, hierarchy: Hierarchy, elements: Array) -> Array:
    """Return (n,) whether a lamp's pool of light may fall between the samples on elements."""
    if isinstance(light, LampGroup):
        return _near_any(light, hierarchy, elements)
    position = getattr(light, "position", None)
    if position is None:
        return np.zeros(len(elements), dtype=bool)
    corners = hierarchy.corners[elements]
    center = corners.mean(axis=1)
    radius = np.linalg.norm(corners - center[:, None], axis=2).max(axis=1)
    along = center - np.asarray(position)
    distance = np.linalg.norm(along, axis=1)
    before = np.einsum("nk,nk->n", along, hierarchy.faces.normal[hierarchy.face[elements]]) < 0
    near = radius > NEAR_ANGLE * distance
    if isinstance(light, SpotLight):
        # The element's bounding sphere, as the lamp sees it, touches the cone and is not small compared with
        # it.
        seen = np.arcsin(np.clip(radius / np.maximum(distance, 1e-300), 0.0, 1.0))
        axis = np.asarray(light.direction)
        off = np.arccos(np.clip(along @ axis / np.maximum(distance, 1e-300), -1.0, 1.0))
        narrow, wide = light.half_angles
        near |= (off - seen < wide) & (seen > NEAR_ANGLE * narrow)
    return np.asarray(before & near)


def _near_any(group: LampGroup, hierarchy: Hierarchy, elements: Array) -> Array:
    """Return (n,) whether elements are too near any of many lamps."""
    near = np.zeros(len(elements), dtype=bool)
    corners = hierarchy.corners[elements]
    center = corners.mean(axis=1)
    radius = np.linalg.norm(corners - center[:, None], axis=2).max(axis=1)
    for lamp in group.members:
        place = getattr(lamp, "position", None)
        angle = NEAR_ANGLE
        if isinstance(lamp, SpotLight):
            angle = min(angle, float(np.sin(NEAR_ANGLE * lamp.half_angles[0])))
        if place is None:
            continue
        along = center - np.asarray(place)
        maybe = np.flatnonzero(~near & (np.einsum("nk,nk->n", along, along) < (radius / angle) ** 2))
        near[maybe] = too_near(lamp, hierarchy, elements[maybe])
    return near


def measure_light(
    hierarchy: Hierarchy,
    light: Lamp | EnvironmentLight,
    caster: RayCaster,
    elements: Array,
    seed: int,
    threads: int = 0,
    progress: Progress = SILENT,
) -> tuple[Array, Array]:
    """Measure one light's irradiance on the quarters of elements, per unit of strength, and its error.

    Returns gain (n, 4) or (n, 4, 3): On each quarter.
    Returns error (n,).
    """
    gain, error = np.empty((len(elements), 4, *_channels(light, caster))), np.empty(len(elements))
    area = hierarchy.area[elements]
    share = area / float(hierarchy.faces.area.sum())
    tiny, small = share < TINY, share < SMALL
    for chosen, pieces, divisor in (
        (~small, 4, 1),
        (small & ~tiny, 4, SMALL_DIVISOR),
        (tiny, 1, SMALL_DIVISOR),
    ):
        rows = np.flatnonzero(chosen)
        measure = partial(_measure, hierarchy, light, caster, elements[rows], pieces, divisor, seed)
        part = progress.part(0.0, 0.0)
        fill_chunks(measure, (gain, error), len(rows), CHUNK, threads, part, at=rows)
    return gain, error


def _measure(
    hierarchy: Hierarchy,
    light: Lamp | EnvironmentLight,
    caster: RayCaster,
    elements: Array,
    pieces: int,
    divisor: int,
    seed: int,
    rows: slice,
) -> tuple[Array, Array]:
    """Measure one light on elements, whole or in four pieces (see `measure_light`)."""
    parts = _pieces(hierarchy, elements[rows], pieces)
    if isinstance(light, EnvironmentLight):
        return _measure_sky(parts, light, caster, seed, divisor)
    return _measure_lamp(parts, light, caster, seed, divisor)


@dataclass(frozen=True)
class _Pieces:
    """Quarters of n elements, or the elements whole: their keys, corners and normals."""

    count: int
    keys: Array
    corners: Array
    normals: Array


def _pieces(hierarchy: Hierarchy, elements: Array, count: int) -> _Pieces:
    keys = (4 * elements[:, None] + np.arange(count)).ravel()
    corners = hierarchy.corners[elements]
    if count == 4:
        corners = split_in_four(corners).reshape(-1, 3, 3)
    normals = hierarchy.faces.normal[hierarchy.face[elements]]
    return _Pieces(count, keys, corners, np.repeat(normals, count, axis=0))


def _measure_sky(
    asked: _Pieces, light: EnvironmentLight, caster: RayCaster, seed: int, divisor: int
) -> tuple[Array, Array]:
    """Measure the sky on pieces of elements (see `measure_light`); whole ones have a column only."""
    rays = SKY_RAYS // divisor
    unit = stratified_square(asked.keys, rays, seed + Stream.LIGHT_POINTS)
    points = points_on_triangles(asked.corners, unit)
    share, error = sky_share(light, points, asked.normals, rays, caster, asked.keys, seed)
    values = irradiance_under_sky(share.reshape(-1, asked.count, *share.shape[1:]))
    # Expected noise of a quarter's mean is not a difference between quarters.
    noise = irradiance_under_sky(error.reshape(-1, asked.count).mean(axis=1))
    return values, np.maximum(largest(values.std(axis=1)) - noise, 0.0)


def _measure_lamp(
    asked: _Pieces, light: Lamp, caster: RayCaster, seed: int, divisor: int
) -> tuple[Array, Array]:
    """Measure a lamp on pieces of elements (see `measure_light`); whole ones have a column only."""
    many = isinstance(light, LampGroup)
    samples = (GROUP_SAMPLES if many else LAMP_SAMPLES) // divisor
    unit = stratified_square(asked.keys, samples, seed + Stream.LIGHT_POINTS)
    points = points_on_triangles(asked.corners, unit)
    unit = stratified_square(asked.keys, samples, seed + Stream.LIGHT_RAYS)
    open_gain, share = lamp_light(light, points, asked.normals, unit, caster)
    mean = open_gain.mean(axis=1)
    values = (mean * share if share.ndim == 1 else mean[:, None] * share).reshape(
        -1, asked.count, *share.shape[1:]
    )
    missed = open_gain.reshape(len(values), -1).mean(axis=1) / (asked.count * samples + 2.0)
    differ = largest(values.std(axis=1))
    if many:
        # Each ray sees another lamp: expected noise of a quarter's mean is not a difference between quarters.
        seen = share if share.ndim == 1 else share.mean(axis=1)
        noise = mean * np.sqrt(seen * (1.0 - seen) / samples)
        differ = np.maximum(differ - noise.reshape(-1, asked.count).mean(axis=1), 0.0)
    return values, np.hypot(differ, missed)
