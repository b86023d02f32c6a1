"""Lamps and the sky: the irradiance each causes at a point, and rays that sample it.

Cycles' lamps are the model.
"""

from __future__ import annotations

from .area import AreaLight
from .environment import (
    WHOLE_SPHERE,
    Bounds,
    EnvironmentImage,
    SkyPatch,
    SkyTable,
    bright_patches,
    even_part,
    pixel_bounds,
    solid_angles,
)
from .lamp_group import LampGroup, each_lamp, grouped
from .lamp_table import LampTable
from .light import Emitter, Lamp, Light, Rays
from .point import PointLight, SpotLight
from .sun_and_sky import EnvironmentLight, SunLight, light_strengths

__all__ = [
    "WHOLE_SPHERE",
    "AreaLight",
    "Bounds",
    "Emitter",
    "EnvironmentImage",
    "EnvironmentLight",
    "Lamp",
    "LampGroup",
    "LampTable",
    "Light",
    "PointLight",
    "Rays",
    "SkyPatch",
    "SkyTable",
    "SpotLight",
    "SunLight",
    "bright_patches",
    "each_lamp",
    "even_part",
    "grouped",
    "light_strengths",
    "pixel_bounds",
    "solid_angles",
]
