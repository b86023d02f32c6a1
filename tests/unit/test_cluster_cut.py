"""A cut through the cluster tree: what its nodes hold, and sums and pushes against whole faces."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.hierarchy.cluster_cut import ClusterCut
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.rooms import box_room, gray, gray_scene


@pytest.fixture(scope="module")
def hierarchy() -> Hierarchy:
    triangles, surface = box_room((3, 2, 1), n=3)
    emission = gray(len(triangles), 1.0) * (surface == 1)[:, None]
    return Hierarchy(gray_scene(triangles, 0.5, emission, two_sided=surface == 0))


def faces_of(hierarchy: Hierarchy, cluster: int) -> np.ndarray:
    clusters = hierarchy.clusters
    return clusters.order[clusters.start[cluster] : clusters.end[cluster]]


@pytest.fixture(scope="module", params=[0, 7, "all"])
def linked(request: pytest.FixtureRequest, hierarchy: Hierarchy) -> np.ndarray:
    if request.param == "all":
        return np.arange(hierarchy.n_clusters)
    return np.random.default_rng(request.param).choice(hierarchy.n_clusters, request.param, replace=False)


def test_tips_tile_the_faces_and_none_is_linked_above_another(
    hierarchy: Hierarchy, linked: np.ndarray
) -> None:
    cut = ClusterCut(hierarchy, linked, hierarchy.n_clusters + np.arange(5))
    count = hierarchy.n_clusters
    held = [faces_of(hierarchy, node) if node < count else np.array([node - count]) for node in cut.nodes]
    np.testing.assert_array_equal(np.sort(np.concatenate(held)), np.arange(len(hierarchy.faces)))
    for number, faces in enumerate(held):
        assert (cut.row_of_face[faces] == cut.n_inner + number).all()
        # Nothing below a node of the cut is linked: that is what makes it one.
        for cluster in linked:
            inside = np.isin(faces_of(hierarchy, cluster), faces)
            assert not inside.all() or cluster == cut.nodes[number]
    assert (cut.row[linked] >= 0).all()
    assert len(cut.nodes) + cut.n_inner == cut.n_rows


def test_sums_and_means_are_those_of_the_clusters(hierarchy: Hierarchy, linked: np.ndarray) -> None:
    cut = ClusterCut(hierarchy, linked)
    values = np.random.default_rng(1).uniform(0, 1, (len(hierarchy.faces), 2))
    sums, means = cut.sums(values), cut.means(values)
    expected = hierarchy.clusters.average(values, hierarchy.faces.area)
    for cluster in linked:
        np.testing.assert_allclose(
            sums[cut.row[cluster]], values[faces_of(hierarchy, cluster)].sum(axis=0), rtol=1e-12
        )
    np.testing.assert_allclose(means[linked], expected[linked], rtol=1e-12)


def test_push_is_the_transpose_of_sums(hierarchy: Hierarchy, linked: np.ndarray) -> None:
    """Σ over faces of (what is pushed to them) · w = Σ over rows of values · (sum of w below)."""
    cut = ClusterCut(hierarchy, linked)
    rng = np.random.default_rng(2)
    values, weights = rng.normal(size=(cut.n_rows, 1)), rng.normal(size=(len(hierarchy.faces), 1))
    pushed = cut.push(values)[cut.row_of_face]
    assert (pushed * weights).sum() == pytest.approx((values * cut.sums(weights)).sum(), rel=1e-10)


def test_a_scene_of_one_face_has_one_tip() -> None:
    triangle = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype=float)
    cut = ClusterCut(Hierarchy(gray_scene(triangle, 0.5, 1.0)), np.zeros(0, dtype=int))
    assert (cut.n_inner, len(cut.nodes), cut.row_of_face.tolist()) == (0, 1, [0])
    np.testing.assert_array_equal(cut.sums(np.array([[3.0]])), [[3.0]])
