"""Reductions over short rows: NumPy's own take several times as long there."""

from __future__ import annotations

import numpy as np

from .arrays import Array

SHORT = 8
"""Rows of fewer numbers are reduced faster column by column."""


def across(operation: np.ufunc, values: Array) -> Array:
    """Return (n,) an operation over the rows of (n, k) values, k > 0: what its `reduce` returns."""
    count = values.shape[1]
    if count >= SHORT:
        return np.asarray(operation.reduce(values, axis=1))
    result = values[:, 0].copy()
    for column in range(1, count):
        operation(result, values[:, column], out=result)
    return result
