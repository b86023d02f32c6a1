"""Grouping: equal rows, corners in one place, connected components of pairs and faces."""

from __future__ import annotations

import numpy as np

from .arrays import Array

OFF_LATTICE = 0.382
"""Offset of the cells' lower ends, in cells, so that round coordinates do not lie on a boundary."""


def numbered(rows: Array) -> Array:
    """Number the distinct among (n,) or (n, k) rows in ascending order: (n,) int64, equal for equal rows."""
    if rows.ndim == 1:
        return np.asarray(np.unique(rows, return_inverse=True)[1], dtype=np.int64)
    # Several times as fast as np.unique along an axis.
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.empty(len(rows), dtype=np.int64)
    number[order] = np.cumsum(new) - 1
    return number


def weld(points: Array, tolerance: float) -> Array:
    """Number the places of (n, k) points: (n,) int64.

    Points in one cell of a lattice share a number; a cell's width is `tolerance` times the points' extent.
    """
    if len(points) == 0:
        return np.zeros(0, dtype=np.int64)
    low = points.min(axis=0)
    width = tolerance * max(float((points.max(axis=0) - low).max()), 1e-30)
    return numbered(np.floor((points - low) / width + OFF_LATTICE))


def connected_components(count: int, one: Array, other: Array) -> Array:
    """Return (count,) int: the lowest number of the set each is in, joined by pairs (p,) of numbers."""
    label = np.arange(count)
    while True:
        low = np.minimum(label[one], label[other])
        before = label.copy()
        # Whole sets move to the lower number: their roots do, and all follow their roots.
        np.minimum.at(label, before[one], low)
        np.minimum.at(label, before[other], low)
        while not np.array_equal(label, label[label]):
            label = label[label]
        if np.array_equal(label, before):
            return label


def connected_faces(corners: Array) -> Array:
    """Number the sets of faces connected by corners, given (n, 3) numbers: (n,) int64."""
    first = corners[:, :1].repeat(2, axis=1)
    label = connected_components(int(corners.max(initial=-1)) + 1, first.ravel(), corners[:, 1:].ravel())
    return numbered(label[corners[:, 0]])
