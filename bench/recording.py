"""What is recorded of a bake: its time, its leaf elements, what the solver reports."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class Stopwatch:
    """Wall-clock and processor time of one block."""

    def __init__(self) -> None:
        self.figures: dict[str, float] = {}

    @contextmanager
    def running(self) -> Iterator[None]:
        wall, processor = time.perf_counter(), time.process_time()
        yield
        self.figures = {
            "seconds": time.perf_counter() - wall,
            "cpu_seconds": time.process_time() - processor,
        }


def watched_bake(bake_scene: Any, settings: Any) -> tuple[Any, int]:
    """Bake; return the result and the number of leaf elements the last picture of them shows."""
    from radiosity_addon.bake.pipeline import bake
    from radiosity_addon.bake.result.pictures import Picture
    from radiosity_addon.base.progress import Progress

    leaves = [0]

    def listen(status: Any) -> None:
        if isinstance(status.picture, Picture):
            leaves.append(len(status.picture))

    return bake(bake_scene, settings, Progress(listen)), leaves[-1]


def solver_figures(report: dict[str, Any], leaves: int) -> dict[str, Any]:
    """Return what the results keep of a solver's report."""
    names = ("elements", "links", "rays", "iterations", "residual", "closure_area_mean", "power_W",
             "estimated_error", "over_budget")  # fmt: skip
    kept = {name: report[name] for name in names if name in report}
    leaves = leaves or report.get("leaves", 0)
    closure = report.get("hierarchical", {}).get("closure")
    if closure:
        kept["closure"] = closure
    return {**kept, "leaves": leaves, "links_per_leaf": report["links"] / max(leaves, 1)}
