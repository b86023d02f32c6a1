"""Texels that geometry cuts in two, touches or hoods."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.texels.occlusion import Crossings, find_crossings
from radiosity_addon.rays.embree import EmbreeCaster
from tests.rooms import gray_scene, rectangle, solid_box
from tests.unit.texel_scenes import QUAD_UV, texel_geometry

SIZE = 16
FLOOR = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))


def crossings_of(*others: np.ndarray) -> Crossings:
    """Of a floor of 16 × 16 texels over the unit square, with other things on it that have no lightmap."""
    triangles = np.concatenate([FLOOR, *others])
    scene = gray_scene(triangles)
    uv = np.zeros((len(triangles), 3, 2), dtype=np.float32)
    uv[:2] = QUAD_UV
    pages = np.full(len(triangles), -1)
    pages[:2] = 0
    return find_crossings(texel_geometry(scene, uv, SIZE, pages), EmbreeCaster(triangles))


def image(crossings: Crossings) -> np.ndarray:
    return crossings.crossed[crossings.geometry.index[0]]


def test_an_empty_floor_has_none() -> None:
    assert not crossings_of().crossed.any()
    # What hangs above, hides or covers does not cut.
    assert not crossings_of(rectangle((-1, -1, 0.1), (3, 0, 0), (0, 3, 0))).crossed.any()


@pytest.mark.parametrize("column", [0, 6, 16])
def test_texels_that_end_at_a_wall_are_whole(column: int) -> None:
    """Nothing cuts the border texels of a room's floor, nor those a wall parts from each other."""
    at = column / SIZE
    crossings = crossings_of(rectangle((at, -1, 0), (0, 3, 0), (0, 0, 1)))
    assert not crossings.crossed.any()


def test_a_wall_cuts_the_texels_it_stands_on() -> None:
    at = 6.5 / SIZE
    cut = image(crossings_of(rectangle((at, -1, -0.5), (0, 3, 0), (0, 0, 1))))
    assert cut[:, 6].all()
    assert cut.sum() == SIZE


def test_the_rim_of_a_box_cuts_and_its_inside_does_not() -> None:
    low, high = 4.5 / SIZE, 11.5 / SIZE
    cut = image(crossings_of(solid_box((low, low, 0), (high, high, 0.5))))
    expected = np.zeros((SIZE, SIZE), dtype=bool)
    expected[4:12, 4:12] = True
    expected[5:11, 5:11] = False
    np.testing.assert_array_equal(cut, expected)


@pytest.mark.parametrize("part", [0.01, 0.99])
def test_a_wall_that_cuts_off_next_to_nothing_touches(part: float) -> None:
    """A hundredth of the texels is beyond: they are whole, but no hit on that part is theirs."""
    at = (6 + part) / SIZE
    crossings = crossings_of(rectangle((at, -1, -0.5), (0, 3, 0), (0, 0, 1)))
    assert not crossings.crossed.any()
    numbers = crossings.geometry.index[0]
    np.testing.assert_array_equal(crossings.touched[numbers], np.arange(SIZE) == np.full((SIZE, 1), 6))


def test_a_wall_beyond_the_triangle_that_owns_a_texel_touches_it() -> None:
    """On the floor's diagonal hits land on either triangle, and the wall stands on one of them."""
    crossings = crossings_of(rectangle((-1, -1 - 0.5 / SIZE, -0.5), (3, 3, 0), (0, 0, 1)))
    texel = np.diagonal(crossings.geometry.index[0])
    assert (crossings.geometry.triangle[texel] == 1).all()
    assert crossings.touched[texel].all()


def slab(low: float, high: float, height: float) -> np.ndarray:
    """What hovers over the columns from `low` to `high`, and beyond the floor in the other direction."""
    return rectangle((low / SIZE, -1, height / SIZE), (0, 3, 0), ((high - low) / SIZE, 0, 0))


def test_what_hovers_closely_hoods_what_lies_below_and_cuts_nothing() -> None:
    crossings = crossings_of(slab(6.5, 11.5, 0.05))
    columns = np.broadcast_to(np.arange(SIZE), (SIZE, SIZE))
    np.testing.assert_array_equal(image(crossings), (columns == 6) | (columns == 11))
    alone = crossings.alone[crossings.geometry.index[0]]
    np.testing.assert_array_equal(alone, (columns >= 6) & (columns <= 11))
    assert not crossings.touched.any()


@pytest.mark.parametrize("height", [0.3, -0.05])
def test_a_high_gap_and_what_lies_below_the_surface_hood_nothing(height: float) -> None:
    assert not crossings_of(slab(6.5, 11.5, height)).alone.any()


def test_texels_next_to_crossed_ones_are_reported() -> None:
    """A wall cuts column 6; a board hoods columns 11 to 13, with rims in 11 and 13."""
    wall = rectangle((6.5 / SIZE, -1, -0.5), (0, 3, 0), (0, 0, 1))
    crossings = crossings_of(wall, slab(11.5, 13.5, 0.05))
    expected = np.broadcast_to(np.isin(np.arange(SIZE), [5, 7, 10, 14]), (SIZE, SIZE))
    np.testing.assert_array_equal(crossings.next_to_crossed[crossings.geometry.index[0]], expected)
