"""Rows of an array, by their numbers, that are taken when they are asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .arrays import Array


class TakenRows:
    """What `values[row]` would be, without its memory: index it with rows as one would index that.

    values (m, …): May be taken rows themselves.
    row (n,) int
    """

    def __init__(self, values: Array | TakenRows, row: Array) -> None:
        self._values, self._row = values, row

    def __len__(self) -> int:
        return len(self._row)

    def __getitem__(self, rows: Any) -> Array:
        return np.asarray(self._values[self._row[rows]])

    def __array__(self, dtype: npt.DTypeLike = None, copy: bool | None = None) -> Array:
        """Return all rows, for NumPy's functions."""
        return self[:].astype(dtype, copy=False)
