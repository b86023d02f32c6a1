"""Means of a table's rows over what gather points saw."""

from __future__ import annotations

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, for_chunks, tiles

CHUNK_HITS = 1 << 18
"""Hits averaged at once: their values stay in the processor's cache."""

MUCH = 0.1
"""A change of more of the table than this part asks all rows again."""


class Means:
    """Means over rows of sources, of which only those are made anew that see something changed.

    sources (g, rays) int32.
    scratch: Makes the array of means; None keeps it in memory.
    """

    def __init__(self, sources: Array, channels: int, threads: int, scratch: Scratch | None = None) -> None:
        self._sources, self._threads = sources, threads
        self._mean = by_channel(len(sources), channels, scratch)
        for rows in tiles(len(sources)):
            self._mean[rows] = 0.0
        self._known = False

    def of(self, table: Array, changed: Array, progress: Progress = SILENT) -> Array:
        """Return (g, channels) the means of the table's rows.

        changed (table rows,) bool: Which rows changed since the last call; the first call asks all.
        """
        columns = _columns(table)
        # Where much changed every row sees some of it: to look for those that do not takes as long.
        anew = not self._known or float(changed.mean()) > MUCH

        def average(rows: slice) -> None:
            seen = self._sources[rows]
            if anew:
                self._mean[rows] = _mean_of(columns, seen)
                return
            again = np.flatnonzero(changed.take(seen, mode="wrap").any(axis=1))
            if len(again):
                self._mean[rows.start + again] = _mean_of(columns, seen[again])

        if anew or changed.any():
            chunk = max(CHUNK_HITS // max(self._sources.shape[1], 1), 1)
            for_chunks(average, len(self._sources), chunk, self._threads, progress)
        self._known = True
        return self._mean


def by_channel(count: int, channels: int, scratch: Scratch | None = None) -> Array:
    """Return (count, channels) float64 of any content, in which each channel is in one piece."""
    return (scratch or Scratch()).empty((channels, count)).T


def mean_of_sources(
    table: Array,
    sources: Array,
    threads: int = 1,
    rays: int | None = None,
    scratch: Scratch | None = None,
    progress: Progress = SILENT,
) -> Array:
    """Return (g, 3): the mean of the table's rows each gather point saw, by its first `rays` if given."""
    result = by_channel(len(sources), table.shape[1], scratch)
    columns = _columns(table)

    def average(rows: slice) -> None:
        result[rows] = _mean_of(columns, sources[rows, :rays])

    chunk = max(CHUNK_HITS // max(sources.shape[1] if rays is None else rays, 1), 1)
    for_chunks(average, len(sources), chunk, threads, progress)
    return result


def _columns(table: Array) -> list[Array]:
    """Return the table's channels, each in one piece of memory."""
    return [np.ascontiguousarray(table[:, channel]) for channel in range(table.shape[1])]


def _mean_of(columns: list[Array], sources: Array) -> Array:
    """Return (r, channels) means over the columns' values at (r, rays) sources."""
    # "wrap" lets negative numbers count from the end.
    seen = sources.astype(np.intp)
    return np.stack([column.take(seen, mode="wrap").mean(axis=1) for column in columns], axis=1)
