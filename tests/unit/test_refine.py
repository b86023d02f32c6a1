"""Refining links: their children cover them exactly, and none is lost."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.hierarchy.nodes import LEAF, Hierarchy
from radiosity_addon.solver.links.element_links import Links
from radiosity_addon.solver.links.refine import children_of_links, choose_side, misplaced_power
from tests.rooms import gray_scene


def hierarchy_of(count: int = 9) -> Hierarchy:
    rng = np.random.default_rng(3)
    return Hierarchy(gray_scene(rng.normal(size=(count, 3, 3)), 0.5))


def links_between(receiver: np.ndarray, source: np.ndarray, error: np.ndarray | float = 0.1) -> Links:
    count = len(receiver)
    ones = np.ones((count, 4), dtype=np.float32)
    flat = np.full(count, 0.2, dtype=np.float32)
    return Links(
        np.asarray(receiver, dtype=np.int32),
        np.asarray(source, dtype=np.int32),
        flat,
        flat,
        np.broadcast_to(np.float32(error), (count,)).copy(),
        ones,
        ones,
    )


def every_link(hierarchy: Hierarchy) -> Links:
    """One link from every node to every element."""
    nodes, elements = hierarchy.n_clusters + hierarchy.n_elements, hierarchy.n_elements
    return links_between(np.repeat(np.arange(elements), nodes), np.tile(np.arange(nodes), elements))


def node_areas(hierarchy: Hierarchy) -> np.ndarray:
    return np.concatenate([hierarchy.clusters.area, hierarchy.area])


def test_children_cover_their_link_exactly() -> None:
    """Each replaced link's pairs tile receiver × source: so do the products of their areas."""
    hierarchy = hierarchy_of()
    links = every_link(hierarchy)
    before = len(links)
    receiver, source, replaced = children_of_links(hierarchy, links, min_area=1e-9)
    assert replaced.all()
    products = hierarchy.area[links.receiver] * node_areas(hierarchy)[links.source]
    children = hierarchy.area[receiver] * node_areas(hierarchy)[source]
    assert children.sum() == pytest.approx(products.sum(), rel=1e-12)

    # The pair a child came from: the one that holds both its ends.
    up_element = {int(c): int(p) for p in range(9) for c in hierarchy.first_child[p] + np.arange(4)}
    up_node = {hierarchy.n_clusters + c: hierarchy.n_clusters + p for c, p in up_element.items()}
    cluster_of = {int(c): parent for parent, pair in enumerate(hierarchy.clusters.children) for c in pair}
    wanted = {(int(r), int(s)): a for r, s, a in zip(links.receiver, links.source, products, strict=True)}
    assert len(wanted) == before
    covered = dict.fromkeys(wanted, 0.0)
    for r, s, area in zip(receiver.tolist(), source.tolist(), children, strict=True):
        pairs = [(up_element.get(r), s), (r, up_node.get(s)), (r, cluster_of.get(s))]
        (pair,) = [pair for pair in pairs if pair in wanted and splits_into(hierarchy, pair, (r, s))]
        covered[pair] += area
    np.testing.assert_allclose(list(covered.values()), list(wanted.values()), rtol=1e-12)


def splits_into(hierarchy: Hierarchy, pair: tuple, child: tuple[int, int]) -> bool:
    """Whether the oracle splits the side of `pair` on which `child` differs."""
    links = links_between(np.array([pair[0]]), np.array([pair[1]]))
    opened, split_source, split_receiver = (bool(side[0]) for side in choose_side(hierarchy, links, 1e-9))
    if child[0] != pair[0]:
        return split_receiver
    return opened if pair[1] < hierarchy.n_clusters else split_source


def test_sides() -> None:
    """Clusters open first, then the larger side splits, or the other where that one may not."""
    hierarchy = hierarchy_of()
    links = every_link(hierarchy)
    cluster = links.source < hierarchy.n_clusters
    receiver_area, source_area = hierarchy.area[links.receiver], node_areas(hierarchy)[links.source]
    middle = float(np.median(hierarchy.area))
    for min_area in (1e-9, 0.25 * middle, 1e9):
        opened, split_source, split_receiver = choose_side(hierarchy, links, min_area)
        np.testing.assert_array_equal(opened, cluster)
        assert not (split_source & split_receiver).any()
        source_may, receiver_may = source_area >= 4 * min_area, receiver_area >= 4 * min_area
        larger = receiver_area >= source_area
        np.testing.assert_array_equal(split_receiver, ~cluster & receiver_may & (larger | ~source_may))
        np.testing.assert_array_equal(split_source, ~cluster & source_may & (~larger | ~receiver_may))


def test_no_link_is_lost_when_both_sides_are_too_small() -> None:
    hierarchy = hierarchy_of()
    n = hierarchy.n_clusters
    links = links_between(np.array([0, 1, 2]), np.array([n + 3, n + 4, 0]))
    receiver, source, replaced = children_of_links(hierarchy, links, min_area=1e9)
    assert replaced.tolist() == [False, False, True]
    assert hierarchy.n_elements == 9
    assert receiver.tolist() == [2, 2]
    assert source.tolist() == hierarchy.clusters.children[0].tolist()


def test_children_that_exist_are_used_however_small() -> None:
    """Subdiv: has children already, or may get them; the same parent splits once."""
    hierarchy = hierarchy_of(2)
    n = hierarchy.n_clusters
    hierarchy.subdivide(np.array([0]))
    first = int(hierarchy.first_child[0])
    links = links_between(np.array([0, 1]), np.array([n + 1, n + 0]))
    receiver, source, replaced = children_of_links(hierarchy, links, min_area=1e9)
    assert replaced.all()
    assert hierarchy.n_elements == 6
    children = set(range(first, first + 4))
    assert {(r, s - n) for r, s in zip(receiver.tolist(), source.tolist(), strict=True)} == (
        {(c, 1) for c in children} | {(1, c) for c in children}
    )


def test_a_shared_parent_gets_four_children_once() -> None:
    hierarchy = hierarchy_of(6)
    n = hierarchy.n_clusters
    largest = int(hierarchy.area.argmax())
    others = [e for e in range(6) if e != largest]
    receivers, sources = [*others, *[largest] * 5], [*[n + largest] * 5, *(n + np.array(others))]
    children_of_links(hierarchy, links_between(np.array(receivers), np.array(sources)), 1e-9)
    assert hierarchy.n_elements == 6 + 4
    assert (hierarchy.first_child != LEAF).sum() == 1


def test_misplaced_power_is_brightest_channel_times_area_times_error_estimate() -> None:
    hierarchy = hierarchy_of(4)
    radiosity = np.array([[1.0, 5, 2], [0, 0, 0], [3, 1, 1], [1, 1, 1]])
    n = hierarchy.n_clusters
    links = links_between(
        np.array([0, 0, 2, 3]), np.array([n, n + 1, n + 2, n + 3]), np.array([0.5, 9, 0.1, 0])
    )
    power = misplaced_power(hierarchy, links, radiosity)
    expected = [5 * hierarchy.area[0] * 0.5, 0.0, 3 * hierarchy.area[2] * np.float32(0.1), 0.0]
    np.testing.assert_allclose(power, expected, rtol=1e-6)
    cluster = links_between(np.array([1]), np.array([int(hierarchy.roots[0])]), 1.0)
    mean = hierarchy.area[:4] @ radiosity / hierarchy.area[:4].sum()
    assert misplaced_power(hierarchy, cluster, radiosity)[0] == pytest.approx(mean.max() * hierarchy.area[1])
