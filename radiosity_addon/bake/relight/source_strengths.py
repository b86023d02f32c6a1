"""The strengths that a changed scene's sources have, if it differs from a kept bake's in nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from ...base import SceneError
from ...lights import Light
from ...numerics import Array
from ...scene import BakeScene
from .kept_bake import STRENGTHS, KeptBake
from .scene_digest import check_same, scene_digests


def strengths_in(kept: KeptBake, bake_scene: BakeScene) -> Array:
    """Return (s, 3) the strengths that a kept bake's sources have in another export of its scene.

    A lamp that is not there any more, or hidden, has none; so has a world that is black.

    Raises
    ------
    SceneError
        If anything else differs; the message names it.
    """
    check_same(scene_digests(kept.bake_scene), bake_scene)
    scene = copy(bake_scene.scene)
    scene.lights = aligned(kept.bake_scene.scene.lights, scene.lights)
    return kept.strengths_of(scene)


def aligned(before: Sequence[Light], now: Sequence[Light]) -> tuple[Light, ...]:
    """Return the lights there are now in the order of those before, dark ones for those that are gone.

    Raises
    ------
    SceneError
        If there is one that was not there before.
    """
    names = {light.name for light in before}
    for light in now:
        if light.name not in names:
            raise SceneError(f"lamp or world '{light.name}' is new: bake again")
    given = {}
    for name in names:
        were = [light for light in before if light.name == name]
        found = [light for light in now if light.name == name]
        if len(found) not in (0, len(were)):
            raise SceneError(
                f"there are {len(found)} lights '{name}', and there were {len(were)} when baked: bake again"
            )
        given[name] = iter(found or [dark(light) for light in were])
    return tuple(next(given[light.name]) for light in before)


def dark(light: Light) -> Light:
    """Return the light without strength."""
    field = next(name for name in STRENGTHS if hasattr(light, name))
    nothing: dict[str, Any] = {field: np.zeros(3)}
    return replace(light, **nothing)
