"""What a bake can be asked to do: one table of options, from which all front doors are made.

Needs nothing but Python, so that panels and the command line can show it at once.
"""

from __future__ import annotations

from .bake_settings import OPTIONS, BakeSettings, GroupSetting, options_of_method
from .command_options import BAKE_COMMAND, EVERY_COMMAND
from .constants import EFFICACY, MAX_GROUPS, MAX_RESOLUTION, OTHERS
from .methods import METHODS, SYMMETRIC_ONLY
from .option import UNBOUNDED, Option, plain
from .permissions import Permissions
from .sections import ADVANCED, GROUPS, MAIN, SECTIONS, SOLVER, sections_of
from .solver_settings import SolverSettings

__all__ = [
    "ADVANCED",
    "BAKE_COMMAND",
    "EFFICACY",
    "EVERY_COMMAND",
    "GROUPS",
    "MAIN",
    "MAX_GROUPS",
    "MAX_RESOLUTION",
    "METHODS",
    "OPTIONS",
    "OTHERS",
    "SECTIONS",
    "SOLVER",
    "SYMMETRIC_ONLY",
    "UNBOUNDED",
    "BakeSettings",
    "GroupSetting",
    "Option",
    "Permissions",
    "SolverSettings",
    "options_of_method",
    "plain",
    "sections_of",
]
