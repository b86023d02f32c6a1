"""What a bake can be asked to do: the methods and their settings, and the settings of a bake.

Needs nothing but Python, so that panels and the command line can show it at once.
"""

from __future__ import annotations

from .bake_settings import (
    ATLASES,
    EFFICACY,
    FORMATS,
    LIGHTS,
    MAX_ERROR,
    MAX_GROUPS,
    MAX_MIP_LEVELS,
    MAX_PAGES,
    MAX_RESOLUTION,
    MAX_SEED,
    MAX_THREADS,
    MIN_ERROR,
    OTHERS,
    QUALITIES,
    QUANTITIES,
    BakeSettings,
    GroupSetting,
)
from .methods import METHODS, SETTINGS, SYMMETRIC_ONLY, MethodSetting
from .permissions import Permissions
from .solver_settings import SolverSettings

__all__ = [
    "ATLASES",
    "EFFICACY",
    "FORMATS",
    "LIGHTS",
    "MAX_ERROR",
    "MAX_GROUPS",
    "MAX_MIP_LEVELS",
    "MAX_PAGES",
    "MAX_RESOLUTION",
    "MAX_SEED",
    "MAX_THREADS",
    "METHODS",
    "MIN_ERROR",
    "OTHERS",
    "QUALITIES",
    "QUANTITIES",
    "SETTINGS",
    "SYMMETRIC_ONLY",
    "BakeSettings",
    "GroupSetting",
    "MethodSetting",
    "Permissions",
    "SolverSettings",
]
