"""How long each stage of a bake took, and how well it used the processor."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..rays import embree_work

TRACING = ("solve", "light")
"""The stages whose time is divided among rays."""


class StageTimes(dict[str, float]):
    """Wall-clock seconds of each stage; `processor` has those of all cores together."""

    def __init__(self) -> None:
        super().__init__()
        self.processor: dict[str, float] = {}
        self._before = embree_work()

    def performance(self, texels: int) -> dict[str, Any]:
        """Return what a report says of the processor's work.

        Processor seconds of each stage and in Embree; how many cores were busy on average; rays, how many
        there are for each texel, and the processor time of each.
        """
        (seconds, rays), (seconds_before, rays_before) = embree_work(), self._before
        rays -= rays_before
        tracing = sum(self.processor.get(stage, 0.0) for stage in TRACING)
        return {
            "processor_seconds": {stage: round(taken, 4) for stage, taken in self.processor.items()},
            "embree_seconds": round(seconds - seconds_before, 4),
            "cores_busy": round(sum(self.processor.values()) / max(sum(self.values()), 1e-9), 3),
            "rays": rays,
            "rays_per_texel": round(rays / max(texels, 1), 2),
            "microseconds_per_ray": round(1e6 * tracing / max(rays, 1), 4),
        }


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add the time that the block takes to a stage's."""
    started, busy = time.perf_counter(), time.process_time()
    try:
        yield
    finally:
        seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - started
        if isinstance(seconds, StageTimes):
            taken = time.process_time() - busy
            seconds.processor[stage] = seconds.processor.get(stage, 0.0) + taken
