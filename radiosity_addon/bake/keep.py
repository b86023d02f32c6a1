"""Bakes that are kept for relighting, if requested: in memory, or in a sidecar."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from ..base import SILENT, Progress
from ..options import BakeSettings
from .pipeline import bake, bake_and_keep
from .plan import BakePlan
from .rebaking import bake_moved
from .relight import KeptBake
from .result import BakeResult
from .sidecar import write_sidecar


@dataclass(frozen=True)
class KeepOptions:
    """How a bake is kept.

    sidecar: Whether it is written to a file next to its lightmaps.
    mark: The bake's own name, by which its images and its sidecar are known to belong together.
    earlier: A kept bake of the same scene, to be updated if only places of objects have changed since.
    """

    sidecar: bool = False
    mark: str = field(default_factory=lambda: uuid.uuid4().hex)
    earlier: KeptBake | None = field(default=None, repr=False, compare=False)


Baking: TypeAlias = Callable[
    [BakePlan, KeepOptions | None, Path | None, Progress], tuple[BakeResult, KeptBake | None]
]
"""`run_pipeline`, or what takes its place: the same shared with workers, or a result that is known."""


def can_keep(settings: BakeSettings) -> bool:
    """Return whether bakes of these settings can be relit."""
    return settings.method == "hierarchical" and settings.quantity != "residual"


def run_pipeline(
    plan: BakePlan, keeping: KeepOptions | None, sidecar: Path | None, progress: Progress = SILENT
) -> tuple[BakeResult, KeptBake | None]:
    """Bake as planned, and keep the bake if requested.

    plan: One that moves objects in a kept bake is for a bake that is kept again.
    sidecar: Where its file goes, to be published with the bake; None writes none.
    Raises RadiosityError: Those of `bake_and_keep` and `write_sidecar`.
    """
    if keeping is None:
        return bake(plan.bake_scene, plan.settings, progress), None
    if plan.kept is not None:
        result, kept = bake_moved(plan.kept, plan.bake_scene, progress)
    else:
        result, kept = bake_and_keep(plan.bake_scene, plan.settings, progress)
    if sidecar is not None:
        progress.stage("sidecar", 1.0, 1.0).at(1.0)
        write_sidecar(sidecar, kept, result, keeping.mark)
    return result, kept
