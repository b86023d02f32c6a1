"""A worker: takes tasks of a spool until the bake has ended."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..base import BakeError
from .objects import ObjectError
from .recent import Recent
from .signs import BakeWatch
from .spool import Spool
from .tasks import read_kernel, run_task, task_count

SHORTEST, LONGEST = 0.01, 0.1
"""Seconds between looks for work: longer the longer there is none."""


def wait_for(path: Path, seconds: float) -> None:
    """Wait until a spool is there, for a number of seconds at most."""
    end = time.monotonic() + seconds
    while not (path.expanduser() / "spool.json").exists() and time.monotonic() < end:
        time.sleep(LONGEST)


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
    known: Recent[Any] = Recent()
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
