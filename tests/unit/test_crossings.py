"""Texels that geometry cuts in two, and where their hits are looked up instead."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.crossings import Crossings
from radiosity_addon.lightmap.texel_geometry import NO_TEXEL
from radiosity_addon.solver import Scene
from radiosity_addon.solver.embree import EmbreeCaster
from radiosity_addon.solver.local_pass import NOTHING
from radiosity_addon.solver.visibility import Hits
from tests.rooms import grey, rectangle, solid_box
from tests.unit.texel_scenes import QUAD_UV, texel_geometry

SIZE = 16
FLOOR = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))


def crossings_of(*others: np.ndarray) -> Crossings:
    """A floor of 16 × 16 texels over the unit square, with other things on it that have no lightmap."""
    triangles = np.concatenate([FLOOR, *others])
    scene = Scene(triangles, grey(len(triangles), 0.5), grey(len(triangles), 0.0))
    uv = np.zeros((len(triangles), 3, 2), dtype=np.float32)
    uv[:2] = QUAD_UV
    pages = np.full(len(triangles), -1)
    pages[:2] = 0
    return Crossings(texel_geometry(scene, uv, SIZE, pages), EmbreeCaster(triangles))


def on_floor(position: np.ndarray) -> Hits:
    """Hits at points of the unit square."""
    x, y = position[:, 0], position[:, 1]
    upper = y > x  # FLOOR is (a, b, c), then (a, c, d)
    weights = np.where(upper[:, None], np.stack([x, y - x], axis=1), np.stack([x - y, y], axis=1))
    count = len(position)
    return Hits(upper.astype(np.int32), weights, np.ones(count, dtype=bool), np.ones(count))


def image(crossings: Crossings) -> np.ndarray:
    return crossings.crossed[crossings._geometry.index[0]]


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


@pytest.mark.parametrize("side", [-1, 1])
def test_hits_on_a_cut_texel_go_to_their_own_side(side: int) -> None:
    at = 6.5 / SIZE
    crossings = crossings_of(rectangle((at, -1, -0.5), (0, 3, 0), (0, 0, 1)))
    numbers = crossings._geometry.index[0]
    rng = np.random.default_rng(1)
    count = 200
    row = rng.integers(0, SIZE, count)
    position = np.stack(
        [
            at + side * rng.uniform(0.02, 0.48, count) / SIZE,
            (row + rng.uniform(0.05, 0.95, count)) / SIZE,
            0 * row,
        ],
        axis=1,
    )
    found = crossings.look_up(numbers[row, 6], on_floor(position))
    assert (found >= 0).all()
    column = crossings._geometry.column[found]
    assert (column == 6 + side).all()
    assert (np.abs(crossings._geometry.row[found] - row) <= 1).all()


def test_whole_texels_and_none_are_left_alone() -> None:
    crossings = crossings_of(rectangle((6.5 / SIZE, -1, -0.5), (0, 3, 0), (0, 0, 1)))
    geometry = crossings._geometry
    whole = np.flatnonzero(~crossings.crossed).astype(np.int32)
    texel = np.append(whole, NO_TEXEL).astype(np.int32)
    position = np.append(geometry.position[whole], np.zeros((1, 3)), axis=0)
    given = texel.copy()
    np.testing.assert_array_equal(crossings.look_up(texel, on_floor(position)), given)
    np.testing.assert_array_equal(texel, given)


def test_without_a_whole_neighbour_no_texel_answers() -> None:
    """Inside a box narrower than a texel no whole texel can be seen: the leaf below is asked."""
    low, high = 6.3 / SIZE, 6.7 / SIZE
    crossings = crossings_of(solid_box((low, low, -0.1), (high, high, 0.5)))
    texel = crossings._geometry.index[0][6, 6]
    assert crossings.crossed[texel]
    inside, outside = np.array([[6.5 / SIZE, 6.5 / SIZE, 0], [6.1 / SIZE, 6.5 / SIZE, 0]])
    found = crossings.look_up(np.array([texel, texel], dtype=np.int32), on_floor(np.stack([inside, outside])))
    assert found[0] == NO_TEXEL
    assert found[1] == crossings._geometry.index[0][6, 5]


@pytest.mark.parametrize("part", [0.01, 0.99])
def test_hits_beyond_the_wall_a_texel_ends_at_go_to_the_other_side(part: float) -> None:
    """The wall cuts off a hundredth of the texels: they are whole, but no hit on that part is theirs."""
    at = (6 + part) / SIZE
    crossings = crossings_of(rectangle((at, -1, -0.5), (0, 3, 0), (0, 0, 1)))
    assert not crossings.crossed.any()
    numbers = crossings._geometry.index[0]
    np.testing.assert_array_equal(crossings.touched[numbers], np.arange(SIZE) == np.full((SIZE, 1), 6))
    row = np.arange(SIZE)
    y = (row + 0.3) / SIZE
    for x, column in ((6 + 0.5 * part + (part < 0.5) * 0.5, 6), (6 + part / 2, 5), (6.5 + part / 2, 7)):
        if (column == 5 and part > 0.5) or (column == 7 and part < 0.5):
            continue
        hits = on_floor(np.stack([np.full(SIZE, x / SIZE), y], axis=1))
        found = crossings.look_up(numbers[row, 6], hits)
        np.testing.assert_array_equal(crossings._geometry.column[found], column)


def test_a_wall_beyond_the_triangle_that_owns_a_texel_touches_it() -> None:
    """On the floor's diagonal hits land on either triangle, and the wall stands on one of them."""
    crossings = crossings_of(rectangle((-1, -1 + 0.5 / SIZE, -0.5), (3, 3, 0), (0, 0, 1)))
    texel = np.diagonal(crossings._geometry.index[0])
    assert (crossings._geometry.triangle[texel] == 0).all()
    assert crossings.touched[texel].all()
    # Hits on the other triangle beyond the wall are not theirs; those before it are.
    middle = (np.arange(SIZE) + 0.5) / SIZE
    for shift, own in ((0.4, False), (0.2, True), (-0.4, True)):
        position = np.stack([middle - shift / SIZE, middle + shift / SIZE], axis=1)
        found = crossings.look_up(texel, on_floor(position))
        np.testing.assert_array_equal(found == texel, own)


def slab(low: float, high: float, height: float) -> np.ndarray:
    """What hovers over the columns from `low` to `high`, and beyond the floor in the other direction."""
    return rectangle((low / SIZE, -1, height / SIZE), (0, 3, 0), ((high - low) / SIZE, 0, 0))


def test_what_hovers_closely_hoods_what_lies_below_and_cuts_nothing() -> None:
    crossings = crossings_of(slab(6.5, 11.5, 0.05))
    columns = np.broadcast_to(np.arange(SIZE), (SIZE, SIZE))
    np.testing.assert_array_equal(image(crossings), (columns == 6) | (columns == 11))
    alone = crossings.alone[crossings._geometry.index[0]]
    np.testing.assert_array_equal(alone, (columns >= 6) & (columns <= 11))
    assert not crossings.touched.any()


@pytest.mark.parametrize("height", [0.3, -0.05])
def test_a_high_gap_and_what_lies_below_the_surface_hood_nothing(height: float) -> None:
    assert not crossings_of(slab(6.5, 11.5, height)).alone.any()


def test_hits_below_a_hood_stay_below_and_those_in_the_open_outside() -> None:
    """Through the gap each sees the other side's texels: the line of sight is free."""
    crossings = crossings_of(slab(6.5, 11.5, 0.05))
    numbers = crossings._geometry.index[0]
    row = np.arange(SIZE)
    for x, column in ((6.1, 5), (6.45, 5), (6.55, 7), (6.9, 7)):
        hits = on_floor(np.stack([np.full(SIZE, x), row + 0.5], axis=1) / SIZE)
        found = crossings.look_up(numbers[row, 6], hits)
        np.testing.assert_array_equal(found, numbers[row, column])


def test_below_a_hood_narrower_than_a_texel_there_is_nothing() -> None:
    """Its neighbours are whole and in sight, but lie in the open."""
    crossings = crossings_of(slab(6.3, 6.7, 0.05))
    numbers = crossings._geometry.index[0]
    texel = np.repeat(numbers[8, 6], 2)
    hits = on_floor(np.array([[6.5, 8.5], [6.1, 8.5]]) / SIZE)
    np.testing.assert_array_equal(crossings.look_up(texel, hits), [NOTHING, numbers[8, 5]])


@pytest.mark.parametrize("low", [0.3, 0.5])
def test_between_hoods_a_texel_answers_if_its_footprint_is_in_the_open_as_well(low: float) -> None:
    """Slats over every texel: no neighbour is whole, and no light is lost. Footprints are middle halves."""
    crossings = crossings_of(*(slab(column + low, column + low + 0.5, 0.05) for column in range(SIZE)))
    assert crossings.crossed.all()
    texel = np.repeat(crossings._geometry.index[0][8, 6], 2)
    hits = on_floor(np.array([[6.1, 8.5], [6.7, 8.5]]) / SIZE)
    answers = low == 0.5
    expected = [texel[0] if answers else NO_TEXEL, NOTHING]
    np.testing.assert_array_equal(crossings.look_up(texel, hits), expected)
    # Half of the footprint is dark: where it is not, it is twice as bright as in the mean.
    lower = crossings._geometry.triangle[texel[0]] == crossings._geometry.triangle
    inside = lower & (crossings._geometry.row + 1 < crossings._geometry.column)
    np.testing.assert_allclose(crossings.gain[inside], 2.0 if answers else 1.0)


def test_texels_beside_crossed_ones_are_told() -> None:
    """A wall cuts column 6; a board hoods columns 11 to 13, with rims in 11 and 13."""
    wall = rectangle((6.5 / SIZE, -1, -0.5), (0, 3, 0), (0, 0, 1))
    crossings = crossings_of(wall, slab(11.5, 13.5, 0.05))
    expected = np.broadcast_to(np.isin(np.arange(SIZE), [5, 7, 10, 14]), (SIZE, SIZE))
    np.testing.assert_array_equal(crossings.beside[crossings._geometry.index[0]], expected)
    assert (crossings.gain[crossings._geometry.index[0]][:, :11] == 1.0).all()
