"""Which options of a bake do not go together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..base import UsageError
from .methods import SYMMETRIC_ONLY
from .option_record import Option


def check_combinations(settings: Any, options: Mapping[str, Option]) -> None:
    """Refuse settings of a bake that contradict each other.

    Parameters
    ----------
    settings : BakeSettings
        Each within its own range.
    options : mapping
        Every option by its name.

    Raises
    ------
    UsageError
    """
    if settings.pages > 1 and (settings.atlas != "shared" or settings.texel_density is not None):
        raise UsageError(
            "pages apply to a shared atlas with a resolution; otherwise their number is automatic"
        )
    for name in (*settings.light_only, *settings.ignore):
        if name in (settings.objects or ()):
            raise UsageError(f"object '{name}' cannot both get a lightmap and be light only or ignored")
    if settings.quantity == "residual":
        _check_residual(settings)
    _check_groups(settings)
    _check_method(settings, options)


def _check_residual(settings: Any) -> None:
    """Refuse what an error picture cannot be."""
    if settings.relative_error is not None:
        raise UsageError("a residual is an error picture: leave --error out, or bake another quantity")
    if settings.format != "exr":
        raise UsageError(
            f"a residual has negative values, which format {settings.format} cannot hold: use format exr"
        )
    if settings.light != "all":
        raise UsageError(
            f"a residual is of the whole solution, not of its {settings.light} light: use light all"
        )


def _check_groups(settings: Any) -> None:
    """Refuse what light groups cannot be."""
    names = [name for name, _ in settings.groups]
    if "" in names:
        raise UsageError("a light group has no name")
    inside = [member for _, group in settings.groups for member in group]
    for kind, found in (("light group", names), ("light group member", inside)):
        twice = next((name for name in found if found.count(name) > 1), None)
        if twice is not None:
            raise UsageError(f"{kind} '{twice}' is given twice")
    wanted = bool(settings.groups) or settings.light_groups
    if wanted and settings.method != "hierarchical":
        raise UsageError(f"light groups need the hierarchical method; {settings.method} keeps no links")
    if wanted and settings.quantity == "residual":
        raise UsageError("a residual is of all light together: bake another quantity for light groups")


def _check_method(settings: Any, options: Mapping[str, Option]) -> None:
    """Refuse settings that the method does not have, or not like that."""
    method, given = settings.method, settings.method_settings()
    takes = ", ".join(option.flag for option in options.values() if method in option.methods)
    for name in given:
        if method not in options[name].methods:
            raise UsageError(f"{options[name].flag} does not apply to --method {method}; it takes {takes}")
    if method in SYMMETRIC_ONLY and given.get("assembly", "galerkin") != "galerkin":
        raise UsageError(
            f"--method {method} needs the symmetric system of --assembly galerkin; "
            f"take --method gauss-seidel with --assembly {given['assembly']}"
        )
    if given.get("patches", 0) > given.get("elements", math.inf):
        raise UsageError(
            f"--patches {given['patches']} is more than --elements {given['elements']}: "
            "patches consist of elements"
        )
