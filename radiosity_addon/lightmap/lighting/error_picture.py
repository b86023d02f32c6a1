"""The residual of the elements' solution at every texel: an error picture.

Other bakes do not show the elements' radiosity but light that is gathered again at each texel. Here
the elements are judged: their radiosity B̂ at the texel, less what it would be by the light that B̂
itself sends there (handout (3.5)). So hits are looked up in the elements, and no sweep corrects them.
"""

from __future__ import annotations

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, stratified_square
from ...solver.gather import Residual
from ...solver.solution import Solution
from ..texels import TexelGeometry, find_crossings
from ..transport import GatherSettings, gather_texels
from .reconstruction import CROSSED, DIRECT, footprints

TRACED_FRACTION = 0.8
"""How much is done when rays have been traced; rough."""

SAMPLES = 4
"""Points of a texel at which the elements are looked up: an edge between two may cross it."""


def texel_residual(
    solution: Solution, geometry: TexelGeometry, settings: GatherSettings, progress: Progress = SILENT
) -> Array:
    """Return r of all texels, each a mean over its footprint.

    Returns
    -------
    residual : (n, 3) float64 [W/m²]
        Positive where the elements are brighter than the light they send there makes the surface.
    """
    local, residual = solution.local_pass, solution.element_residual
    direct = local.direct.at(footprints(geometry, local), progress=progress.part(0.0, DIRECT))
    part = progress.part(DIRECT, CROSSED)
    crossings = find_crossings(geometry, local.caster, local.threads, progress=part)
    part = progress.part(CROSSED, TRACED_FRACTION)
    links, _ = gather_texels(local, crossings, settings, local.elements.leaves_of, progress=part)
    part = progress.part(TRACED_FRACTION, 1.0)
    direct += links.irradiance(residual.gathered(local), local.threads, progress=part)
    return _residual_at(residual, geometry, direct)


def residual_summary(residual: Array) -> dict[str, list[float]]:
    """Sum up (n, 3) residuals, all texels alike: for the report, a number for each channel [W/m²]."""
    size = np.abs(residual)
    return {
        "mean": residual.mean(axis=0).tolist(),
        "mean_absolute": size.mean(axis=0).tolist(),
        "percentile_99_absolute": np.percentile(size, 99, axis=0).tolist(),
        "largest_absolute": size.max(axis=0).tolist(),
    }


def _residual_at(residual: Residual, geometry: TexelGeometry, irradiance: Array) -> Array:
    """Return (n, 3) the mean of r over every texel, for (n, 3) what arrives there."""
    face = residual.front_of(geometry.triangle)
    rows = np.arange(len(geometry))
    weights = geometry.sample_weights(rows, stratified_square(rows, SAMPLES, 0))
    values = (residual.given(face, weights[:, sample, 1:], irradiance) for sample in range(SAMPLES))
    return np.asarray(sum(values) / SAMPLES)
