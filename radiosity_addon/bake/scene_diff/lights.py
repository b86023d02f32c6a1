"""Lights of two exports of a scene: which are the same, and which differ in strength alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ...lights import Light
from ...numerics import Array

STRENGTHS = ("power", "irradiance", "radiance")
"""The fields of lights that relighting can change."""

SAME_SKY = 1e-5
"""Skies, whose pictures are rendered again for every export, may differ by this part."""


def same_light(one: Light, other: Light) -> bool:
    """Return whether two lights are the same."""
    return _same_but_for((), one, other)


def differs_in_strength_alone(one: Light, other: Light) -> bool:
    """Return whether two lights differ at most in color and strength."""
    return _same_but_for(STRENGTHS, one, other)


def aligned(before: Sequence[Light], now: Sequence[Light]) -> tuple[Light, ...]:
    """Return the lights of now in the order of those before, dark ones for those that are gone."""
    found = {light.name: [each for each in now if each.name == light.name] for light in before}
    left = {name: iter(lights) for name, lights in found.items()}
    return tuple(next(left[light.name]) if found[light.name] else dark(light) for light in before)


def dark(light: Light) -> Light:
    """Return the light without strength."""
    field = next(name for name in STRENGTHS if hasattr(light, name))
    nothing: dict[str, Any] = {field: np.zeros(3)}
    return replace(light, **nothing)


def _same_but_for(names: Sequence[str], one: Light, other: Light) -> bool:
    return type(one) is type(other) and all(
        _equal(getattr(one, entry.name), getattr(other, entry.name))
        for entry in fields(one)
        if entry.name not in names
    )


def _equal(one: Array | str | float, other: Array | str | float) -> bool:
    if not isinstance(one, np.ndarray) or not isinstance(other, np.ndarray):
        return bool(one == other)
    if one.shape != other.shape:
        return False
    return bool(np.abs(one - other).max(initial=0.0) <= SAME_SKY * np.abs(one).max(initial=0.0))
