"""Light texels to a target error: with more and more rays, until the estimated error is below it."""

from __future__ import annotations

from collections.abc import Callable

from ...base import SILENT, Progress
from ...scene import Scene
from ...solver.gather import LocalPass
from ..texels import TexelGeometry
from ..transport import GatherSettings, TexelLight
from .partial_light import LightSoFar
from .reconstruction import light_texels

TRIES = 4
"""Times the texels are lit at most: each time the error is known better."""

TARGET_SHARE = 0.9
"""The next try aims at this part of what would just do."""


def light_within(
    scene: Scene,
    local: LocalPass,
    geometry: TexelGeometry,
    settings_for: Callable[[float], GatherSettings],
    error: float,
    so_far: LightSoFar | None = None,
    progress: Progress = SILENT,
) -> TexelLight:
    """Light the texels so that their estimated relative RMS error is at most `error`, if that can be had.

    settings_for: How densely to gather for an error; at its limits it returns the same again.
    """
    goal = error
    # How many tries there will be is not known: each takes half of what is left.
    turns = progress.turns(0.5)
    settings = settings_for(goal)
    for tries in range(TRIES, 0, -1):
        light = light_texels(scene, local, geometry, settings, so_far=so_far, progress=next(turns))
        goal *= TARGET_SHARE * error / max(light.error, 1e-9)
        before, settings = settings, settings_for(goal)
        if light.error <= error or settings == before:
            break
        if tries > 1:
            # It takes as much memory as the next one.
            del light
    return light
