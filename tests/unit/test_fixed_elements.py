"""A fixed number of elements: who is divided, and how evenly."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.equations.fixed_elements import subdivide_evenly
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.rooms import box_room, gray_scene, rectangle


def hierarchy_of(triangles: np.ndarray) -> Hierarchy:
    return Hierarchy(gray_scene(triangles))


@pytest.mark.parametrize("count", [1, 12, 100, 777, 2000])
def test_never_more_than_requested_and_nearly_as_many(count: int) -> None:
    hierarchy = hierarchy_of(box_room()[0])
    subdivide_evenly(hierarchy, count)
    leaves = hierarchy.leaves
    assert max(count - 3, 12) <= len(leaves) <= max(count, 12)
    area = hierarchy.area[leaves]
    assert area.max() <= 4 * area.min()
    assert area.sum() == pytest.approx(6.0)


def test_small_triangles_do_not_keep_large_ones_whole() -> None:
    """A detailed ornament in a room: the walls are divided as in the room alone."""
    room = box_room()[0]
    ornament = rectangle((0.5, 0.5, 0.5), (0.01, 0, 0), (0, 0.01, 0), n=20)
    hierarchy = hierarchy_of(np.concatenate([room, ornament]))
    subdivide_evenly(hierarchy, 300)
    leaves = hierarchy.leaves
    on_walls = hierarchy.face[leaves] < len(room)
    assert (~on_walls).sum() == len(ornament)
    assert on_walls.sum() >= 297
