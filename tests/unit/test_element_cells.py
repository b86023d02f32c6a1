"""Parts of leaf elements: every hit is answered from its own side of whatever stands on the leaf."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.rays.caster import Hits
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver.gather.element_cells import (
    CELLS_PER_ELEMENT,
    FINE,
    FINEST,
    MAX_DEPTH,
    NEAR,
    ElementCells,
)
from radiosity_addon.solver.gather.hit_numbers import NOTHING
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.rooms import gray_scene, rectangle, solid_box

FLOOR = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))


def parts_with(*around: np.ndarray, finest: float = np.inf) -> tuple[ElementCells, Hierarchy]:
    triangles = np.concatenate([FLOOR, *around])
    scene = gray_scene(triangles, two_sided=True)
    hierarchy = Hierarchy(scene)
    return ElementCells(hierarchy, EmbreeCaster(scene.triangles), finest), hierarchy


def hits_on_floor(position: np.ndarray, front: bool = True, distance: float = 1.0) -> Hits:
    """Hits at points of the unit square; FLOOR is (a, b, c), then (a, c, d)."""
    x, y = position.T
    upper = y > x
    weights = np.where(upper[:, None], np.stack([x, y - x], axis=1), np.stack([x - y, y], axis=1))
    count = len(position)
    return Hits(
        upper.astype(np.int32),
        weights.astype(np.float32),
        np.full(count, front),
        np.full(count, distance, np.float32),
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


@pytest.mark.parametrize("texel", [0.4, 0.1, 0.03, 0.006])
@pytest.mark.parametrize("distance", [5.0, 0.01])
def test_parts_that_answer_are_no_wider_than_a_few_texels(texel: float, distance: float) -> None:
    """Even from afar: a picture hangs before the wall, and lines of sight pass between them."""
    parts, hierarchy = parts_with(rectangle((0.3, 0.3, 0.1), (0.4, 0, 0), (0, 0.4, 0)), finest=texel)
    position = spread()
    hits = hits_on_floor(position, distance=distance)
    leaf = leaves_of(hierarchy, hits)
    part = parts.at(leaf, hits)
    np.testing.assert_array_equal(parts.leaf_of(part), leaf)
    assert part.max() < len(parts)
    anchor, size, radius = parts.footprints(part).points, np.sqrt(hierarchy.area[leaf]), parts.radius(part)
    # All parts are similar to the leaf.
    width = size * radius / parts.radius(leaf)
    assert (width <= FINE * texel * (1 + 1e-6)).all()
    if distance < NEAR * FINEST * texel:
        finest = np.maximum(FINEST * texel, size / 4**MAX_DEPTH)
        assert (width <= finest * (1 + 1e-6)).all()
    assert (np.linalg.norm(anchor[:, :2] - position, axis=1) <= radius).all()
    assert texel < 0.3 or distance < 1.0 or (part == leaf).all()


def test_samples_of_parts_fill_them() -> None:
    """Of every level: their mean is the middle of the part."""
    for texel in (1.0, 0.1, 0.03, 0.01):
        parts, hierarchy = parts_with(finest=texel)
        hits = hits_on_floor(np.array([[0.3, 0.55]]))
        part = parts.at(leaves_of(hierarchy, hits), hits)
        at = parts.footprints(part)
        assert at.sampler is not None
        samples = at.sampler(np.arange(1), np.random.default_rng(6).random((1, 4000, 2)))
        apart = np.linalg.norm(samples - at.points[:, None], axis=2).max(axis=1)
        np.testing.assert_allclose(apart, parts.radius(part), rtol=0.05)
        # The anchor is next to the centroid.
        offset = np.linalg.norm(samples.mean(axis=1) - at.points, axis=1)
        assert (offset < 0.1 * parts.radius(part)).all()


def test_below_a_hood_answer_parts_below_it() -> None:
    """A sheet a millimeter above half of the floor, which lines of sight pass below."""
    rim, texel = 0.5, 0.02
    parts, hierarchy = parts_with(rectangle((rim, -1, 0.001), (1, 0, 0), (0, 3, 0)), finest=texel)
    position = spread()
    hits = hits_on_floor(position, distance=0.0015)
    part = parts.at(leaves_of(hierarchy, hits), hits)
    assert (part != NOTHING).mean() > 0.99
    some, below = part[part != NOTHING], position[part != NOTHING, 0] > rim
    at = parts.footprints(some)
    assert at.sampler is not None
    np.testing.assert_array_equal(at.points[:, 0] > rim, below)
    samples = at.sampler(np.arange(len(some)), np.random.default_rng(7).random((len(some), 8, 2)))
    np.testing.assert_array_equal(samples[..., 0] > rim, np.broadcast_to(below[:, None], samples.shape[:2]))


def test_parts_are_renumbered_where_leaves_are_cut_alike() -> None:
    fine, hierarchy = parts_with(finest=0.01)
    np.testing.assert_array_equal(fine.renumbered(fine), np.arange(len(fine)))
    coarse, _ = parts_with(finest=0.1)
    number = fine.renumbered(coarse)
    assert len(coarse) < len(fine) == len(number)
    np.testing.assert_array_equal(number[: hierarchy.n_elements], np.arange(hierarchy.n_elements))
    assert (number[hierarchy.n_elements :] == NOTHING).all()
