"""Means of a table's rows over what gather points saw."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, fill_chunks, map_chunks, tiles

CHUNK_HITS = 1 << 18
"""Hits averaged at once: their values stay in the processor's cache."""

MANY_CHANGED = 0.1
"""If more than this part of the table changed, all rows are computed again."""


class SourceMeans:
    """Means over rows of sources; only those whose sources changed are computed again.

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
        refresh_all = not self._known or float(changed.mean()) > MANY_CHANGED
        chunk = max(CHUNK_HITS // max(self._sources.shape[1], 1), 1)
        if refresh_all:
            average = partial(_mean_of_rows, columns, self._sources)
            fill_chunks(average, self._mean, len(self._sources), chunk, self._threads, progress)
        elif changed.any():
            renew = partial(_changed_means, columns, self._sources, changed)
            for _, (rows, means) in map_chunks(renew, len(self._sources), chunk, self._threads, progress):
                self._mean[rows] = means
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
    sources = sources[:, :rays]
    chunk = max(CHUNK_HITS // max(sources.shape[1], 1), 1)
    fill_chunks(partial(_mean_of_rows, columns, sources), result, len(sources), chunk, threads, progress)
    return result


def _mean_of_rows(columns: list[Array], sources: Array, rows: slice) -> Array:
    return _mean_of(columns, sources[rows])


def _changed_means(columns: list[Array], sources: Array, changed: Array, rows: slice) -> tuple[Array, Array]:
    """Return the rows that see something changed, and their means."""
    again = rows.start + np.flatnonzero(changed.take(sources[rows], mode="wrap").any(axis=1))
    return again, _mean_of(columns, sources[again])


def _columns(table: Array) -> list[Array]:
    """Return the table's channels, each in one piece of memory."""
    return [np.ascontiguousarray(table[:, channel]) for channel in range(table.shape[1])]


def _mean_of(columns: list[Array], sources: Array) -> Array:
    """Return (r, channels) means over the columns' values at (r, rays) sources."""
    # "wrap" lets negative numbers count from the end.
    seen = sources.astype(np.intp)
    return np.stack([column.take(seen, mode="wrap").mean(axis=1) for column in columns], axis=1)
