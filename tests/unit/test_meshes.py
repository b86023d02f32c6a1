"""Numbers of equal rows and places, and components, against definitions and searches."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics import connected_components, connected_faces, numbered, weld


@pytest.mark.parametrize("shape", [(0,), (0, 3), (1, 2), (300,), (300, 2), (300, 4)])
def test_rows_are_numbered_in_ascending_order_without_gaps(shape: tuple[int, ...]) -> None:
    rows = np.random.default_rng(1).integers(-2, 3, shape) / 2.0
    number = numbered(rows)
    listed = [tuple(row) for row in rows.reshape(len(rows), *(shape[1:] or (1,))).tolist()]
    distinct = sorted(set(listed))
    assert [distinct[each] for each in number] == listed
    assert set(number.tolist()) == set(range(len(distinct)))


def test_both_zeros_are_one() -> None:
    assert numbered(np.array([[0.0, 1.0], [-0.0, 1.0], [0.0, 2.0]])).tolist() == [0, 0, 1]


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_rounding_joins_round_places_and_nothing_else(tolerance: float) -> None:
    """Places on a lattice, the likely ones, are one each whatever their last digits are."""
    chance = np.random.default_rng(2)
    lattice = np.stack(np.meshgrid(*3 * [np.linspace(0.0, 1.0, 11)]), axis=-1).reshape(-1, 3)
    many = np.tile(lattice, (4, 1))
    shaken = many + 0.02 * tolerance * chance.uniform(-1, 1, many.shape)
    for scale in (1.0, 250.0, 1e-3):
        number = weld(scale * shaken, tolerance).reshape(4, -1)
        assert (number == number[0]).all()
        assert len(np.unique(number)) == len(lattice)
    beside = lattice + np.array([3.0 * tolerance, 0.0, 0.0])
    apart = np.concatenate([lattice, beside])
    assert len(np.unique(weld(apart, tolerance))) == 2 * len(lattice)


def searched(count: int, one: np.ndarray, other: np.ndarray) -> list[int]:
    """The lowest number that each reaches, by walking along the pairs."""
    beside: list[set[int]] = [set() for _ in range(count)]
    for a, b in zip(one.tolist(), other.tolist(), strict=True):
        beside[a].add(b)
        beside[b].add(a)
    lowest = [-1] * count
    for start in range(count):
        waiting = [start] if lowest[start] < 0 else []
        while waiting:
            at = waiting.pop()
            if lowest[at] < 0:
                lowest[at] = start
                waiting += beside[at]
    return lowest


@pytest.mark.parametrize("pairs", [0, 30, 100, 150, 300])
def test_components_are_what_a_search_reaches(pairs: int) -> None:
    one, other = np.random.default_rng(pairs).integers(0, 200, (2, pairs))
    assert connected_components(200, one, other).tolist() == searched(200, one, other)


def test_a_long_chain_in_any_order_is_one_component() -> None:
    order = np.random.default_rng(3).permutation(10_000)
    assert not connected_components(len(order), order[:-1], order[1:]).any()


@pytest.mark.parametrize("count", [0, 1, 60, 150])
def test_faces_that_share_corners_are_one_set(count: int) -> None:
    corners = np.random.default_rng(count).integers(0, 200, (count, 3))
    number = connected_faces(corners)
    first, second = np.nonzero((corners[:, None, :, None] == corners[None, :, None, :]).any(axis=(2, 3)))
    expected = searched(count, first, second)
    assert [sorted(set(expected))[each] for each in sorted(set(number.tolist()))] == sorted(set(expected))
    assert ((number[:, None] == number) == (np.array(expected)[:, None] == expected)).all()
