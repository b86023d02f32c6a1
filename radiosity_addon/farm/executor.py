"""The bake's side: gives kernels away through a spool, helps, and takes up what was found."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from ..base import Progress
from ..numerics import run_by, thread_count
from .helpers import Helpers, helped
from .objects import ObjectError, Writer, digest_of, name_of
from .published import PublishedArrays
from .records import CallRecord, ShareRecord
from .signs import giving_signs, this_process
from .spool import Spool
from .tasks import is_kernel, run_task, task_count, values_of

FEWEST = 4
"""Slices of a kernel that is given away, at least: fewer are done here before others have read what they
need."""

POLL = 0.02
"""Seconds between looks for results."""

PATIENCE = 2.0
"""Seconds, and …"""

TIMES = 3.0
"""… times what a task takes, after which a task that was claimed is done here: its worker may be gone."""


class FolderExecutor:
    """Gives kernels of many slices away through a spool; see `numerics.Executor`.

    record: Of all calls that were given away.
    """

    def __init__(self, spool: Spool) -> None:
        self._spool = spool
        self._store = PublishedArrays(spool)
        self.record = ShareRecord()

    def run(
        self, work: Callable[[slice], Any], slices: list[slice], threads: int, progress: Progress
    ) -> Iterator[Any] | None:
        """See `numerics.Executor`."""
        if len(slices) < FEWEST or not isinstance(work, partial) or not is_kernel(work.func):
            return None
        return self._results(work, slices, thread_count(threads), progress)

    def _results(
        self, work: partial[Any], slices: list[slice], threads: int, progress: Progress
    ) -> Iterator[Any]:
        function: Any = work.func
        record, before = CallRecord(name_of(function)), self._spool.input_bytes
        bounds = [[piece.start, piece.stop] for piece in slices]
        writer = Writer(self._store)
        text = json.dumps({"kernel": writer.tree(work), "slices": bounds})
        earlier = self._spool.done(digest_of(text))
        digest = self._spool.put_call(text)
        record.input_bytes = self._spool.input_bytes - before
        call = _SharedCall(self._spool, digest, work, bounds, threads, record, earlier)
        self.record.calls.append(record)
        try:
            for task in range(call.count):
                found = call.result(task, progress)
                for name, rays in found.rays.items():
                    if name in writer.ray_counts:
                        writer.ray_counts[name].add(rays)
                yield from found.values
                progress.at((task + 1) / call.count)
                self._store.remove_unused()
        finally:
            self._spool.close_call()
            call.close()
            self._store.end_call()
            record.ended = time.monotonic()


class _SharedCall:
    """A call whose tasks are done by workers, and here on some threads."""

    def __init__(
        self,
        spool: Spool,
        digest: str,
        work: partial[Any],
        bounds: list[list[int]],
        threads: int,
        record: CallRecord,
        earlier: set[int],
    ) -> None:
        self.count = task_count(len(bounds))
        self._spool, self._digest, self._work, self._bounds = spool, digest, work, bounds
        self._threads, self._pool = threads, ThreadPoolExecutor(threads)
        self._running: dict[Future[_Found], int] = {}
        self._found: dict[int, _Found] = {}
        self._longest = 0.0
        self._record, self._earlier = record, earlier

    def close(self) -> None:
        """Wait for what is being done here."""
        self._pool.shutdown(cancel_futures=True)

    def result(self, task: int, progress: Progress) -> _Found:
        """Return what a task found: wait for it, doing others meanwhile, and this one if nobody does."""
        found = self._wait_for(task, progress)
        if task in self._earlier:
            self._record.earlier += 1
        else:
            self._record.seconds.append(found.seconds)
            self._record.by_workers += not found.here
        self._record.result_bytes.append(self._spool.result_bytes(self._digest, task))
        return found

    def _wait_for(self, task: int, progress: Progress) -> _Found:
        since = time.monotonic()
        while True:
            found = self._found.pop(task, None) or self._stored(task)
            if found is not None:
                return found
            self._earlier.discard(task)  # it may have been damaged
            self._do_free_tasks(task)
            here = task in self._running.values()
            if not here and time.monotonic() - since > max(PATIENCE, TIMES * self._longest):
                self._do(task)
            progress.at(task / self.count)
            if not self._running:
                time.sleep(POLL)
                continue
            for future in wait(self._running, POLL, FIRST_COMPLETED).done:
                self._found[self._running.pop(future)] = future.result()

    def _stored(self, task: int) -> _Found | None:
        """Return what a task found, if that is in the spool, and not damaged."""
        stored = self._spool.result(self._digest, task)
        with suppress(ObjectError):
            if stored is not None:
                values, seconds, by, rays = values_of(*stored)
                return _Found(values, seconds, by == this_process(), rays)
        return None

    def _do_free_tasks(self, first: int) -> None:
        """Do tasks from `first` on that nobody has claimed, one on each thread."""
        if len(self._running) >= self._threads:
            return
        taken = self._spool.claimed(self._digest) | self._spool.done(self._digest)
        for task in range(first, self.count):
            if len(self._running) >= self._threads:
                return
            if task not in taken and self._spool.claim(self._digest, task):
                self._do(task)

    def _do(self, task: int) -> None:
        self._running[self._pool.submit(self._timed, task)] = task

    def _timed(self, task: int) -> _Found:
        started, busy = time.monotonic(), time.thread_time()
        values, rays = run_task(self._spool, self._digest, task, self._work, self._bounds)
        self._longest = max(self._longest, time.monotonic() - started)
        return _Found(values, time.thread_time() - busy, True, rays)


@dataclass(frozen=True)
class _Found:
    """What a task found for each of its slices, and its processor seconds.

    here: Whether this process did it.
    rays: That it took, by the names of their counts.
    """

    values: list[Any]
    seconds: float
    here: bool
    rays: dict[str, int]


@contextmanager
def shared_bake(
    spool: Spool, helpers: Helpers | None = None, *, emptied: bool = True
) -> Iterator[ShareRecord]:
    """Share what is baked within through a spool.

    helpers: Started here, and ended whatever happens.
    emptied: Remove what is in the spool when the bake ends well.
    Yields what is given away.
    """
    executor = FolderExecutor(spool)
    try:
        with run_by(executor), giving_signs(spool.sign), helped(spool, helpers):
            yield executor.record
        executor.record.problems += [] if helpers is None else helpers.problems
        if emptied:
            spool.end()
        else:
            spool.say_over()
    finally:
        spool.leave()
