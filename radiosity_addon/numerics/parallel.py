"""Run one function over fixed chunks of rows on a few threads.

The chunks do not depend on the number of threads and each writes its own rows, so the
result is the same bytes whatever the machine. NumPy and embreex release the GIL, so
threads are enough.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from ..base import SILENT, Progress
from .scratch import trim

T = TypeVar("T")


def thread_count(threads: int) -> int:
    """Return `threads`, or the number of usable cores if it is 0."""
    if threads > 0:
        return threads
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def for_chunks(
    work: Callable[[slice], None], rows: int, chunk: int, threads: int, progress: Progress = SILENT
) -> None:
    """Call `work` on slices of at most `chunk` rows that cover 0 … rows (see `map_chunks`)."""
    for _ in map_chunks(work, rows, chunk, threads, progress):
        pass


def map_chunks(
    work: Callable[[slice], T], rows: int, chunk: int, threads: int, progress: Progress = SILENT
) -> Iterator[tuple[slice, T]]:
    """Call `work` on slices of at most `chunk` rows; return each slice with its result, in order.

    Canceled, it lets the slices in hand end and leaves out the others.

    work: Takes a slice of rows; must touch nothing another slice writes.
    threads: 0 means all cores.
    """
    slices = [slice(start, min(start + chunk, rows)) for start in range(0, rows, chunk)]
    workers = min(thread_count(threads), len(slices))

    def one(piece: slice) -> T:
        result = work(piece)
        trim()
        return result

    pool = ThreadPoolExecutor(workers) if workers > 1 else None
    try:
        results = map(one, slices) if pool is None else pool.map(one, slices)
        for number, (piece, result) in enumerate(zip(slices, results, strict=True)):
            yield piece, result
            progress.at((number + 1) / len(slices))
    finally:
        if pool is not None:
            pool.shutdown(cancel_futures=True)
