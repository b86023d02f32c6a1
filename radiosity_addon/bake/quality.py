"""What sketch, draft, medium and high mean, part by part."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from ..lightmap.transport import GatherSettings
from ..options import BakeSettings, options_of_method
from ..solver.settings import SolverSettings


@dataclass(frozen=True)
class Quality:
    """The accuracy of the hierarchy and of what texels gather."""

    solver: SolverSettings
    gather: GatherSettings


FINE_ENOUGH = 1e-3
"""BF_ε of all qualities from draft on: with smaller ones lightmaps do not change by more than their noise
(docs/decisions/0062); power is kept within 0.5 %."""

QUALITY_SETTINGS = {
    "sketch": Quality(
        SolverSettings(
            shadow_rays=2,
            error=1e-2,
            min_area=1e-3,
            form_factor_error=0.05,
            elements=250,
            patches=50,
            contrast=0.4,
        ),
        GatherSettings(strides=(4, 2, 1), support=0.1, rays=40, tolerance=3e-3, cell_rays=4),
    ),
    "draft": Quality(
        SolverSettings(
            shadow_rays=4,
            error=FINE_ENOUGH,
            min_area=1e-4,
            form_factor_error=0.02,
            elements=500,
            patches=100,
            contrast=0.2,
        ),
        GatherSettings(strides=(4, 2, 1), support=0.5, rays=80, tolerance=8e-4),
    ),
    "medium": Quality(
        SolverSettings(
            shadow_rays=8,
            error=FINE_ENOUGH,
            min_area=2e-5,
            form_factor_error=0.01,
            elements=1500,
            patches=200,
            contrast=0.1,
        ),
        GatherSettings(strides=(4, 2, 1), support=1.5, rays=160, tolerance=4e-4),
    ),
    "high": Quality(
        SolverSettings(
            shadow_rays=16,
            error=FINE_ENOUGH,
            min_area=1e-5,
            form_factor_error=0.002,
            elements=4000,
            patches=400,
            contrast=0.05,
        ),
        GatherSettings(strides=(4, 2, 1), support=6.0, rays=384, sweeps=128, tolerance=2e-4),
    ),
}


COARSEST = Quality(
    SolverSettings(shadow_rays=2, error=3e-3, min_area=3e-4),
    GatherSettings(strides=(4, 2, 1), support=0.2, rays=24, tolerance=2e-3),
)
"""The settings for the largest target errors."""

LADDER = (
    (0.029, COARSEST),
    (0.0125, QUALITY_SETTINGS["draft"]),
    (0.0077, QUALITY_SETTINGS["medium"]),
    (0.0057, QUALITY_SETTINGS["high"]),
)
"""Relative RMS errors that they stay below in the Cornell box at 256², estimated and measured against Cycles;
other scenes take more (docs/decisions/0020, 0063)."""

FEWEST_RAYS, MOST_RAYS = COARSEST.gather.rays, 2048
"""Limits of a gather point's rays, for every target error."""


def for_error(error: float) -> Quality:
    """Return what would reach a relative RMS error in the Cornell box: between the qualities, and beyond.

    Every number follows a power of the error, from one quality to the next; other scenes take
    more or less, which the estimate of the error then shows.
    """
    rung = sum(error <= step for step, _ in LADDER[1:-1])
    (low_error, low), (high_error, high) = LADDER[rung : rung + 2]
    part = math.log(error / low_error) / math.log(high_error / low_error)

    def between(one: float, other: float) -> float:
        return float(one * (other / one) ** part)

    rays = min(max(between(low.gather.rays, high.gather.rays), FEWEST_RAYS), MOST_RAYS)
    solver = replace(
        low.solver,
        error=min(between(low.solver.error, high.solver.error), COARSEST.solver.error),
        min_area=min(max(between(low.solver.min_area, high.solver.min_area), 5e-6), COARSEST.solver.min_area),
        shadow_rays=round(min(max(between(low.solver.shadow_rays, high.solver.shadow_rays), 2), 64)),
    )
    coarse = COARSEST.gather
    gather = replace(
        high.gather,
        support=min(max(between(low.gather.support, high.gather.support), coarse.support), 16.0),
        rays=8 * math.ceil(rays / 8 - 1e-6),
        tolerance=min(max(between(low.gather.tolerance, high.gather.tolerance), 1e-4), coarse.tolerance),
    )
    return Quality(solver, gather)


MULTI_LEVEL_AREA = 0.3
"""A_ε of the multi-level method in units of its F_ε. It splits receivers first: were they allowed to
get much smaller, each would take less than F_ε of what a whole face sends, and no source would ever
be split."""


SHOOTING_TOLERANCES = {"sketch": 0.05, "draft": 0.02, "medium": 0.005, "high": 0.001}
"""Residuals at which shooting stops: each further tenth takes two shots an element (Cornell box)."""


def quality_of(settings: BakeSettings) -> Quality:
    """Return the presets of a bake, with its method, its seed and threads, and what was given.

    A preset gives way to what was given: patches never outnumber elements.
    """
    preset = QUALITY_SETTINGS[settings.quality]
    if settings.relative_error is not None:
        preset = for_error(settings.relative_error)
    given = settings.method_settings()
    solver = replace(
        preset.solver, method=settings.method, seed=settings.seed, threads=settings.threads, **given
    )
    if settings.method == "shooting" and "tolerance" not in given:
        solver = replace(solver, tolerance=SHOOTING_TOLERANCES[settings.quality])
    if "elements" in given and "patches" not in given:
        solver = replace(solver, patches=min(solver.patches, solver.elements))
    if "patches" in given and "elements" not in given:
        solver = replace(solver, elements=max(solver.patches, solver.elements))
    if settings.method == "multi-level" and "min_area" not in given:
        area = max(MULTI_LEVEL_AREA * solver.form_factor_error, solver.min_area)
        solver = replace(solver, min_area=area)
    return replace(preset, solver=solver)


def used_settings(solver: SolverSettings) -> dict[str, Any]:
    """Return the settings that the method listens to, as a bake used them."""
    return {name: getattr(solver, name) for name in options_of_method(solver.method)}
