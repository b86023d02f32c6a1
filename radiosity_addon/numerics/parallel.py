"""Run one function over fixed chunks of rows on a few threads.

The chunks do not depend on the number of threads and each writes its own rows, so the
result is the same bytes whatever the machine. NumPy and embreex release the GIL, so
threads are enough.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor

from .scratch import trim


def thread_count(threads: int) -> int:
    """Return `threads`, or the number of usable cores if it is 0."""
    if threads > 0:
        return threads
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def for_chunks(work: Callable[[slice], None], rows: int, chunk: int, threads: int) -> None:
    """Call `work` on slices of at most `chunk` rows that cover 0 … rows (see `chunk_steps`)."""
    for _ in chunk_steps(work, rows, chunk, threads):
        pass


def chunk_steps(
    work: Callable[[slice], None], rows: int, chunk: int, threads: int
) -> Generator[float, None, None]:
    """Do the same in steps, and yield the fraction done after each.

    Closed early, it lets the slices in hand end and leaves out the others.

    work: Takes a slice of rows; must touch nothing another slice writes.
    threads: 0 means all cores.
    """
    slices = [slice(start, min(start + chunk, rows)) for start in range(0, rows, chunk)]
    workers = min(thread_count(threads), len(slices))

    def one(piece: slice) -> None:
        work(piece)
        trim()

    if workers <= 1:
        for number, piece in enumerate(slices):
            one(piece)
            yield (number + 1) / len(slices)
        return
    pool = ThreadPoolExecutor(workers)
    try:
        for number, _ in enumerate(pool.map(one, slices)):
            yield (number + 1) / len(slices)
    finally:
        pool.shutdown(cancel_futures=True)
