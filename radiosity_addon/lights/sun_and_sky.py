"""Suns and uniform skies: irradiance in closed form, and shadow rays.

Cycles' lamps are the model. A lamp's irradiance on an unoccluded point is
`strength × unit_irradiance`; `shadow_rays` sample the same integral, so that a visibility is a
ratio of sums and has no noise where all rays agree. A lamp's shape casts no shadow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..form_factors import cap_cosine
from ..numerics import Array, to_world, uniform_cone
from .area import AREA_SHAPES, AreaLight
from .light import Float64Array, Lamp, Light, Rays, Samples, row_cosines
from .point import PointLight, SpotLight

__all__ = [
    "AREA_SHAPES",
    "AreaLight",
    "EnvironmentLight",
    "Lamp",
    "Light",
    "PointLight",
    "SpotLight",
    "SunLight",
]


@dataclass(frozen=True, eq=False)
class SunLight(Lamp):
    """Parallel light, or light from a round patch of the sky.

    direction (3,): The way the light travels.
    irradiance float or (3,) float [W/m²]: On a surface that faces it, whatever the angle.
    angle float [rad]: The full angle the sun's disk spans, 0 to π.
    Raises SceneError if a value is out of range.
    """

    direction: npt.ArrayLike
    irradiance: npt.ArrayLike
    angle: float = 0.0

    def __post_init__(self) -> None:
        self._set_vector("direction", unit=True)
        self._set_rgb("irradiance")
        self._set_number("angle", 0.0, float(np.pi) + 1e-6)

    @property
    def unit_direction(self) -> Float64Array:
        """(3,) the way the light travels, of length 1."""
        return np.asarray(self.direction)

    @property
    def strength(self) -> Float64Array:
        """(3,) RGB irradiance of what faces it [W/m²]."""
        return np.asarray(self.irradiance, dtype=np.float64)

    @property
    def is_distant(self) -> bool:
        """True: a point's normal alone decides what arrives."""
        return True

    def unit_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:  # noqa: ARG002
        """Return cosθ, reduced where the cap is cut by the horizon (see `Lamp.unit_irradiance`)."""
        return cap_cosine(-(normals @ np.asarray(self.direction)), np.sin(0.5 * self.angle))

    def shadow_rays(self, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return rays to samples of the sun's cap, uniform over it (see `Lamp.shadow_rays`)."""
        toward = np.broadcast_to(-np.asarray(self.direction), (len(points), 3))
        drop = 2.0 * np.sin(0.25 * self.angle) ** 2
        directions = to_world(uniform_cone(np.asarray(u, dtype=np.float64), drop), toward)
        # Radiance 1/(π sin²α) over the solid angle 2π (1 − cosα), shared by k rays.
        share = 2.0 / ((2.0 - drop) * directions.shape[1])
        return directions, np.full(directions.shape[:2], np.inf), share * row_cosines(directions, normals)


@dataclass(frozen=True, eq=False)
class EnvironmentLight(Light):
    """A sky of constant radiance around the scene.

    radiance float or (3,) float [W/m²/sr].
    Raises SceneError if it is negative, NaN or infinite.
    """

    radiance: npt.ArrayLike

    def __post_init__(self) -> None:
        self._set_rgb("radiance")

    @property
    def strength(self) -> Float64Array:
        """(3,) RGB radiance [W/m²/sr]."""
        return np.asarray(self.radiance, dtype=np.float64)

    def relative(self, directions: Float64Array) -> Float64Array:
        """Return (...) radiance by directions (..., 3), relative to `radiance`: 1 here."""
        return np.ones(directions.shape[:-1])


def light_strengths(lights: Sequence[Light]) -> Array:
    """Return (n_lights, 3): what each light's gain is multiplied with."""
    return np.array([light.strength for light in lights], dtype=np.float64).reshape(-1, 3)
