"""The options of a bake: one table, from which command line, panel, presets and docs are generated.

Needs nothing but Python, so that panels and the command line can show it at once.
"""

from __future__ import annotations

from .bake_settings import OPTIONS, BakeSettings, GroupSetting, options_of_method
from .choices import EXPORT_FORMS
from .constants import EFFICACY, MAX_GROUPS, MAX_PAGES, MAX_RESOLUTION, OTHERS, TEXEL_STEPS
from .export_forms import ENGINE_PADDING, FORM_NAMES, SUM_GROUPS, Form, forms_of
from .methods import METHODS, SYMMETRIC_ONLY
from .option_record import UNBOUNDED, Choice, Option, option, options_of, plain
from .panel_settings import PANEL_OPTIONS, RELIGHT_GROUP
from .sections import ADVANCED, EXPORT, GROUPS, LAST_BAKE, MAIN, SECTIONS, SOLVER, sections_of

__all__ = [
    "ADVANCED",
    "EFFICACY",
    "ENGINE_PADDING",
    "EXPORT",
    "EXPORT_FORMS",
    "FORM_NAMES",
    "GROUPS",
    "LAST_BAKE",
    "MAIN",
    "MAX_GROUPS",
    "MAX_PAGES",
    "MAX_RESOLUTION",
    "METHODS",
    "OPTIONS",
    "OTHERS",
    "PANEL_OPTIONS",
    "RELIGHT_GROUP",
    "SECTIONS",
    "SOLVER",
    "SUM_GROUPS",
    "SYMMETRIC_ONLY",
    "TEXEL_STEPS",
    "UNBOUNDED",
    "BakeSettings",
    "Choice",
    "Form",
    "GroupSetting",
    "Option",
    "forms_of",
    "option",
    "options_of",
    "options_of_method",
    "plain",
    "sections_of",
]
