"""A worker: takes tasks of a spool until the bake has ended."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

from ..base import BakeError
from ..cli import quoted
from ..numerics import one_blas_thread
from .objects import ObjectError
from .signs import BakeWatch
from .spool import RECORD, Spool
from .tasks import read_kernel, run_task, task_count

SHORTEST, LONGEST = 0.01, 0.1
"""Seconds between looks for work: longer the longer there is none."""

KEPT_CALLS = 8
"""Calls whose objects and arrays stay at hand: most are those of the call before."""


def wait_for(path: Path, seconds: float) -> Spool:
    """Return a spool once a bake has begun in it, or after a number of seconds at most.

    Raises BakeError if there is none by then, or it is of another program.
    """
    end = time.monotonic() + seconds
    while not (path.expanduser() / RECORD).exists() and time.monotonic() < end:
        time.sleep(LONGEST)
    spool = Spool.to_work(path)
    # One that was prepared waits to be run.
    while not (spool.sign.exists() or spool.is_over()) and time.monotonic() < end:
        time.sleep(LONGEST)
    return spool


@one_blas_thread()
def work(
    spool: Spool,
    idle: float = math.inf,
    say: Callable[[str], None] = lambda _: None,
    *,
    with_bake: bool = False,
) -> int:
    """Do tasks until the bake has ended, or there was none for `idle` seconds; return how many.

    say: Is told of calls that cannot be read, which the bake does itself.
    with_bake: End also when the bake was interrupted or killed, instead of waiting until it is started again.
    Raises BakeError if the spool cannot be written to.
    """
    count, pause, since = 0, SHORTEST, time.monotonic()
    watch = BakeWatch(spool.sign) if with_bake else None
    known: WeakValueDictionary[str, Any] = WeakValueDictionary()
    kept: deque[Any] = deque(maxlen=KEPT_CALLS)
    read, kernel, bounds = "", None, list[list[int]]()
    while not spool.is_over() and time.monotonic() - since < idle:
        if watch is not None and watch.is_gone():
            break
        digest = spool.open_call()
        task = None
        if digest is not None:
            try:
                if digest != read:
                    kernel, bounds = read_kernel(spool, digest, known)
                    read = digest
                    kept.append(kernel)
            except ObjectError as error:
                if not spool.is_over() and spool.open_call() == digest:
                    say(f"call {digest} is left to others: {error}")
                read, kernel, bounds = digest, None, []
            task = _free_task(spool, digest, task_count(len(bounds)))
        if task is None or digest is None or kernel is None:
            time.sleep(pause)
            pause = min(2 * pause, LONGEST)
            continue
        try:
            run_task(spool, digest, task, kernel, bounds)
        except BakeError:
            if spool.is_over():
                break
            raise
        count, pause, since = count + 1, SHORTEST, time.monotonic()
    return count


def open_tasks(spool: Spool) -> list[str]:
    """Return the names of the tasks of the open call that nobody has begun: its digest and their numbers."""
    digest = spool.open_call()
    if digest is None:
        return []
    try:
        count = task_count(len(spool.call(digest)["slices"]))
    except (ObjectError, KeyError, TypeError):
        return []
    begun = spool.claimed(digest) | spool.done(digest)
    return [f"{digest}-{task}" for task in range(count) if task not in begun]


@one_blas_thread()
def do_task(spool: Spool, name: str) -> None:
    """Do one task of the open call, also if somebody has begun it: who has may be gone.

    Raises BakeError if there is no such task, it is done, or the spool cannot be written to.
    """
    digest, _, number = name.partition("-")
    if number.isascii() and number.isdecimal() and len(number) < 9 and digest == spool.open_call():
        task = int(number)
        try:
            kernel, bounds = read_kernel(spool, digest)
        except ObjectError as error:
            raise BakeError(f"task {name} cannot be done: {error}") from error
        if task < task_count(len(bounds)) and task not in spool.done(digest):
            spool.claim(digest, task)
            run_task(spool, digest, task, kernel, bounds)
            return
    raise BakeError(f"'{spool.path}' has no open task {quoted(name)}: see `status --tasks`")


def _free_task(spool: Spool, digest: str, count: int) -> int | None:
    """Claim a task that nobody has claimed; None if there is none.

    Raises BakeError if the spool cannot be written to.
    """
    taken = spool.claimed(digest) | spool.done(digest)
    for task in range(count):
        try:
            if task not in taken and spool.claim(digest, task):
                return task
        except BakeError:
            if spool.is_over():
                return None
            raise
    return None
