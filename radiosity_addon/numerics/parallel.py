"""Run a kernel over fixed chunks of rows on a few threads.

A kernel is a function of a module: it takes what it reads and, last, a slice of rows, and returns what it
found for these rows. It writes nothing. Callers pass it as `partial(kernel, …)`.

The chunks do not depend on the number of threads, so the result is the same bytes whatever the machine. NumPy
and embreex release the GIL, so threads are enough, as long as arrays are large: on a few thousand numbers at
a time two threads are no faster than one (docs/decisions/0065-chunks-for-threads.md). Within `run_by` an
executor may have other processes, also on other machines, run a kernel's chunks.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as NotYet
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from itertools import islice
from typing import Any, Protocol, TypeVar

from ..base import SILENT, Progress
from .arrays import Array
from .scratch import trim

T = TypeVar("T")

POLL = 0.1
"""Seconds between looks for cancelation."""

TOGETHER = 4
"""Slices are as many as a multiple of this, of one size: a few threads end at about the same time."""

SMALLEST = 16
"""Slices are no smaller than a chunk by this: they would take longer to hand out than to work on."""

AHEAD = 4
"""Slices a thread that are worked on, or done, before what was found for the first of them is taken."""


class Executor(Protocol):
    """Runs kernels elsewhere."""

    def run(
        self, work: Callable[[slice], Any], slices: list[slice], threads: int, progress: Progress
    ) -> Iterator[Any] | None:
        """Return what a kernel finds for each slice, in order; None if it is to be run here."""


_executor: ContextVar[Executor | None] = ContextVar("executor", default=None)
"""Of the thread that bakes; kernels run in threads that know of none."""


@contextmanager
def run_by(executor: Executor | None) -> Iterator[None]:
    """Let an executor run kernels that this thread asks for; None runs them here."""
    before = _executor.set(executor)
    try:
        yield
    finally:
        _executor.reset(before)


def thread_count(threads: int) -> int:
    """Return `threads`, or the number of usable cores if it is 0."""
    if threads > 0:
        return threads
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def fill_chunks(
    work: Callable[[slice], Array | tuple[Array, ...]],
    into: Array | tuple[Array, ...],
    rows: int,
    chunk: int,
    threads: int,
    progress: Progress = SILENT,
    at: Array | None = None,
) -> None:
    """Call `work` on slices of at most `chunk` rows that cover 0 … rows, and store its arrays.

    into: Arrays that take what `work` returns, each one of its results.
    at (rows,) int: In which of their rows; None for the same ones.
    """
    if (found := _elsewhere(work, _slices(rows, chunk), threads, progress)) is not None:
        for piece, values in found:
            _store(values, into, at, piece)
        return
    for _ in map_chunks(partial(_run_and_store, work, into, at), rows, chunk, threads, progress):
        pass


def _run_and_store(
    work: Callable[[slice], Array | tuple[Array, ...]],
    into: Array | tuple[Array, ...],
    at: Array | None,
    rows: slice,
) -> None:
    _store(work(rows), into, at, rows)


def _store(
    found: Array | tuple[Array, ...], into: Array | tuple[Array, ...], at: Array | None, rows: slice
) -> None:
    place = rows if at is None else at[rows]
    if not isinstance(into, tuple):
        into[place] = found
        return
    for array, values in zip(into, found, strict=True):
        array[place] = values


def map_chunks(
    work: Callable[[slice], T],
    rows: int,
    chunk: int,
    threads: int,
    progress: Progress = SILENT,
    abort: Callable[[], None] | None = None,
) -> Iterator[tuple[slice, T]]:
    """Call `work` on slices of at most `chunk` rows; return each slice with its result, in order.

    Canceled, it lets the slices in hand end and leaves out the others.

    work: A kernel; takes a slice of rows.
    threads: 0 means all cores.
    abort: Makes the slices in hand end soon. With it, cancelation is noticed while they are worked on.
    """
    slices = _slices(rows, chunk)
    if (found := _elsewhere(work, slices, threads, progress)) is not None:
        yield from found
        return
    workers = min(thread_count(threads), len(slices))

    def one(piece: slice) -> T:
        result = work(piece)
        trim()
        return result

    if workers <= 1 and abort is None:
        for number, piece in enumerate(slices):
            yield piece, one(piece)
            progress.at((number + 1) / len(slices))
        return
    pool, ended, left = ThreadPoolExecutor(max(workers, 1)), False, iter(slices)
    try:
        # Not all at once: what they find would stay in memory until it is asked for.
        futures = deque(pool.submit(one, piece) for piece in islice(left, AHEAD * max(workers, 1)))
        for number, piece in enumerate(slices):
            yield piece, _result(futures.popleft(), progress, number / len(slices), abort is not None)
            futures.extend(pool.submit(one, piece) for piece in islice(left, 1))
            progress.at((number + 1) / len(slices))
        ended = True
    finally:
        if abort is not None and not ended:
            abort()
        pool.shutdown(cancel_futures=True)


def _slices(rows: int, chunk: int) -> list[slice]:
    count = TOGETHER * max(-(-rows // (TOGETHER * chunk)), 1)
    size = max(-(-rows // count), -(-chunk // SMALLEST))
    return [slice(start, min(start + size, rows)) for start in range(0, rows, size)]


def _elsewhere(
    work: Callable[[slice], T], slices: list[slice], threads: int, progress: Progress
) -> Iterator[tuple[slice, T]] | None:
    """Return each slice with what the executor finds for it; None if the kernel is to be run here."""
    executor = _executor.get()
    found = None if executor is None else executor.run(work, slices, threads, progress)
    return None if found is None else zip(slices, found, strict=True)


def _result(future: Future[T], progress: Progress, fraction: float, polls: bool) -> T:
    """Wait for a result; `polls` asks now and then whether the work was canceled."""
    while polls:
        try:
            return future.result(POLL)
        except NotYet:
            if future.done():
                break
            progress.at(fraction)
    return future.result()
