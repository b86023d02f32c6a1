"""What a bake warns of: objects with hardly any texels, and solutions that had to stop early."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..base import BakeWarning
from ..lightmap.texels import TexelGeometry
from ..lightmap.unwrap import greedy_object, share_of
from ..scene import BakeObject, BakeScene
from ..solver import Solution, SolverSettings
from ..solver.links import COARSEST_FAINT
from .quality import used_settings

MIN_SIDE = 8
"""Objects with fewer texels than the square of this cause a warning."""


def small_objects(
    bake_scene: BakeScene, baked: list[BakeObject], geometry: TexelGeometry
) -> Iterator[BakeWarning]:
    """Warn of objects that get hardly any texels, and of the one that takes nearly all, if there is one."""
    counts = geometry.counts
    texels = [int(counts[item.rows].sum()) for item in baked]
    greedy = greedy_object([item.name for item in baked], texels)
    advice = "raise the resolution or its texel scale"
    if greedy is not None:
        taken = share_of(max(texels), sum(texels))
        advice = f"object '{greedy}' takes {taken} of all texels; lower its texel scale"
    for item, own in zip(baked, texels, strict=True):
        surface = bake_scene.scene.areas[item.rows].sum()
        if surface > 0 and own < MIN_SIDE**2:
            yield BakeWarning(
                item.name,
                f"object '{item.name}' gets only {own} texels, fewer than {MIN_SIDE} × {MIN_SIDE}: {advice}",
            )


def of_solution(solution: Solution, settings: SolverSettings) -> tuple[BakeWarning, ...]:
    """Warn where nothing shines, or the solver had to stop early."""
    warnings = []
    if solution.report["power_W"]["emitted"] == 0:
        warnings.append(
            BakeWarning(
                "scene",
                "no lamp, emissive material or world light reaches anything: the lightmaps are black; "
                "add a lamp, or bake with a sky",
            )
        )
    if solution.over_budget > 0:
        warnings.append(
            BakeWarning(
                "scene",
                f"refinement stopped at the maximum number of links; single links may misplace up to "
                f"{solution.over_budget:.2%} of the light: bake at a lower quality, or fewer objects",
            )
        )
    if solution.first_faint > COARSEST_FAINT * settings.error:
        warnings.append(
            BakeWarning(
                "scene",
                f"so many small surfaces that links begin coarse, between parts that may exchange up to "
                f"{solution.first_faint:.2%} of all light: single small faces may be lit unevenly; "
                "raise Max Links and the memory limit, or bake fewer objects",
            )
        )
    residual, tolerance = solution.report["residual"], used_settings(settings).get("tolerance", np.inf)
    if residual > tolerance:
        warnings.append(
            BakeWarning(
                "scene",
                f"the {settings.method} method stopped after {solution.report['iterations']:,} iterations "
                f"at a residual of {residual:.1e}, above the tolerance of {tolerance:.1e}: allow more "
                "iterations, or a larger tolerance",
            )
        )
    return tuple(warnings)
