"""Estimate of the time that a bake still takes, from its progress and the time so far."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

from .progress import Expected

FIRST_SECONDS, FIRST_FRACTION = 1.0, 0.1
"""No estimate before this time and, if nothing is known beforehand, this part of the work: the first steps do
not predict the others."""

RECENT = 0.35
"""Where nothing is known beforehand, the pace is that of this last part of the time so far, …"""

SLOWEST = 0.5
"""… but no less than this share of the mean pace: a step that makes no progress will end."""

TRUSTED = 0.04
"""What is expected beforehand counts as much as this part of the whole at the expected pace, so that a first
short step that takes many times as long says little of the others. No estimate before so much is done."""

SHORTEST_MEMORY, MEMORY = 0.7, 0.05
"""The shown time follows a new estimate within this many seconds, or this share of it."""

READING_INTERVAL = 0.05
"""Seconds between two readings that are remembered."""


class RemainingTime:
    """Estimates the time a job still takes.

    Where the time of its steps is expected beforehand: what is expected of the rest, times what the work so
    far took for each second that was expected. Else from the pace at which the fraction done grew lately.
    What is shown runs down like a clock and follows the estimate smoothly.

    clock: Seconds, from any start.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._start = self._last = clock()
        self._readings = deque([(self._start, 0.0)])
        self._expecting: tuple[float, float] | None = None
        self._shown: float | None = None

    def update(self, fraction: float, expected: Expected | None = None) -> float | None:
        """Return the seconds left when a fraction of 0 to 1 is done; None as long as nobody can know."""
        now = self._clock()
        passed, self._last = now - self._last, now
        self._remember(now, fraction)
        estimate = None
        if expected is not None:
            estimate = self._by_expectation(now, expected)
        elif self._expecting is None and fraction >= FIRST_FRACTION:
            estimate = (1.0 - fraction) / self._pace(now, fraction)
        if fraction >= 1.0:
            self._shown = 0.0
        elif self._shown is not None:
            self._shown = max(self._shown - passed, 0.0)
            if estimate is not None:
                follow = 1.0 - math.exp(-passed / max(SHORTEST_MEMORY, MEMORY * estimate))
                self._shown += follow * (estimate - self._shown)
        elif now - self._start >= FIRST_SECONDS:
            self._shown = estimate
        return self._shown

    def _by_expectation(self, now: float, expected: Expected) -> float | None:
        """Return what is left at the pace of what was done since something was expected; None at first."""
        if self._expecting is None:
            self._expecting = now, expected.done
        start, before = self._expecting
        trusted = TRUSTED * (expected.done + expected.left)
        if expected.done - before < trusted:
            return None
        slower = (now - start + trusted) / max(expected.done - before + trusted, 1e-9)
        return slower * expected.left

    def _remember(self, now: float, fraction: float) -> None:
        """Note a reading, and forget those before the recent past, except for the last of them."""
        if now - self._readings[-1][0] >= READING_INTERVAL:
            self._readings.append((now, fraction))
        since = now - RECENT * (now - self._start)
        while len(self._readings) > 1 and self._readings[1][0] <= since:
            self._readings.popleft()

    def _pace(self, now: float, fraction: float) -> float:
        """Return how much was done a second lately."""
        then, done = self._readings[0]
        mean = fraction / (now - self._start)
        recent = (fraction - done) / (now - then) if now > then else mean
        return max(recent, SLOWEST * mean)


def duration(seconds: float) -> str:
    """Return a time as people say it, rounded up: '4 s', '25 s', '2 min 10 s', '8 min', '1 h 10 min'."""
    whole = max(math.ceil(seconds - 1e-6), 0)
    if whole > 10:
        whole = 5 * math.ceil(whole / 5)
    if whole < 60:
        return f"{whole} s"
    if whole <= 300:
        minutes, seconds = divmod(10 * math.ceil(whole / 10), 60)
        return f"{minutes} min {seconds} s" if seconds else f"{minutes} min"
    minutes = math.ceil(whole / 60)
    if minutes < 60:
        return f"{minutes} min"
    minutes = 10 * math.ceil(minutes / 10)
    return f"{minutes // 60} h {minutes % 60} min" if minutes % 60 else f"{minutes // 60} h"
