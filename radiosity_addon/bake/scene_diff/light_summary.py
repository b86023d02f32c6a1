"""A few numbers for all that emits light under one name, which a .blend keeps to say later what has changed.

Numbers, not digests: skies, whose pictures are rendered for every export, differ a little each time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from ...scene import BakeScene
from .lights import STRENGTHS

SAME = 1e-4
"""Sums that differ by no more than this part are the same."""


class LightSummary(NamedTuple):
    """Sums over what emits light under one name.

    kind: Its type, and sums over its place, shape and pattern.
    strength: Sums over its strength.
    """

    kind: tuple[str, tuple[float, ...]]
    strength: tuple[float, ...]


def light_summaries(bake_scene: BakeScene) -> dict[str, LightSummary]:
    """Return sums over lamps, world and emissive objects of a scene, by name.

    Where emissive objects are, and their shape, is no part of it.
    """
    scene = bake_scene.scene
    kinds: dict[str, str] = {}
    found: dict[str, tuple[list[Any], list[Any]]] = {}
    for light in scene.lights:
        if not light.name or not light.strength.any():
            continue  # a sky that was added belongs to nobody; a kept bake knows dark lamps too
        kinds[light.name] = type(light).__name__
        shape, strength = found.setdefault(light.name, ([], []))
        for entry in fields(light):
            value = getattr(light, entry.name)
            if isinstance(value, str):
                kinds[light.name] += f" {value}" if entry.name != "name" else ""
            else:
                (strength if entry.name in STRENGTHS else shape).append(value)
    for item in bake_scene.objects:
        emission = scene.emission[item.rows]
        if emission.any():
            found.setdefault(item.name, ([], []))[1].append(emission)
    return {
        name: LightSummary((kinds.get(name, "emission"), _sums(shape)), _sums(strength))
        for name, (shape, strength) in found.items()
    }


def changed_lights(
    before: Mapping[str, LightSummary], now: Mapping[str, LightSummary], *, strengths: bool
) -> list[str]:
    """Return the names under which both scenes have light, but not the same.

    strengths: Whether color and strength count.
    """
    both = [name for name in now if name in before]
    return [name for name in both if _differ(before[name], now[name], strengths=strengths)]


def as_light_summaries(stored: Any) -> dict[str, LightSummary]:
    """Return summaries that were stored as JSON."""
    return {
        name: LightSummary((kind, tuple(shape)), tuple(strength))
        for name, ((kind, shape), strength) in stored.items()
    }


def _differ(one: LightSummary, other: LightSummary, *, strengths: bool) -> bool:
    kinds = one.kind[0] == other.kind[0] and _same(one.kind[1], other.kind[1])
    return not kinds or (strengths and not _same(one.strength, other.strength))


def _same(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return len(one) == len(other) and bool(
        np.abs(np.subtract(one, other)).max(initial=0.0) <= SAME * np.abs(one).max(initial=0.0)
    )


def _sums(values: list[Any]) -> tuple[float, ...]:
    """Return the norm of all numbers, and two weighed sums, in which each of them counts."""
    if not values:
        return ()
    numbers = np.concatenate([np.asarray(value, dtype=np.float64).ravel() for value in values])
    row = np.arange(len(numbers))
    sums = [np.linalg.norm(numbers), np.cos(row) @ numbers, np.sin(1.0 + row) @ numbers]
    return tuple(float(f"{value:.9g}") for value in sums)
