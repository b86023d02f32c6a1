"""Gather, push and pull against dense matrices and the identities they obey."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.hierarchy.nodes import LEAF, Hierarchy
from radiosity_addon.solver.links.cluster_links import gather_at_clusters
from radiosity_addon.solver.links.element_links import Links, no_links
from radiosity_addon.solver.links.transport import (
    gather,
    inner_by_level,
    node_radiosity,
    pull,
    push,
    push_pull,
)
from radiosity_addon.solver.methods.hierarchical import HierarchicalState
from tests.unit.solved_rooms import corridor, solved


@pytest.fixture(scope="module")
def state() -> HierarchicalState:
    made = solved(corridor(), error=5e-3)
    assert made.hierarchy.level.max() >= 2
    assert 500 < made.hierarchy.n_elements + len(made.links) < 40_000
    assert (made.links.source < made.hierarchy.n_clusters).any()
    return made


def leaves_below(hierarchy: Hierarchy, element: int) -> list[int]:
    child = int(hierarchy.first_child[element])
    if child == LEAF:
        return [element]
    return [leaf for k in range(4) for leaf in leaves_below(hierarchy, child + k)]


def mean_rows(hierarchy: Hierarchy) -> np.ndarray:
    """Return (e, e): row n takes the area mean of element n over its leaves, by brute force."""
    rows = np.zeros((hierarchy.n_elements,) * 2)
    for element in range(hierarchy.n_elements):
        leaves = leaves_below(hierarchy, element)
        rows[element, leaves] = hierarchy.area[leaves] / hierarchy.area[leaves].sum()
    return rows


def dense(hierarchy: Hierarchy, links: Links) -> np.ndarray:
    """Return (4 e, e): what `gather` does to the leaves' radiosity, link by link."""
    means = mean_rows(hierarchy)
    clusters = hierarchy.clusters
    matrix = np.zeros((hierarchy.n_elements, 4, hierarchy.n_elements))
    for row in range(len(links)):
        receiver, source = int(links.receiver[row]), int(links.source[row])
        factor = float(links.factor[row] * links.visibility[row])
        if source < hierarchy.n_clusters:
            faces = clusters.order[clusters.start[source] : clusters.end[source]]
            area = hierarchy.faces.area[faces]
            of = area @ means[faces] / area.sum()
        else:
            element = source - hierarchy.n_clusters
            child = int(hierarchy.first_child[element])
            of = means[element]
            if child != LEAF:
                of = links.of_quarter[row].astype(float) @ means[child : child + 4] / 4
        split = hierarchy.first_child[receiver] != LEAF
        shares = links.to_quarter[row] if split else np.ones(4)
        matrix[receiver] += factor * shares[:, None] * of
    return matrix.reshape(-1, hierarchy.n_elements)


def test_gather_is_the_dense_matrix_of_the_links(state: HierarchicalState) -> None:
    hierarchy, links = state.hierarchy, state.links
    rng = np.random.default_rng(1)
    radiosity = rng.uniform(0, 2, (hierarchy.n_elements, 3))
    expected = (dense(hierarchy, links) @ radiosity).reshape(-1, 4, 3)
    np.testing.assert_allclose(gather(hierarchy, links, radiosity), expected, rtol=1e-5, atol=1e-7)
    # Rows of inner elements say nothing: only the leaves' radiosity counts.
    inner = hierarchy.first_child != LEAF
    noise = radiosity.copy()
    noise[inner] = 99.0
    np.testing.assert_array_equal(gather(hierarchy, links, noise), gather(hierarchy, links, radiosity))


def test_gather_is_linear_and_keeps_channels_apart(state: HierarchicalState) -> None:
    hierarchy, links = state.hierarchy, state.links
    rng = np.random.default_rng(2)
    one, two = rng.uniform(0, 1, (2, hierarchy.n_elements, 3))
    both = gather(hierarchy, links, one) + 3 * gather(hierarchy, links, two)
    np.testing.assert_allclose(gather(hierarchy, links, one + 3 * two), both, rtol=1e-5, atol=1e-9)
    red = one * [1, 0, 0]
    got = gather(hierarchy, links, red)
    assert not got[..., 1:].any()
    np.testing.assert_array_equal(got[..., :1], gather(hierarchy, links, one[:, :1]))


def test_scale_of_own_links_and_of_ancestors_means(state: HierarchicalState) -> None:
    """The first column goes with the leaves' own links, the second with all links to what is above them."""
    hierarchy, links = state.hierarchy, state.links
    rng = np.random.default_rng(3)
    radiosity = rng.uniform(0, 1, (hierarchy.n_elements, 3))
    scale = rng.uniform(0.5, 1.5, (hierarchy.n_elements, 2))
    n = hierarchy.n_clusters
    own = (links.source >= n) & (hierarchy.first_child[np.maximum(links.source - n, 0)] == LEAF)
    assert own.any()
    assert not own.all()
    expected = gather(hierarchy, links.take(own), scale[:, :1] * radiosity)
    expected += gather(hierarchy, links.take(~own), scale[:, 1:] * radiosity)
    # A cluster's mean holds its faces' means, leaf or not, and is scaled as an ancestor's.
    np.testing.assert_allclose(gather(hierarchy, links, radiosity, scale), expected, rtol=1e-5, atol=1e-9)


def test_without_links_nothing_arrives(state: HierarchicalState) -> None:
    hierarchy = state.hierarchy
    got = gather(hierarchy, no_links(), np.ones((hierarchy.n_elements, 3)))
    assert got.shape == (hierarchy.n_elements, 4, 3)
    assert not got.any()


def test_pull_takes_area_means(state: HierarchicalState) -> None:
    hierarchy = state.hierarchy
    values = np.random.default_rng(4).normal(size=(hierarchy.n_elements, 2))
    pulled = pull(hierarchy, values)
    np.testing.assert_allclose(pulled, mean_rows(hierarchy) @ values, atol=1e-13)
    np.testing.assert_array_equal(pulled[hierarchy.leaves], values[hierarchy.leaves])
    np.testing.assert_array_equal(pull(hierarchy, pulled), pulled)
    faces = len(hierarchy.faces)
    leaves = hierarchy.leaves
    np.testing.assert_allclose(
        hierarchy.faces.area @ pulled[:faces], hierarchy.area[leaves] @ values[leaves], rtol=1e-12
    )


def test_push_adds_every_ancestors_share_of_the_quarter(state: HierarchicalState) -> None:
    hierarchy = state.hierarchy
    own = np.random.default_rng(5).uniform(0, 1, (hierarchy.n_elements, 4, 3))
    total = push(hierarchy, own)
    for leaf in hierarchy.leaves:
        expected = own[leaf].mean(axis=0)
        child, parent = int(leaf), int(hierarchy.parent[leaf])
        while parent != LEAF:
            expected = expected + own[parent, child - hierarchy.first_child[parent]]
            child, parent = parent, int(hierarchy.parent[parent])
        np.testing.assert_allclose(total[leaf], expected, rtol=1e-12)


def test_push_loses_no_power(state: HierarchicalState) -> None:
    """What elements receive over their own areas is what their leaves hold after pushing."""
    hierarchy = state.hierarchy
    own = np.random.default_rng(6).uniform(0, 1, (hierarchy.n_elements, 4, 3))
    leaves = hierarchy.leaves
    at_leaves = hierarchy.area[leaves] @ push(hierarchy, own)[leaves]
    np.testing.assert_allclose(at_leaves, hierarchy.area @ own.mean(axis=1), rtol=1e-12)


def test_push_pull_reflects_at_the_leaves(state: HierarchicalState) -> None:
    hierarchy = state.hierarchy
    rng = np.random.default_rng(7)
    lights, gathered, emission = rng.uniform(0, 1, (3, hierarchy.n_elements, 3))
    reflectance = rng.uniform(0, 0.9, (len(hierarchy.faces), 3))[hierarchy.face]
    irradiance, radiosity = push_pull(hierarchy, lights, gathered, emission, reflectance)
    leaves = hierarchy.leaves
    np.testing.assert_allclose(irradiance[leaves], (lights + gathered)[leaves], rtol=1e-14)
    expected = (emission + reflectance * (lights + gathered))[leaves]
    np.testing.assert_allclose(radiosity[leaves], expected, rtol=1e-14)
    np.testing.assert_allclose(radiosity, mean_rows(hierarchy) @ radiosity, atol=1e-13)
    np.testing.assert_allclose(irradiance, mean_rows(hierarchy) @ irradiance, atol=1e-13)


def test_node_means_are_area_means_of_faces(state: HierarchicalState) -> None:
    hierarchy = state.hierarchy
    radiosity = np.random.default_rng(8).uniform(0, 1, (hierarchy.n_elements, 3))
    nodes = node_radiosity(hierarchy, radiosity)
    np.testing.assert_array_equal(nodes[hierarchy.n_clusters :], radiosity)
    clusters = hierarchy.clusters
    for cluster in range(len(clusters)):
        faces = clusters.order[clusters.start[cluster] : clusters.end[cluster]]
        area = hierarchy.faces.area[faces]
        np.testing.assert_allclose(nodes[cluster], area @ radiosity[faces] / area.sum(), rtol=1e-11)


def test_inner_elements_by_level(state: HierarchicalState) -> None:
    hierarchy = state.hierarchy
    levels = inner_by_level(hierarchy)
    assert sorted(np.concatenate(levels)) == np.flatnonzero(hierarchy.first_child != LEAF).tolist()
    for depth, elements in enumerate(levels):
        assert (hierarchy.level[elements] == depth).all()


def test_the_solution_is_a_fixed_point(state: HierarchicalState) -> None:
    """B = E + ρ K B at the leaves, to the residual reported, links to clusters included."""
    hierarchy = state.hierarchy
    assert len(state.cluster_links) > 0
    leaves = hierarchy.leaves
    scale = state.sent
    gathered = gather(hierarchy, state.links, state.radiosity, scale)
    sent = node_radiosity(hierarchy, pull(hierarchy, scale[:, 1:] * state.radiosity))
    at_faces = np.maximum(gather_at_clusters(hierarchy, state.cut, state.cluster_links, sent), 0.0)
    arriving = push(hierarchy, gathered) + at_faces[hierarchy.face]
    faces = hierarchy.face[leaves]
    again = hierarchy.faces.emission[faces] + hierarchy.faces.reflectance[faces] * arriving[leaves]
    change = hierarchy.area[leaves] @ np.abs(again - state.radiosity[leaves])
    assert change.max() / state.power == pytest.approx(state.residual, rel=1e-6)
    assert state.residual < state.settings.tolerance
