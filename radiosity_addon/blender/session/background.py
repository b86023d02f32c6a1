"""Steps that may be long, taken in a thread so that a window stays alive meanwhile."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from queue import Empty, SimpleQueue
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

PATIENCE = 0.005
"""Seconds that one `next` waits for a step to end."""

TURN = 0.001
"""Seconds after which a thread that runs Python hands over to one that waits, instead of Python's 5 ms: to
draw a window once takes dozens of turns."""


def in_thread(steps: Generator[T, None, R]) -> Generator[T | None, None, R]:
    """Advance a generator in a thread of its own, one step after the other.

    Only for generators of plain arrays: Blender's data must not be touched from a thread.
    The thread does not wait for the caller, who may be drawing a window: what it yields must
    not change afterwards.

    Parameters
    ----------
    steps : generator
        What it yields, returns or raises comes through as it is, in order.

    Yields
    ------
    what the generator yields; None while there is nothing new

    Notes
    -----
    Closed in the middle of a step, this returns at once; the step ends by itself and the
    generator is closed after it, in the thread.
    """
    yielded: SimpleQueue[T] = SimpleQueue()
    closed = threading.Event()
    turn = sys.getswitchinterval()
    sys.setswitchinterval(min(turn, TURN))
    thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="radiosity")
    running = thread.submit(_run, steps, yielded, closed)
    try:
        while True:
            over = running.done()
            try:
                value = yielded.get(timeout=0.0 if over else PATIENCE)
            except Empty:
                if over:
                    return running.result()
                yield None
            else:
                yield value
    finally:
        sys.setswitchinterval(turn)
        closed.set()
        thread.shutdown(wait=False)


def elsewhere(work: Callable[[], R], in_background: bool) -> Generator[float, None, R]:
    """Do work on plain arrays: in a thread, with a step now and then, if somebody waits, else at once."""
    if not in_background:
        return work()
    steps = in_thread(_once(work))
    try:
        while True:
            try:
                next(steps)
            except StopIteration as done:
                result: R = done.value
                return result
            yield 0.0
    finally:
        steps.close()


def _once(work: Callable[[], R]) -> Generator[None, None, R]:
    yield from ()
    return work()


def _run(steps: Generator[T, None, R], yielded: SimpleQueue[T], closed: threading.Event) -> R:
    """Take all steps and return what the generator returns; stop after the one in which it is closed."""
    try:
        while not closed.is_set():
            try:
                yielded.put(next(steps))
            except StopIteration as end:
                result: R = end.value
                return result
    finally:
        steps.close()
    raise GeneratorExit
