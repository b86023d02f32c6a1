"""Faces, quadtrees of elements, and finding the leaf under a point."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics.triangles import split_in_four
from radiosity_addon.scene.faces import Faces
from radiosity_addon.solver import Scene
from radiosity_addon.solver.hierarchy.nodes import LEAF, Hierarchy
from tests.rooms import gray, gray_scene

RNG_SEED = 7


def random_scene(
    count: int = 6, flat: tuple[int, ...] = (2,), two_sided: tuple[int, ...] = (1, 2, 4)
) -> Scene:
    """Random triangles, some without area, some two-sided."""
    rng = np.random.default_rng(RNG_SEED)
    triangles = rng.normal(size=(count, 3, 3))
    for row in flat:
        triangles[row, 2] = triangles[row, 0]
    sides = np.zeros(count, dtype=bool)
    sides[list(two_sided)] = True
    return Scene(triangles, rng.uniform(0, 0.9, (count, 3)), rng.uniform(0, 2, (count, 3)), two_sided=sides)


def grown(rounds: int = 5) -> Hierarchy:
    """A hierarchy whose random leaves were split a few times."""
    hierarchy = Hierarchy(random_scene())
    rng = np.random.default_rng(1)
    for _ in range(rounds):
        leaves = hierarchy.leaves
        hierarchy.subdivide(rng.choice(leaves, size=max(len(leaves) // 3, 1), replace=False))
    return hierarchy


def vector_areas(corners: np.ndarray) -> np.ndarray:
    """Return half the cross products (..., 3): normal times area."""
    return 0.5 * np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :])


# --- faces ------------------------------------------------------------------------------------


def test_faces_are_solid_fronts_then_backs_of_the_two_sided() -> None:
    scene = random_scene()
    faces = Faces(scene)
    assert faces.triangle.tolist() == [0, 1, 3, 4, 5, 1, 4]
    assert faces.front.tolist() == [True] * 5 + [False] * 2
    assert faces.of_triangle.tolist() == [[0, 1, LEAF, 2, 3, 4], [LEAF, 5, LEAF, LEAF, 6, LEAF]]


def test_both_sides_of_a_face_are_counter_clockwise_seen_from_their_own() -> None:
    scene = random_scene()
    faces = Faces(scene)
    np.testing.assert_allclose(vector_areas(faces.corners), faces.area[:, None] * faces.normal, atol=1e-14)
    back = np.flatnonzero(~faces.front)
    front = faces.of_triangle[0, faces.triangle[back]]
    np.testing.assert_array_equal(faces.normal[back], -faces.normal[front])
    np.testing.assert_array_equal(faces.corners[front], scene.triangles[faces.triangle[front]])
    for name in ("area", "reflectance", "emission"):
        np.testing.assert_array_equal(getattr(faces, name)[back], getattr(faces, name)[front])


def test_a_scene_of_nothing_but_slivers_has_no_faces() -> None:
    scene = random_scene(3, flat=(0, 1, 2), two_sided=(1,))
    faces = Faces(scene)
    assert len(faces) == 0
    assert (faces.of_triangle == LEAF).all()
    hierarchy = Hierarchy(scene)
    assert hierarchy.n_elements == hierarchy.n_clusters == len(hierarchy.roots) == len(hierarchy.leaves) == 0


# --- elements ---------------------------------------------------------------------------------


def test_split_in_four_joins_the_midpoints() -> None:
    corners = np.random.default_rng(2).normal(size=(50, 3, 3))
    parts = split_in_four(corners)
    whole = vector_areas(corners)
    np.testing.assert_allclose(vector_areas(parts), np.repeat(whole[:, None] / 4, 4, axis=1), atol=1e-13)
    for corner in range(3):
        np.testing.assert_array_equal(parts[:, corner, corner], corners[:, corner])
    np.testing.assert_allclose(parts[:, 3].mean(axis=1), corners.mean(axis=1), atol=1e-14)
    np.testing.assert_allclose(parts.mean(axis=(1, 2)), corners.mean(axis=1), atol=1e-14)


def test_leaves_tile_every_face_after_any_splitting() -> None:
    hierarchy = grown()
    leaves = hierarchy.leaves
    assert hierarchy.level[leaves].max() >= 3
    area = np.bincount(hierarchy.face[leaves], hierarchy.area[leaves])
    np.testing.assert_allclose(area, hierarchy.faces.area, rtol=1e-13)
    np.testing.assert_allclose(
        vector_areas(hierarchy.corners), hierarchy.area[:, None] * hierarchy.normal, atol=1e-13
    )


def test_children_know_their_parents_and_stand_together() -> None:
    hierarchy = grown()
    inner = np.flatnonzero(hierarchy.first_child != LEAF)
    children = hierarchy.first_child[inner][:, None] + np.arange(4)
    assert len(np.unique(children)) == hierarchy.n_elements - len(hierarchy.faces)
    for of_children, of_parents in (
        (hierarchy.parent, np.arange(hierarchy.n_elements)),
        (hierarchy.face, hierarchy.face),
        (hierarchy.level, hierarchy.level + 1),
        (hierarchy.area, hierarchy.area / 4),
    ):
        assert (of_children[children] == of_parents[inner][:, None]).all()
    np.testing.assert_array_equal(hierarchy.corners[children], split_in_four(hierarchy.corners[inner]))
    roots = np.arange(len(hierarchy.faces))
    assert (hierarchy.parent[roots] == LEAF).all()
    assert (hierarchy.level[roots] == 0).all()
    np.testing.assert_array_equal(hierarchy.face[roots], roots)


def test_splitting_nothing_changes_nothing() -> None:
    hierarchy = grown()
    before = hierarchy.n_elements
    hierarchy.subdivide(np.zeros(0, dtype=np.int64))
    assert hierarchy.n_elements == before


@pytest.mark.parametrize("front", [True, False])
def test_leaf_at_is_the_leaf_that_holds_the_point(front: bool) -> None:
    """The triangle's own weights find the leaf on either side, though backs run the other way round."""
    hierarchy = grown()
    faces = hierarchy.faces
    rows = np.flatnonzero(faces.front == front)
    rng = np.random.default_rng(3)
    face = rng.choice(rows, 3000)
    weights = rng.dirichlet(np.ones(3), len(face))
    points = np.einsum("nc,nck->nk", weights, random_scene().triangles[faces.triangle[face]])
    leaf = hierarchy.leaf_at(face, weights[:, 1:])
    assert leaf.dtype == np.int32
    assert (hierarchy.first_child[leaf] == LEAF).all()
    np.testing.assert_array_equal(hierarchy.face[leaf], face)
    a, b, c = (hierarchy.corners[leaf][:, k] for k in range(3))
    signs = [
        np.einsum("nk,nk->n", vector_areas(np.stack(part, axis=1)), faces.normal[face])
        for part in ((points, a, b), (points, b, c), (points, c, a))
    ]
    assert (np.array(signs) >= -1e-12).all()
    # Every leaf is found in proportion to its area within its face.
    leaves = hierarchy.leaves[np.isin(hierarchy.face[hierarchy.leaves], rows)]
    found = np.bincount(leaf, minlength=hierarchy.n_elements)[leaves]
    tries = np.bincount(face, minlength=len(faces))[hierarchy.face[leaves]]
    expected = hierarchy.area[leaves] / faces.area[hierarchy.face[leaves]]
    np.testing.assert_allclose(found / tries, expected, atol=0.06)


def test_leaf_at_corners_and_just_outside() -> None:
    """Float32 weights from ray casting may leave the triangle by a rounding: still one of its leaves."""
    hierarchy = grown()
    weights = np.array(
        [[0, 0], [1, 0], [0, 1], [0.5, 0.5], [1 / 3, 1 / 3], [-1e-6, 0.3], [0.7, 0.300001], [1.000001, 0]]
    )
    for face in range(len(hierarchy.faces)):
        leaf = hierarchy.leaf_at(np.full(len(weights), face), weights)
        assert (hierarchy.face[leaf] == face).all()
        assert (hierarchy.first_child[leaf] == LEAF).all()
    for corner, at in enumerate([(0, 0), (1, 0), (0, 1)]):
        leaf = int(hierarchy.leaf_at(np.array([0]), np.array([at], dtype=float))[0])
        np.testing.assert_array_equal(hierarchy.corners[leaf, corner], hierarchy.corners[0, corner])


def test_fronts_backs_and_emitters_have_trees_of_their_own() -> None:
    """Few samples would miss a small lamp among dark faces; a back is unseen where its front is seen."""
    rng = np.random.default_rng(5)
    triangles = rng.normal(size=(20, 3, 3))
    emission = gray(20, 0.0)
    emission[[3, 8, 15], 1] = 1.0
    sides = np.arange(20) < 6
    hierarchy = Hierarchy(gray_scene(triangles, 0.5, emission, two_sided=sides))
    clusters, faces = hierarchy.clusters, hierarchy.faces
    trees = [set(clusters.order[clusters.start[r] : clusters.end[r]].tolist()) for r in hierarchy.roots]
    shines = faces.emission.max(axis=1) > 0
    kinds = (~shines & faces.front, ~shines & ~faces.front, shines)
    assert trees == [set(np.flatnonzero(kind).tolist()) for kind in kinds]
