"""What draft, medium and high mean, part by part."""

from __future__ import annotations

from dataclasses import dataclass, replace

from .lightmap.reconstruct import GatherSettings
from .settings import BakeSettings
from .solver.settings import SolverSettings


@dataclass(frozen=True)
class Quality:
    """The accuracy of the hierarchy and of what texels gather."""

    solver: SolverSettings
    gather: GatherSettings


QUALITIES = {
    "draft": Quality(
        SolverSettings(error=1e-3, min_area=1e-4, shadow_rays=4),
        GatherSettings(strides=(8, 4, 2, 1), support=0.25, rays=128),
    ),
    "medium": Quality(
        SolverSettings(error=1e-4, min_area=2e-5, shadow_rays=8),
        GatherSettings(strides=(4, 2, 1), support=2.0, rays=256),
    ),
    "high": Quality(
        SolverSettings(error=3e-5, min_area=1e-5, shadow_rays=16),
        GatherSettings(strides=(4, 2, 1), support=6.0, rays=1024, sweeps=128),
    ),
}


def quality_of(settings: BakeSettings) -> Quality:
    """Return the presets of a bake, with its seed and threads."""
    preset = QUALITIES[settings.quality]
    return replace(preset, solver=replace(preset.solver, seed=settings.seed, threads=settings.threads))
