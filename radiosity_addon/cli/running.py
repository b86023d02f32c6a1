"""A job on the command line: run to its end, its progress shown, and ended by interrupts."""

from __future__ import annotations

from collections.abc import Collection, Generator
from typing import TypeVar

from ..base import Status
from .console import Console
from .interrupts import Interrupts

T = TypeVar("T")


def run_through(
    job: Generator[Status | None, None, T],
    console: Console,
    interrupts: Interrupts,
    writing: Collection[str] = (),
) -> T:
    """Run a job to its end and return its report.

    writing: Stages in which interrupts wait.
    """
    try:
        while True:
            try:
                status = next(job)
            except StopIteration as done:
                report: T = done.value
                return report
            interrupts.check()
            if status is not None:
                interrupts.deferred = status.stage in writing
                console.progress(status.stage, status.fraction, status.expected)
    finally:
        interrupts.deferred = True
        job.close()
