"""Delayed destruction of objects that must not be destroyed right after their work.

xatlas ends its threads with a call that one of them misses if it is just about to wait for more
work, and its destructor then waits for that thread for ever, with Python's lock held: the whole
of Blender hangs. The moment is some ten instructions long, but a busy machine may suspend a thread
just there: 4 of 109,000 atlases that were destroyed at once hung, and a rest of 1 ms was not enough.
A thread that has been runnable for half a second has had its turn.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable

RELEASE_DELAY = 0.5
"""Seconds."""

MAX_WAITING = max(8, min(256, 1024 // (os.cpu_count() or 1)))
"""Maximum number of waiting objects: each keeps as many threads as the machine has cores."""


class DelayedRelease:
    """Keeps objects alive for a while; expired ones are released when a new one arrives.

    rest: Seconds that each is kept at least.
    most: With more than this, `keep` waits for the oldest.
    clock, sleep: Return the time [s]; wait for a number of seconds.
    """

    def __init__(
        self,
        rest: float = RELEASE_DELAY,
        most: int = MAX_WAITING,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._rest, self._most, self._clock, self._sleep = rest, most, clock, sleep
        self._kept: deque[tuple[float, object]] = deque()

    def keep(self, worked: object) -> None:
        """Keep an object that has just done its work, and release expired ones."""
        self._kept.append((self._clock() + self._rest, worked))
        if len(self._kept) > self._most:
            self._sleep(max(self._kept[0][0] - self._clock(), 0.0))
        while self._kept and self._kept[0][0] <= self._clock():
            self._kept.popleft()
