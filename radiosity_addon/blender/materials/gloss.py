"""How much of what gloss reflects Cycles sends on once light has been scattered, by the scene's settings.

Bounces are what arrives after a diffuse surface. There Cycles' *Filter Glossy* makes gloss rougher, against
noise, and rough microfacets lose light; without *Reflective* caustics, gloss is left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy

MIN_PDF = 0.16
"""Of the directions that a path took from matte surfaces, cos / π, the least: its mean over two or three."""


@dataclass(frozen=True)
class Gloss:
    """What Cycles makes of gloss after a diffuse bounce.

    reflective: Whether there are reflective caustics.
    filtered: *Filter Glossy*; 0 leaves roughness as it is.
    """

    reflective: bool = True
    filtered: float = 0.0

    @staticmethod
    def of(scene: bpy.types.Scene) -> Gloss:
        """Return the settings of a scene."""
        return Gloss(bool(scene.cycles.caustics_reflective), float(scene.cycles.blur_glossy))

    @property
    def least_roughness(self) -> float:
        """The least roughness of gloss: its square, what microfacets have, is at most a half."""
        if self.filtered <= 0.0:
            return 0.0
        return math.sqrt(0.5 * math.sqrt(max(1.0 - MIN_PDF / self.filtered, 0.0)))


ALL = Gloss()
"""All that gloss reflects."""
