"""The pipeline with the help of workers."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

from ..bake import BakePlan, Baking, KeepOptions, run_pipeline
from ..bake.relight import KeptBake
from ..bake.result import BakeResult
from ..base import SILENT, BakeWarning, Progress
from .records import ShareRecord

Sharing: TypeAlias = Callable[[], AbstractContextManager[ShareRecord]]


def shared_pipeline(sharing: Sharing) -> Baking:
    """Return the pipeline shared with workers.

    sharing: Called when the pipeline begins, in its thread: shares with workers what is baked within.
    """

    def baking(
        plan: BakePlan, keeping: KeepOptions | None, sidecar: Path | None, progress: Progress = SILENT
    ) -> tuple[BakeResult, KeptBake | None]:
        with sharing() as record:
            result, kept = run_pipeline(plan, keeping, sidecar, progress)
        lines = tuple(BakeWarning("workers", line) for line in record.problems)
        performance = {**result.performance, "shared": record.by_kernel()}
        return replace(result, warnings=(*lines, *result.warnings), performance=performance), kept

    return baking
