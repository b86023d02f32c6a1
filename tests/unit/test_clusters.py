"""The tree of clusters: what is a run of what, boxes, areas and means."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.scene.faces import Faces
from radiosity_addon.solver import Scene
from radiosity_addon.solver.hierarchy.clusters import Clusters, build_clusters
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.rooms import box_room, gray, gray_scene, rectangle


def random_faces(count: int, seed: int = 0) -> Faces:
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(-5, 5, (count, 1, 3)) + rng.normal(size=(count, 3, 3))
    return Faces(Scene(triangles, rng.uniform(0, 0.9, (count, 3)), gray(count, 0.0)))


def members(clusters: Clusters, node: int) -> list[int]:
    """Faces of a node: a cluster's run, or a single face."""
    if node >= len(clusters):
        return [node - len(clusters)]
    return clusters.order[clusters.start[node] : clusters.end[node]].tolist()


GROUPS = {
    "one group": [np.arange(37)],
    "two groups": [np.arange(0, 37, 3), np.setdiff1d(np.arange(37), np.arange(0, 37, 3))],
    "a power of two": [np.arange(32)],
    "a pair": [np.array([4, 9])],
    "single faces": [np.array([5]), np.array([2]), np.array([7])],
    "an empty one between": [np.array([1, 2, 3]), np.zeros(0, dtype=int), np.array([0])],
    "a single one first": [np.array([6]), np.array([1, 2, 3, 4, 5])],
    "none": [np.zeros(0, dtype=int), np.zeros(0, dtype=int)],
}


@pytest.mark.parametrize("name", GROUPS)
def test_tree_of_every_group(name: str) -> None:
    """One root a group that is not empty; children halve their parent's run, down to single faces."""
    groups = [group for group in GROUPS[name] if len(group)]
    clusters, roots = build_clusters(random_faces(40), GROUPS[name])
    assert len(roots) == len(groups)
    for root, group in zip(roots, groups, strict=True):
        assert sorted(members(clusters, root)) == sorted(group.tolist())
    assert len(clusters) == sum(len(group) - 1 for group in groups)
    for cluster, children in enumerate(clusters.children):
        first, second = (members(clusters, child) for child in children)
        assert first + second == members(clusters, cluster)
        assert 0 <= len(second) - len(first) <= 1
    # Every node but the roots is one cluster's child, once.
    nodes = np.concatenate([clusters.children.ravel(), roots])
    assert len(np.unique(nodes)) == len(nodes) == len(clusters) + sum(map(len, groups))


def test_children_are_halves_of_their_parents_run() -> None:
    clusters, _ = build_clusters(random_faces(40), [np.arange(40)])
    for cluster, (first, second) in enumerate(clusters.children):
        if first < len(clusters):
            assert clusters.start[first] == clusters.start[cluster]
        if second < len(clusters):
            assert clusters.end[second] == clusters.end[cluster]
        if first < len(clusters) and second < len(clusters):
            assert clusters.end[first] == clusters.start[second]


@pytest.mark.parametrize("count", [2, 3, 64, 500])
def test_boxes_areas_and_coherence_are_those_of_the_faces(count: int) -> None:
    faces = random_faces(count, seed=count)
    clusters, _ = build_clusters(faces, [np.arange(0, count, 2), np.arange(1, count, 2)])
    for cluster in range(len(clusters)):
        rows = members(clusters, cluster)
        corners = faces.corners[rows].reshape(-1, 3)
        np.testing.assert_array_equal(clusters.lower[cluster], corners.min(axis=0))
        np.testing.assert_array_equal(clusters.upper[cluster], corners.max(axis=0))
        area = faces.area[rows]
        assert clusters.area[cluster] == pytest.approx(area.sum(), rel=1e-12)
        mean = area @ faces.normal[rows] / area.sum()
        assert clusters.coherence[cluster] == pytest.approx(np.linalg.norm(mean), abs=1e-12)
    np.testing.assert_allclose(np.diff(clusters.area_before), faces.area[clusters.order], rtol=1e-9)


def test_average_is_area_weighted() -> None:
    faces = random_faces(50)
    clusters, roots = build_clusters(faces, [np.arange(50)])
    values = np.random.default_rng(1).normal(size=(50, 3))
    means = clusters.average(values, faces.area)
    np.testing.assert_allclose(means[roots[0]], faces.area @ values / faces.area.sum(), atol=1e-13)
    np.testing.assert_allclose(clusters.average(np.ones((50, 3)), faces.area), 1.0, rtol=1e-12)
    parents = means * clusters.area[:, None]
    for cluster, children in enumerate(clusters.children):
        parts = [
            parents[node]
            if node < len(clusters)
            else values[node - len(clusters)] * faces.area[node - len(clusters)]
            for node in children
        ]
        np.testing.assert_allclose(parents[cluster], sum(parts), atol=1e-11)


def test_low_clusters_are_pieces_of_one_wall() -> None:
    """Neighbors that face the same way stay together: only clusters along edges mix two walls."""
    triangles, surface = box_room(n=8)
    faces = Faces(gray_scene(triangles))
    clusters, _ = build_clusters(faces, [np.arange(len(faces))])
    mixed = np.array([len(set(surface[members(clusters, c)])) > 1 for c in range(len(clusters))])
    np.testing.assert_allclose(clusters.coherence[~mixed], 1.0, atol=1e-12)
    assert (clusters.coherence[mixed] < 0.99).all()
    small = clusters.end - clusters.start <= 12
    assert mixed[small].mean() < 0.3


def test_faces_in_one_place_do_not_stop_the_tree() -> None:
    triangles = np.repeat(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), 8, axis=0)
    faces = Faces(gray_scene(triangles))
    clusters, roots = build_clusters(faces, [np.arange(16)])
    assert len(clusters) == 15
    assert sorted(members(clusters, roots[0])) == list(range(16))


def test_tiny_faces_keep_their_means_next_to_large_ones() -> None:
    """Areas 10^20 apart: the mean of a cluster of tiny faces is theirs, not the rounding of the large."""
    large = rectangle((0, 0, 0), (1e3, 0, 0), (0, 1e3, 0))
    tiny = rectangle((0, 0, 1), (1e-7, 0, 0), (0, 1e-7, 0), 2)
    triangles = np.concatenate([large, tiny])
    hierarchy = Hierarchy(gray_scene(triangles))
    values = np.where(np.arange(len(triangles))[:, None] < 2, 1e6, [1.0, 2.0, 3.0])
    means = hierarchy.clusters.average(values, hierarchy.faces.area)
    clusters = hierarchy.clusters
    of_tiny = [
        c for c in range(len(clusters)) if (clusters.order[clusters.start[c] : clusters.end[c]] >= 2).all()
    ]
    assert of_tiny
    np.testing.assert_allclose(means[of_tiny], np.tile([1.0, 2.0, 3.0], (len(of_tiny), 1)), rtol=1e-12)
