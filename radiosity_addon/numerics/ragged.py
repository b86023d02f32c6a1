"""Runs of different lengths, one after the other in one array, given by their counts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .arrays import Array


def run_starts(count: Array) -> Array:
    """Return (r,) the starts of runs with the given numbers of entries, (r,) int."""
    return np.asarray(np.cumsum(count) - count)


def run_numbers(count: Array, begin: Array | int = 0) -> Array:
    """Return the numbers begin, begin + 1, … of each run, (r,) int, one run after the other."""
    return np.asarray(np.arange(int(count.sum())) - np.repeat(run_starts(count) - begin, count))


def run_chunks(count: Array, most: int) -> Iterator[slice]:
    """Cut runs into chunks of at most `most` entries together, or of a single longer run."""
    ends = np.cumsum(count)
    start = 0
    while start < len(count):
        before = int(ends[start - 1]) if start else 0
        stop = max(int(np.searchsorted(ends, before + most, side="right")), start + 1)
        yield slice(start, stop)
        start = stop
