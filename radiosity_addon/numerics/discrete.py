"""Picking entries in proportion to their weights, by a random number each.

What is left of the number, uniform again, places a sample within the entry, so that stratified numbers
give stratified samples.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array


def running_sums(weights: Array) -> Array:
    """Return (m + 1,) float64 the sums of all weights (m,) before each, and of all."""
    return np.concatenate([[0.0], np.cumsum(weights, dtype=np.float64)])


def pick_in_runs(
    running: Array, u: Array, begin: Array | int = 0, end: Array | None = None
) -> tuple[Array, Array]:
    """Pick among runs of entries.

    running (m + 1,): See `running_sums`.
    u (…,) float in [0, 1).
    begin, end (…,) int: The run that each is picked from; all entries by default.
    Returns entry (…,) int.
    Returns within (…,) float64 in [0, 1].
    """
    end = np.asarray(len(running) - 1) if end is None else end
    low = running[begin]
    wanted = low + np.asarray(u, dtype=np.float64) * (running[end] - low)
    entry = np.clip(np.searchsorted(running, wanted, side="right") - 1, begin, end - 1)
    width = np.maximum(running[entry + 1] - running[entry], 1e-300)
    return entry, np.clip((wanted - running[entry]) / width, 0.0, 1.0)


def pick_in_rows(weights: Array, u: Array) -> tuple[Array, Array]:
    """Pick k times among each row of (n, m) weights by (n, k) numbers: the columns, and within (n, k).

    For rows that are short, or far from each other in size: no row's rounding reaches another.
    """
    running = np.cumsum(weights, axis=1)
    wanted = np.asarray(u, dtype=np.float64) * running[:, -1:]
    column = (running[:, None, :-1] <= wanted[..., None]).sum(axis=2)
    width = np.take_along_axis(weights, column, axis=1)
    below = np.take_along_axis(running - weights, column, axis=1)
    return column, np.clip((wanted - below) / np.maximum(width, 1e-300), 0.0, 1.0)
