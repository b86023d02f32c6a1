"""Work on plain arrays in a thread: a window stays alive meanwhile, and Ctrl-C stops it."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Generator
from queue import Empty, SimpleQueue
from typing import TypeVar

from .progress import Cancelled, Progress, Status

R = TypeVar("R")

POLL_SECONDS = 0.005
"""Seconds that one `next` waits for news."""

SWITCH_INTERVAL = 0.001
"""Seconds after which a thread that runs Python hands over to one that waits, instead of Python's 5 ms: to
draw a window once takes dozens of turns."""


def in_thread(work: Callable[[Progress], R], in_window: bool = True) -> Generator[Status | None, None, R]:
    """Do work in a thread of its own.

    Only for work on plain arrays: Blender's data must not be touched from a thread.
    The thread does not wait for the caller, which may be drawing a window: pictures that it
    reports must not change afterward.

    Parameters
    ----------
    work : callable
        Takes the progress to report. Its result or exception is passed on.
    in_window : bool
        Return from every `next` within a moment. Else only with news.

    Yields
    ------
    status : Status or None
        In order; None while there is nothing new.

    Notes
    -----
    Closing the generator cancels the work, which ends when it next reports its progress. In a window this
    returns at once; otherwise it waits for the end of the work.
    """
    from concurrent.futures import ThreadPoolExecutor  # not while the add-on is enabled

    news: SimpleQueue[Status] = SimpleQueue()
    closed = threading.Event()

    def listen(status: Status) -> None:
        if closed.is_set():
            raise Cancelled
        news.put(status)

    turn = sys.getswitchinterval()
    if in_window:
        sys.setswitchinterval(min(turn, SWITCH_INTERVAL))
    thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="radiosity")
    running = thread.submit(work, Progress(listen, in_window=in_window))
    try:
        while True:
            over = running.done()
            try:
                status = news.get(timeout=0.0 if over else POLL_SECONDS)
            except Empty:
                if over:
                    return running.result()
                if in_window:
                    yield None
            else:
                yield status
    finally:
        sys.setswitchinterval(turn)
        closed.set()
        thread.shutdown(wait=not in_window)


def elsewhere(work: Callable[[], R], in_background: bool) -> Generator[float, None, R]:
    """Do work on plain arrays: in a thread, with a step now and then, if somebody waits, else at once."""
    if not in_background:
        return work()
    steps = in_thread(lambda _: work())
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
