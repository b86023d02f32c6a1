"""Picking by weights: entries get their part of the unit interval, and each part is used evenly."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics import pick_in_rows, pick_in_runs, running_sums

EVENLY = (np.arange(100_000) + 0.5) / 100_000


def rows_of_weights() -> np.ndarray:
    """Rows with zeros at their ends and within, and of very different sizes."""
    weights = np.random.default_rng(1).random((40, 7)) ** 4
    weights[weights < 0.05] = 0.0
    weights[:, 3] = 0.5
    return np.asarray(weights * 10.0 ** np.linspace(-100, 100, 40)[:, None])


def test_an_even_sweep_picks_every_entry_by_its_weight() -> None:
    weights = np.array([0.0, 3.0, 0.0, 1.0, 1e-4, 5.0, 0.0])
    entry, within = pick_in_runs(running_sums(weights), EVENLY)
    found = np.bincount(entry, minlength=len(weights))
    np.testing.assert_allclose(found / len(EVENLY), weights / weights.sum(), atol=1.5 / len(EVENLY))
    # Entry and place within give the number back.
    back = (running_sums(weights)[entry] + within * weights[entry]) / weights.sum()
    np.testing.assert_allclose(back, EVENLY, atol=1e-12)


def test_runs_are_picked_from_as_if_alone() -> None:
    chance = np.random.default_rng(2)
    count = chance.integers(1, 9, 50)
    end = np.cumsum(count)
    weights = chance.random(end[-1])
    u = chance.random((50, 16)).astype(np.float32)
    begin = (end - count)[:, None]
    entry, within = pick_in_runs(running_sums(weights), u, begin, end[:, None])
    for row in range(50):
        alone, place = pick_in_runs(running_sums(weights[begin[row, 0] : end[row]]), u[row])
        np.testing.assert_array_equal(entry[row], begin[row] + alone)
        np.testing.assert_allclose(within[row], place, atol=1e-9)


def test_rows_are_picked_from_by_their_own_weights_whatever_their_size() -> None:
    weights = rows_of_weights()
    u = np.broadcast_to(EVENLY[::50], (len(weights), len(EVENLY[::50])))
    column, within = pick_in_rows(weights, u)
    rows = np.arange(len(weights))[:, None]
    assert (weights[rows, column] > 0).all()
    below = np.array([[weights[row, :at].sum() for at in range(7)] for row in range(len(weights))])
    back = (below[rows, column] + within * weights[rows, column]) / weights.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(back, u, atol=1e-9)


@pytest.mark.parametrize("u", [0.0, 1.0 - 2.0**-24, 1.0])
def test_the_ends_of_the_interval_pick_entries_that_exist(u: float) -> None:
    weights = np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 4.0]])
    numbers = np.full((2, 1), u, dtype=np.float32)
    column, within = pick_in_rows(weights, numbers)
    entry, along = pick_in_runs(
        running_sums(weights.ravel()), numbers, np.array([[0], [3]]), np.array([[3], [6]])
    )
    expected = [1, 0] if u == 0.0 else [2, 2]
    assert column[:, 0].tolist() == expected
    assert entry[:, 0].tolist() == [expected[0], 3 + expected[1]]
    for place in (within, along):
        np.testing.assert_allclose(place, round(u), atol=1e-6)


def test_without_any_weight_an_entry_is_picked_nonetheless() -> None:
    column, within = pick_in_rows(np.zeros((2, 3)), np.full((2, 4), 0.5))
    assert ((column >= 0) & (column < 3)).all()
    assert ((within >= 0) & (within <= 1)).all()
    entry, within = pick_in_runs(np.zeros(4), np.full(5, 0.5))
    assert ((entry >= 0) & (entry < 3)).all()
    assert ((within >= 0) & (within <= 1)).all()
