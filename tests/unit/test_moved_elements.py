"""Elements that move with their faces, and gains that are cut and joined."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics.triangles import split_in_four
from radiosity_addon.solver.gather.light_gains import LightGains
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.moved_elements import on_scene
from tests.rooms import box_room, gray_scene


def test_elements_move_with_their_faces() -> None:
    triangles, _ = box_room()
    hierarchy = Hierarchy(gray_scene(triangles, two_sided=True))
    for elements in ([3, 17], [24, 31, 5], [40]):
        hierarchy.subdivide(np.array(elements))
    elsewhere = triangles.copy()
    elsewhere[:4] = 2.0 * elsewhere[:4] + (1.0, 0.0, 3.0)
    moved = on_scene(hierarchy, gray_scene(elsewhere, two_sided=True))
    np.testing.assert_array_equal(moved.first_child, hierarchy.first_child)
    inner = np.flatnonzero(moved.first_child >= 0)
    for element in inner:
        children = moved.first_child[element] + np.arange(4)
        np.testing.assert_allclose(moved.corners[children], split_in_four(moved.corners[[element]])[0])
        np.testing.assert_allclose(moved.area[children], moved.area[element] / 4)
    np.testing.assert_array_equal(moved.corners[: len(moved.faces)], moved.faces.corners)
    leaves = moved.leaves
    assert moved.area[leaves].sum() == pytest.approx(moved.faces.area.sum())
    # What did not move is where it was, and what it came from is as it was.
    still = hierarchy.faces.triangle[hierarchy.face] >= 4
    np.testing.assert_array_equal(moved.corners[still], hierarchy.corners[still])
    np.testing.assert_array_equal(hierarchy.corners[: len(moved.faces)], hierarchy.faces.corners)


def test_other_faces_are_refused() -> None:
    triangles, _ = box_room()
    flat = triangles.copy()
    flat[0, 1] = flat[0, 0]
    with pytest.raises(ValueError, match="different faces"):
        on_scene(Hierarchy(gray_scene(triangles, two_sided=True)), gray_scene(flat, two_sided=True))


def test_gains_are_cut_and_joined() -> None:
    """Sparse and dense ones, and lights that one part has not been asked for."""
    gains, more = LightGains(6), LightGains(2)
    gains.put(0, np.array([0.0, 0, 1, 0, 0, 0]))
    gains.put(2, np.array([1.0, 2, 3, 4, 5, 6]))
    more.put(2, np.array([7.0, 8.0]))
    np.testing.assert_array_equal(gains.of(0), [0, 0, 1, 0, 0, 0])
    np.testing.assert_array_equal(gains.of(1), np.zeros(6))
    some = gains.take(np.array([5, 2]))
    np.testing.assert_array_equal(some.of(2), [6, 3])
    np.testing.assert_array_equal(some.of(0), [0, 1])
    joined = LightGains.joined([some, more])
    np.testing.assert_array_equal(joined.of(2), [6, 3, 7, 8])
    np.testing.assert_array_equal(joined.of(0), [0, 1, 0, 0])
    # Theirs are copies.
    gains.of(2)[0] = 9.0
    assert gains.of(2)[0] == 1.0
