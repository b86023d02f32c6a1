"""What was given away in a bake, and what came back."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any


@dataclass
class CallRecord:
    """One call of a kernel.

    started, ended: Of `time.monotonic` [s].
    input_bytes: Written to the spool for it: objects and arrays that were not there yet.
    earlier: Tasks whose results were there: of a bake that was interrupted.
    seconds: Processor seconds of each other task, wherever it was done.
    by_workers: How many of these others have done.
    result_bytes: Sizes of all results.
    """

    kernel: str
    started: float = field(default_factory=time.monotonic)
    ended: float = 0.0
    input_bytes: int = 0
    earlier: int = 0
    by_workers: int = 0
    seconds: list[float] = field(default_factory=list)
    result_bytes: list[int] = field(default_factory=list)


class ShareRecord:
    """All calls of a bake that were given away, in order.

    problems: What went wrong with its helpers, a line each.
    """

    def __init__(self) -> None:
        self.calls: list[CallRecord] = []
        self.problems: list[str] = []

    def by_kernel(self) -> list[dict[str, Any]]:
        """Return for each kernel what the report says of it, in the order of their first calls."""
        found: dict[str, dict[str, Any]] = {}
        for call in self.calls:
            entry = found.setdefault(call.kernel, {"kernel": call.kernel, **dict.fromkeys(COUNTS, 0)})
            values = (
                1,
                len(call.seconds) + call.earlier,
                call.by_workers,
                call.earlier,
                call.input_bytes,
                sum(call.result_bytes),
                sum(call.seconds),
            )
            for name, value in zip(COUNTS, values, strict=True):
                entry[name] += value
        for entry in found.values():
            entry["processor_seconds"] = round(entry["processor_seconds"], 4)
        return list(found.values())


COUNTS = (
    "calls",
    "tasks",
    "tasks_by_workers",
    "tasks_done_earlier",
    "input_bytes",
    "result_bytes",
    "processor_seconds",
)
"""What the report says of a kernel."""
