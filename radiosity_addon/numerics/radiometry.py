"""The quantities of light and their conversions (handout §1 and §2.1.2).

| quantity | symbol | unit | is |
|---|---|---|---|
| flux, power | Φ | W | light per time |
| radiant intensity | I = dΦ/dω (1.7) | W/sr | what a point lamp sends into a direction |
| irradiance | H = ∫ L cosθ dω (1.5) | W/m² | what arrives on a surface |
| radiosity, exitance | B = ∫ L cosθ dω (1.6) | W/m² | what leaves it; E is the part it emits itself |
| radiance | L = d²Φ / (cosθ dω dA) (1.1) | W/m²/sr | what a ray carries, the same all along it (1.4) |

Everything that turns Blender's lamps, shaders and worlds into what the solver needs, and the
solver's light into texels, goes through here, so each factor of π has a name. Values are
numbers or arrays, one for a channel or row; no function looks at shapes.
"""

from __future__ import annotations

import math
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Value = TypeVar("Value", float, npt.NDArray[Any])

SPHERE = 4.0 * math.pi
"""Solid angle of all directions [sr]."""

HEMISPHERE = math.pi
"""∫ cosθ dω over a hemisphere: its projected solid angle [sr]."""


def radiosity_of_radiance(radiance: Value) -> Value:
    """Return B = πL [W/m²] of a surface that sends L [W/m²/sr] in every direction (handout (2.11))."""
    return HEMISPHERE * radiance


def radiance_of_radiosity(radiosity: Value) -> Value:
    """Return L = B/π [W/m²/sr] of a matte surface that sends out B [W/m²] (handout (2.11))."""
    return radiosity / HEMISPHERE


def irradiance_under_sky(radiance: Value) -> Value:
    """Return H = πL [W/m²] under an open sky of radiance L [W/m²/sr] (handout (1.5))."""
    return HEMISPHERE * radiance


def intensity_of_flux(flux: Value) -> Value:
    """Return I = Φ/4π [W/sr] of a uniform point lamp (handout (1.9))."""
    return flux / SPHERE


def flux_of_intensity(intensity: Value) -> Value:
    """Return Φ = 4πI [W] of a uniform point lamp (handout (1.8))."""
    return SPHERE * intensity


def irradiance_from_point(intensity: Value | float, cosine: Value, distance: Value) -> Value:
    """Return H = I cosθ/r² [W/m²] at distance r [m] from a point lamp (handout (1.10)).

    θ lies between the surface's normal and the lamp. Nothing else is looked at: no shadow, no
    second bounce. That is local illumination; a matte surface then shows f H (2.14 – 2.17).
    """
    return intensity * cosine / (distance * distance)


def radiance_of_disc(intensity: Value, radius: float) -> Value:
    """Return L = I/(πr²) [W/m²/sr] of a disc seen face on, or a sphere, of intensity I [W/sr]."""
    return intensity / (math.pi * radius * radius)


def radiance_of_flux(flux: Value, area: float) -> Value:
    """Return L = Φ/(πA) [W/m²/sr] of a surface of A [m²] whose one side sends out Φ [W]."""
    return radiance_of_radiosity(flux / area)


def flux_of_radiance(radiance: Value, area: float) -> Value:
    """Return Φ = πAL [W] that leaves one side of a surface of A [m²] and radiance L [W/m²/sr]."""
    return radiosity_of_radiance(radiance) * area


def sphere_area(radius: float) -> float:
    """Return 4πr² [m²]."""
    return SPHERE * radius * radius


def cone_solid_angle(one_minus_cosine: Value) -> Value:
    """Return 2π (1 − cosα) [sr] of a cone of half angle α; given so it is exact for narrow ones too."""
    return 0.5 * SPHERE * one_minus_cosine


def cone_projected_solid_angle(half_angle: float) -> float:
    """Return ∫ cosθ dω = π sin²α [sr] of a cone about the normal, at most a hemisphere's.

    A sun of radiance L that spans the cone gives L times this to a surface that faces it.
    """
    return HEMISPHERE * math.sin(min(half_angle, 0.5 * math.pi)) ** 2


def brdf_of_reflectance(reflectance: Value) -> Value:
    """Return f = ρ/π [1/sr] of a matte surface (handout (2.12)).

    The same for all directions, so swapping the two changes nothing (2.3).
    """
    return reflectance / HEMISPHERE


def reflected_radiance(brdf: Value | float, irradiance: Value) -> Value:
    """Return L_r = f H [W/m²/sr] that a matte surface reflects (handout (2.10))."""
    return brdf * irradiance


LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Luminance weights of the channels of linear Rec. 709 (ITU-R BT.709)."""


def luminous(radiant: npt.NDArray[Any], efficacy: float) -> npt.NDArray[Any]:
    """Return K (0.2126 R + 0.7152 G + 0.0722 B): lux of irradiance (…, 3) [W/m²], lumens of watts.

    K is the lumens that a watt of white makes: 683 (`settings.EFFICACY`), as for glTF's lamps, or what the
    lamps have (a filament some 15, LEDs some 100, daylight some 110) where powers are those of all light.
    """
    return efficacy * (radiant @ LUMINANCE)


MAX_REFLECTANCE = 0.99
"""Reflectances are clamped here: at 1 a closed room has no solution."""


def most_reflectance(opacity: npt.NDArray[Any], passes: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return (…, 3) the largest reflectance of surfaces where they are there, by channel.

    A surface of opacity α reflects α ρ of what arrives on all of it; with what passes that must stay below 1.

    opacity (…,): 1 − the mean of `passes`.
    passes (…, 3): The share of each channel that goes straight through.
    """
    there = np.where(opacity > 0, opacity, 1.0)[..., None]
    return np.asarray(np.minimum(MAX_REFLECTANCE * (1.0 - passes) / there, MAX_REFLECTANCE))
