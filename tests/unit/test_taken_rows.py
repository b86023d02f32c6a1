"""Rows that are taken when they are asked for are those of the copy they stand for."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics import TakenRows

VALUES = np.random.default_rng(1).normal(size=(50, 3))
ROW = np.random.default_rng(2).integers(0, 50, 200).astype(np.int32)


@pytest.mark.parametrize(
    "rows", [slice(None), slice(20, 70), np.array([3, 3, 199, 0]), np.arange(200) % 3 == 0, 7]
)
def test_they_are_those_of_a_copy(rows: slice | np.ndarray | int) -> None:
    np.testing.assert_array_equal(TakenRows(VALUES, ROW)[rows], VALUES[ROW][rows])


def test_they_may_be_taken_twice() -> None:
    again = np.random.default_rng(3).integers(0, 200, 30)
    taken = TakenRows(TakenRows(VALUES, ROW), again)
    assert len(taken) == 30
    np.testing.assert_array_equal(taken[5:], VALUES[ROW][again][5:])


def test_functions_of_numpy_take_all() -> None:
    taken = TakenRows(VALUES, ROW)
    np.testing.assert_array_equal(np.asarray(taken, dtype=np.float32), VALUES[ROW].astype(np.float32))
    assert np.einsum("nk,nk->", taken, VALUES[ROW]) == pytest.approx((VALUES[ROW] ** 2).sum())
