"""Whole neighbors of divided texels: on the hit's side of what stands there, and of a hood's rim."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.texels.nearest_uncut import whole_neighbor
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver.gather.hit_numbers import NOTHING
from tests.rooms import rectangle, solid_box
from tests.unit.test_occlusion import FLOOR, SIZE, crossings_of, slab


def neighbors(other: np.ndarray, spots: np.ndarray, below: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return row and column of the neighbors that answer (k, 2) spots, in texels; −1 for none."""
    crossings = crossings_of(other)
    caster = EmbreeCaster(np.concatenate([FLOOR, other]))
    column, row = np.floor(spots).astype(int).T
    texel = crossings.geometry.index[0][row, column]
    position = np.concatenate([spots / SIZE, np.zeros((len(spots), 1))], axis=1)
    found = whole_neighbor(crossings, caster, texel, position, np.full(len(spots), below))
    there = found != NOTHING
    geometry = crossings.geometry
    return np.where(there, geometry.row[found], -1), np.where(there, geometry.column[found], -1)


@pytest.mark.parametrize("side", [-1, 1])
def test_the_nearest_on_the_spots_own_side_of_a_wall_answers(side: int) -> None:
    rng = np.random.default_rng(1)
    x = 6.5 + side * rng.uniform(0.02, 0.48, 100)
    y = rng.uniform(0.05, SIZE - 0.05, 100)
    wall = rectangle((6.5 / SIZE, -1, -0.5), (0, 3, 0), (0, 0, 1))
    row, column = neighbors(wall, np.stack([x, y], axis=1))
    assert (column == 6 + side).all()
    assert (np.abs(row - np.floor(y)) <= 1).all()


def test_inside_a_box_narrower_than_a_texel_there_is_none() -> None:
    low, high = 6.3 / SIZE, 6.7 / SIZE
    row, column = neighbors(
        solid_box((low, low, -0.1), (high, high, 0.5)), np.array([[6.5, 6.5], [6.1, 6.5]])
    )
    assert (row[0], column[0]) == (-1, -1)
    assert (row[1], column[1]) == (6, 5)


def test_nobody_answers_across_the_rim_of_a_hood() -> None:
    """Through the gap each side sees the other's texels: the line of sight is free."""
    board = slab(6.5, 11.5, 0.05)
    spots = np.stack([np.full(SIZE, 6.1), np.arange(SIZE) + 0.5], axis=1)
    assert (neighbors(board, spots)[1] == 5).all()
    assert (neighbors(board, spots + np.array([0.8, 0.0]), below=True)[1] == 7).all()
    narrow = slab(6.3, 6.7, 0.05)
    assert (neighbors(narrow, spots + np.array([0.4, 0.0]), below=True)[1] == -1).all()
