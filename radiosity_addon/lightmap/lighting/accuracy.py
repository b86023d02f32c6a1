"""Light texels to a target error: with more and more rays, until the estimated error is below it."""

from __future__ import annotations

from dataclasses import replace

from ...base import SILENT, Progress
from ...scene import Scene
from ...solver.gather import LocalPass
from ..texels import TexelGeometry
from ..transport import GatherSettings, TexelLight
from .partial_light import LightSoFar
from .reconstruction import light_texels

TRIES = 5
"""Times the error is estimated at most: each time it is known better."""

FIRST_PART, FEWEST_RAYS = 2, 16
"""Of the rays that would do in a scene like those the settings were fitted to, this part comes first, or so
many: others need fewer."""

TARGET_SHARE = 0.9
"""Further rays aim at this part of what would just do."""

POWER = 1.5
"""Times as many rays lower the error by this root: stratified rays by a little more than the square root."""


def light_within(
    scene: Scene,
    local: LocalPass,
    geometry: TexelGeometry,
    settings: GatherSettings,
    error: float,
    most_rays: int,
    so_far: LightSoFar | None = None,
    progress: Progress = SILENT,
) -> TexelLight:
    """Light the texels so that their estimated relative RMS error is at most `error`, if that can be had.

    settings: How densely to gather for this error in an ordinary scene. The number of rays follows from the
        estimate, but is no more than `most_rays`.
    """
    rays, tries = float(max(settings.rays // FIRST_PART, FEWEST_RAYS)), TRIES
    first = replace(settings, rays=int(rays))

    def more_rays(reached: float) -> float:
        nonlocal rays, tries
        tries -= 1
        if reached <= error or not tries:
            return 1.0
        factor = min((reached / (TARGET_SHARE * error)) ** POWER, most_rays / rays)
        rays *= factor
        return factor

    return light_texels(scene, local, geometry, first, so_far=so_far, more_rays=more_rays, progress=progress)
