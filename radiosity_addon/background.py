"""Steps that may be long, taken in a thread so that a window stays alive meanwhile."""

from __future__ import annotations

from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor, wait
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

PATIENCE = 0.01
"""Seconds that one `next` waits for a step to end."""


def in_thread(steps: Generator[T, None, R]) -> Generator[T | None, None, R]:
    """Advance a generator in a thread of its own, one step after the other.

    Only for generators of plain arrays: Blender's data must not be touched from a thread.

    Parameters
    ----------
    steps : generator
        What it yields, returns or raises comes through as it is.

    Yields
    ------
    what the generator yields; None while its step is still going on

    Notes
    -----
    Closed in the middle of a step, this returns at once; the step ends by itself and the
    generator is closed after it, in the thread.
    """
    thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="radiosity")
    try:
        while True:
            step = thread.submit(_next, steps)
            while not wait((step,), timeout=PATIENCE).done:
                yield None
            yielded, value = step.result()
            if not yielded:
                return value  # type: ignore[return-value]
            yield value  # type: ignore[misc]
    finally:
        thread.submit(steps.close)
        thread.shutdown(wait=False)


def _next(steps: Generator[T, None, R]) -> tuple[bool, T | R]:
    """Take a step: (True, what it yields) or, at the end, (False, what it returns)."""
    try:
        return True, next(steps)
    except StopIteration as end:
        # A future cannot carry a StopIteration.
        return False, end.value
