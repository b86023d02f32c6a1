"""Parts of leaf elements: every hit is answered from its own side of whatever stands on the leaf."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.rays.caster import Hits
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver.gather.element_cells import CELLS_PER_ELEMENT, ElementCells
from radiosity_addon.solver.gather.hit_numbers import NOTHING
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.rooms import gray_scene, rectangle, solid_box

FLOOR = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))


def parts_with(*around: np.ndarray) -> tuple[ElementCells, Hierarchy]:
    triangles = np.concatenate([FLOOR, *around])
    scene = gray_scene(triangles, two_sided=True)
    hierarchy = Hierarchy(scene)
    return ElementCells(hierarchy, EmbreeCaster(scene.triangles)), hierarchy


def hits_on_floor(position: np.ndarray, front: bool = True) -> Hits:
    """Hits at points of the unit square; FLOOR is (a, b, c), then (a, c, d)."""
    x, y = position.T
    upper = y > x
    weights = np.where(upper[:, None], np.stack([x, y - x], axis=1), np.stack([x - y, y], axis=1))
    count = len(position)
    return Hits(
        upper.astype(np.int32), weights.astype(np.float32), np.full(count, front), np.ones(count, np.float32)
    )


def spread(count: int = 2000) -> np.ndarray:
    return np.random.default_rng(3).uniform(0.002, 0.998, (count, 2))


def leaves_of(hierarchy: Hierarchy, hits: Hits) -> np.ndarray:
    return hierarchy.faces.of_triangle[(~hits.front).astype(int), hits.triangle]


@pytest.mark.parametrize("front", [True, False])
def test_nothing_in_the_way_leaves_leaves_whole(front: bool) -> None:
    parts, hierarchy = parts_with(rectangle((0, 0, 0.2), (1, 0, 0), (0, 1, 0)))
    hits = hits_on_floor(spread(), front)
    leaf = leaves_of(hierarchy, hits)
    np.testing.assert_array_equal(parts.at(leaf, hits), leaf)


def test_a_hit_on_nothing_has_no_part() -> None:
    parts, _ = parts_with()
    hits = hits_on_floor(spread(3))
    np.testing.assert_array_equal(parts.at(np.full(3, NOTHING, np.int32), hits), NOTHING)


@pytest.mark.parametrize("at", [0.11, 0.3333, 0.5, 0.83])
def test_samples_of_a_part_lie_on_the_side_of_the_hits_it_answers(at: float) -> None:
    """Light starts there: if all of it is on the hit's side of a wall, none leaks through."""
    parts, hierarchy = parts_with(rectangle((at, -1, -0.5), (0, 3, 0), (0, 0, 1)))
    position = spread()
    hits = hits_on_floor(position)
    part = parts.at(leaves_of(hierarchy, hits), hits)
    assert (part != NOTHING).mean() > 0.99  # all but slivers between a wall and an edge
    some, position = part[part != NOTHING], position[part != NOTHING]
    at_parts = parts.footprints(some)
    assert at_parts.sampler is not None
    samples = at_parts.sampler(np.arange(len(some)), np.random.default_rng(4).random((len(some), 8, 2)))
    side = position[:, 0] > at
    np.testing.assert_array_equal(samples[..., 0] > at, np.broadcast_to(side[:, None], samples.shape[:2]))
    np.testing.assert_array_equal(at_parts.points[:, 0] > at, side)
    np.testing.assert_array_equal(parts.leaf_of(some), leaves_of(hierarchy, hits)[part != NOTHING])


def test_inside_a_box_only_cells_inside_answer() -> None:
    """The box covers neither anchor of the floor's triangles nor any of their edges."""
    low, high = np.array([0.5, 0.05, -0.1]), np.array([0.75, 0.2, 0.3])
    parts, hierarchy = parts_with(solid_box(low, high))
    position = low[:2] + np.random.default_rng(5).uniform(0.01, 0.99, (500, 2)) * (high - low)[:2]
    hits = hits_on_floor(position)
    part = parts.at(leaves_of(hierarchy, hits), hits)
    assert (part >= hierarchy.n_elements).all()
    anchor = parts.footprints(part).points
    assert ((anchor[:, :2] > low[:2]) & (anchor[:, :2] < high[:2])).all()
    assert len(np.unique(part)) > 1
    assert part.max() < len(parts) == (1 + CELLS_PER_ELEMENT) * hierarchy.n_elements


def test_a_box_between_all_anchors_is_dark() -> None:
    low, high = np.array([0.50, 0.1, -0.1]), np.array([0.52, 0.12, 0.3])
    parts, hierarchy = parts_with(solid_box(low, high))
    hits = hits_on_floor(np.array([[0.51, 0.11]]))
    assert parts.at(leaves_of(hierarchy, hits), hits)[0] == NOTHING
