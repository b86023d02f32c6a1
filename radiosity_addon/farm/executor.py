"""The bake's side: gives kernels away through a spool, helps, and takes up what was found."""

from __future__ import annotations

import json
import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from statistics import median
from typing import Any

from ..base import Progress
from ..numerics import run_by
from .objects import ObjectError, Writer
from .published import PublishedArrays
from .spool import Spool
from .tasks import is_kernel, run_task, task_count, values_of

FEWEST = 2
"""Slices of a kernel that is given away, at least."""

POLL = 0.02
"""Seconds between looks for results."""

PATIENCE = 2.0
"""Seconds, or …"""

TIMES = 3.0
"""… times what a task takes, after which a task that was claimed is done here: its worker may be gone."""


class FolderExecutor:
    """Gives kernels of many slices away through a spool; see `numerics.Executor`."""

    def __init__(self, spool: Spool) -> None:
        self._spool = spool
        self._store = PublishedArrays(spool)
        self._who = f"bake {socket.gethostname()} {os.getpid()}"

    def run(
        self, work: Callable[[slice], Any], slices: list[slice], progress: Progress
    ) -> Iterator[Any] | None:
        """See `numerics.Executor`."""
        if len(slices) < FEWEST or not isinstance(work, partial) or not is_kernel(work.func):
            return None
        return self._results(work, slices, progress)

    def _results(self, work: partial[Any], slices: list[slice], progress: Progress) -> Iterator[Any]:
        writer = Writer(self._store)
        bounds = [[piece.start, piece.stop] for piece in slices]
        digest = self._spool.put_call(json.dumps({"kernel": writer.tree(work), "slices": bounds}))
        count = task_count(len(slices))
        taken: list[float] = []
        try:
            for task in range(count):
                found = self._result(digest, task, count, work, bounds, taken, progress)
                yield from found
                progress.at((task + 1) / count)
        finally:
            self._spool.close_call()

    def _result(
        self,
        digest: str,
        task: int,
        count: int,
        work: partial[Any],
        bounds: list[list[int]],
        taken: list[float],
        progress: Progress,
    ) -> list[Any]:
        """Return what a task found: wait for it, doing other tasks meanwhile, and this one if nobody does."""
        since = time.monotonic()
        while True:
            stored = self._spool.result(digest, task) if task in self._spool.done(digest) else None
            if stored is not None:
                try:
                    return values_of(*stored)
                except ObjectError:
                    pass  # damaged in a way that digests do not show: done again here
            free = self._free(digest, task, count)
            waited = time.monotonic() - since
            if free is None and waited > max(PATIENCE, TIMES * median(taken or [0.0])):
                free = task
            if free is None:
                progress.at(task / count)
                time.sleep(POLL)
                continue
            started = time.monotonic()
            with run_by(None):
                run_task(self._spool, digest, free, work, bounds)
            taken.append(time.monotonic() - started)

    def _free(self, digest: str, first: int, count: int) -> int | None:
        """Claim the first task from `first` on that nobody has claimed."""
        taken = self._spool.claimed(digest) | self._spool.done(digest)
        free = (each for each in range(first, count) if each not in taken)
        return next((each for each in free if self._spool.claim(digest, each, self._who)), None)


@contextmanager
def shared_bake(spool: Spool | None) -> Iterator[None]:
    """Share what is baked within through a spool, which is emptied when it ends well; None shares nothing."""
    if spool is None:
        yield
        return
    with run_by(FolderExecutor(spool)):
        yield
    spool.end()
