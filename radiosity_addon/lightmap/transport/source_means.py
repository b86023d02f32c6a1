"""Means of a table's rows over what gather points saw."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...base import SILENT, Progress
from ...numerics import Array, Scratch, across, fill_chunks, map_chunks, tiles

CHUNK_HITS = 1 << 19
"""Hits averaged at once; bounds the temporaries to about 12 MB a thread."""

MANY_CHANGED = 0.1
"""If more than this part of the table changed, all rows are computed again."""


class SourceMeans:
    """Means over rows of sources; only those whose sources changed are computed again.

    sources (g, rays) int32.
    tints (g, rays, channels): What the rows that are seen are multiplied with, if it is not 1.
    scratch: Makes the array of means; None keeps it in memory.
    """

    def __init__(
        self,
        sources: Array,
        channels: int,
        threads: int,
        tints: Array | None = None,
        scratch: Scratch | None = None,
    ) -> None:
        self._sources, self._tints, self._threads = sources, tints, threads
        self._mean = by_channel(len(sources), channels, scratch)
        for rows in tiles(len(sources)):
            self._mean[rows] = 0.0
        self._known = False

    def of(self, table: Array, changed: Array, progress: Progress = SILENT) -> Array:
        """Return (g, channels) the means of the table's rows.

        changed (table rows,) bool: Which rows changed since the last call; the first call asks all.
        """
        for _ in self.renewed(table, changed, progress):
            pass
        return self._mean

    def renewed(
        self, table: Array, changed: Array, progress: Progress = SILENT
    ) -> Iterator[tuple[Array | slice, Array]]:
        """Compute the means again that may have changed; yield their rows, and (r, channels) means."""
        columns = _columns(table)
        # Where much changed every row sees some of it: to look for those that do not takes as long.
        refresh_all = not self._known or float(changed.mean()) > MANY_CHANGED
        chunk = max(CHUNK_HITS // max(self._sources.shape[1], 1), 1)
        if refresh_all:
            average = partial(_mean_of_rows, columns, self._sources, self._tints)
            fill_chunks(average, self._mean, len(self._sources), chunk, self._threads, progress)
            self._known = True
            for tile in tiles(len(self._mean)):
                yield tile, self._mean[tile]
        elif changed.any():
            renew = partial(_changed_means, columns, self._sources, self._tints, changed)
            for _, (rows, means) in map_chunks(renew, len(self._sources), chunk, self._threads, progress):
                self._mean[rows] = means
                yield rows, means


def by_channel(count: int, channels: int, scratch: Scratch | None = None) -> Array:
    """Return (count, channels) float64 of any content, in which each channel is in one piece."""
    return (scratch or Scratch()).empty((channels, count)).T


def mean_of_sources(
    table: Array,
    sources: Array,
    threads: int = 1,
    rays: int | None = None,
    scratch: Scratch | None = None,
    tints: Array | None = None,
    progress: Progress = SILENT,
) -> Array:
    """Return (g, 3): the mean of the table's rows each gather point saw, by its first `rays` if given.

    tints (g, rays, 3): As for `SourceMeans`.
    """
    result = by_channel(len(sources), table.shape[1], scratch)
    columns = _columns(table)
    sources, tints = sources[:, :rays], None if tints is None else tints[:, :rays]
    chunk = max(CHUNK_HITS // max(sources.shape[1], 1), 1)
    average = partial(_mean_of_rows, columns, sources, tints)
    fill_chunks(average, result, len(sources), chunk, threads, progress)
    return result


def _mean_of_rows(columns: list[Array], sources: Array, tints: Array | None, rows: slice) -> Array:
    return _mean_of(columns, sources[rows], None if tints is None else tints[rows])


def _changed_means(
    columns: list[Array], sources: Array, tints: Array | None, changed: Array, rows: slice
) -> tuple[Array, Array]:
    """Return the rows that see something changed, and their means."""
    seen = across(np.logical_or, changed.take(sources[rows], mode="wrap"))
    again = rows.start + np.flatnonzero(seen)
    return again, _mean_of(columns, sources[again], None if tints is None else tints[again])


def _columns(table: Array) -> list[Array]:
    """Return the table's channels, each in one piece of memory."""
    return [np.ascontiguousarray(table[:, channel]) for channel in range(table.shape[1])]


def _mean_of(columns: list[Array], sources: Array, tints: Array | None) -> Array:
    """Return (r, channels) means over the columns' values at (r, rays) sources, times (r, rays, channels)."""
    # "wrap" lets negative numbers count from the end.
    seen = sources.astype(np.intp)
    found = [column.take(seen, mode="wrap") for column in columns]
    if tints is not None:
        found = [values * tints[..., channel] for channel, values in enumerate(found)]
    rays = np.float32(seen.shape[1])
    return np.stack([across(np.add, values) / rays for values in found], axis=1)
