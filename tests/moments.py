"""Processes of shared bakes that wait, or are killed, at a moment that a test chooses."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable
from typing import Any

from radiosity_addon.farm import Spool


def waits_for_a_worker(kernel: str = "") -> None:
    """Have bakes of this process leave their first call of a kernel to workers, until one has claimed a task.

    kernel: Any kernel if empty.
    """
    put_call, waited = Spool.put_call, False

    def put_and_wait(self: Spool, text: str) -> str:
        nonlocal waited
        digest = put_call(self, text)
        if not waited and kernel in text:
            until(lambda: self.claimed(digest) | self.done(digest))
            waited = True
        return digest

    Spool.put_call = put_and_wait  # type: ignore[method-assign]


def ends_after(results: int) -> None:
    """Have this process killed when it has written so many results."""
    put_result, count = Spool.put_result, 0

    def put_and_die(self: Spool, *found: Any) -> None:
        nonlocal count
        put_result(self, *found)
        count += 1
        if count == results:
            os.kill(os.getpid(), signal.SIGKILL)

    Spool.put_result = put_and_die  # type: ignore[method-assign]


def dies_with_a_task_of(kernel: str) -> None:
    """Have this process killed as soon as it has claimed a task of a kernel."""
    claim = Spool.claim

    def claim_and_die(self: Spool, digest: str, task: int) -> bool:
        claimed = claim(self, digest, task)
        if claimed and kernel in json.dumps(self.call(digest)):
            os.kill(os.getpid(), signal.SIGKILL)
        return claimed

    Spool.claim = claim_and_die  # type: ignore[method-assign]


def until(condition: Callable[[], object], seconds: float = 90.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)
