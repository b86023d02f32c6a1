"""Linear elements: which vertices are shared, where their nodes lie, what the hats add up to."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver import Scene
from radiosity_addon.solver.equations.fixed_elements import subdivide_evenly
from radiosity_addon.solver.equations.linear_basis import INWARD, vertex_basis
from radiosity_addon.solver.hierarchy.basis import Basis, constant_basis
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.cornell import cornell_box
from tests.rooms import box_room, gray, gray_scene, rectangle, sphere


def basis_of(triangles: np.ndarray, elements: int = 0, **scene: object) -> tuple[Hierarchy, Basis]:
    options = {"reflectance": gray(len(triangles), 0.5), "emission": gray(len(triangles), 0.0), **scene}
    hierarchy = Hierarchy(Scene(triangles, **options))
    subdivide_evenly(hierarchy, elements)
    return hierarchy, vertex_basis(hierarchy)


def floor(n: int = 1) -> np.ndarray:
    return rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0), n)


@pytest.mark.parametrize(("elements", "side"), [(12, 2), (48, 3), (192, 5)])
def test_a_cubes_walls_share_nothing_but_their_diagonals(elements: int, side: int) -> None:
    """(2^k + 1)² vertices on each of six walls."""
    _, basis = basis_of(box_room()[0], elements)
    assert len(basis.leaf) == elements
    assert len(basis) == 6 * side**2


def test_vertices_are_shared_over_a_mesh_in_one_plane() -> None:
    """A grid of 4 × 4 squares has 25; only the 16 on its rim move inwards."""
    hierarchy, basis = basis_of(floor(4))
    assert len(basis) == 25
    moved = ~(basis.place == 1.0).any(axis=1)
    points = basis.points(hierarchy)
    corners = np.unique(floor(4).reshape(-1, 3), axis=0)
    on_rim = ((corners[:, :2] == 0) | (corners[:, :2] == 2)).any(axis=1)
    assert moved.sum() == on_rim.sum() == 16
    inside = corners[~on_rim]
    np.testing.assert_allclose(points[~moved][np.lexsort(points[~moved].T[::-1])], inside, atol=1e-15)
    # The others leave their vertex by INWARD of the way to a centroid, into their own leaf.
    np.testing.assert_allclose(np.sort(basis.place[moved], axis=1)[:, 0], INWARD / 3)
    assert ((points[moved][:, :2] > 0) & (points[moved][:, :2] < 2)).all()


def test_a_wall_on_an_edge_parts_the_floor() -> None:
    """κ is discontinuous at a crease: both sides of it, and the wall, have nodes of their own."""
    mesh = floor(2)
    _, whole = basis_of(mesh)
    assert len(whole) == 9
    wall = rectangle((1, 0, 0), (0, 1, 0), (0, 0, 1))
    hierarchy, parted = basis_of(np.concatenate([mesh, wall]))
    # Over half the floor's width: the foot's outer vertex is split, its end in the middle is not.
    assert len(parted) == 9 + 1 + 4
    points = parted.points(hierarchy)
    at_end = np.linalg.norm(points - (1, 1, 0), axis=1)
    assert at_end[: len(parted)].min() > 0.0  # κ jumps there too, so the node has moved


@pytest.mark.parametrize("what", ["reflectance", "emission"])
def test_materials_part_vertices(what: str) -> None:
    values = gray(8, 0.5)
    values[:4] = 0.25
    _, basis = basis_of(floor(2), **{what: values})
    joined = np.intersect1d(basis.corner[:4], basis.corner[4:])
    assert len(joined) == 0
    assert len(basis) > 9


def test_bent_surfaces_share_no_vertices() -> None:
    """A sphere of flat triangles: three for each."""
    triangles = sphere(1)
    _, basis = basis_of(triangles)
    assert len(basis) == 3 * len(triangles)


def test_the_two_sides_of_a_sheet_are_apart() -> None:
    hierarchy, basis = basis_of(floor(2), two_sided=True)
    assert len(basis) == 18
    front = hierarchy.faces.front[basis.faces(hierarchy)]
    assert front.sum() == 9
    assert len(np.intersect1d(basis.corner[hierarchy.faces.front], basis.corner[~hierarchy.faces.front])) == 0


def test_triangles_turned_over_join_with_the_side_they_show() -> None:
    """Two triangles of a square, one wound the other way: fronts join backs, 4 vertices a side."""
    square = floor()
    square[1] = square[1, ::-1]
    hierarchy, basis = basis_of(square, two_sided=True)
    assert len(basis) == 8
    up = hierarchy.normal[basis.leaf][:, 2] > 0
    assert len(np.unique(basis.corner[up])) == 4


def test_hanging_vertices_belong_to_the_smaller_leaves() -> None:
    """Beside a larger leaf a hat stands on the smaller ones only, its node moved off the edge."""
    hierarchy = Hierarchy(gray_scene(floor(), 0.5))
    hierarchy.subdivide(np.array([0]))
    basis = vertex_basis(hierarchy)
    assert len(basis) == 4 + 3  # the square's corners, and the middles of the split triangle's edges
    hanging = np.flatnonzero(np.isclose(basis.points(hierarchy)[:, :2], 1.0, atol=0.2).all(axis=1))
    assert len(hanging) == 1
    large = np.flatnonzero(hierarchy.area[basis.leaf] == hierarchy.area[1])
    assert hanging[0] not in basis.corner[large]
    assert not (basis.place[hanging] == 1.0).any()


@pytest.mark.parametrize("elements", [32, 100, 333])
def test_hats_add_up_to_one(elements: int) -> None:
    """Everywhere, so their areas add up to the scene's; each node is in its own face."""
    hierarchy = Hierarchy(cornell_box())
    subdivide_evenly(hierarchy, elements)
    basis = vertex_basis(hierarchy)
    assert basis.area.sum() == pytest.approx(hierarchy.faces.area.sum(), rel=1e-12)
    ones = np.ones((len(basis), 1))
    rows = np.arange(len(basis.leaf))
    np.testing.assert_allclose(basis.evaluate(ones, rows, np.full((len(rows), 3), 1 / 3)), 1.0)
    np.testing.assert_allclose(basis.leaf_means(ones), 1.0)
    mass = basis.mass()
    assert mass is not None
    np.testing.assert_allclose(mass.sum(axis=1), 1.0)
    assert (np.diagonal(mass) >= 1 - 2 * INWARD / 3 - 1e-12).all()
    # A corner's unknown is the one its home says.
    assert (basis.corner[basis.home, basis.place.argmax(axis=1)] == np.arange(len(basis))).all()
    look = np.concatenate([hierarchy.faces.reflectance, hierarchy.faces.normal], axis=1)
    for corner in range(3):
        own = look[basis.faces(hierarchy)[basis.corner[:, corner]]]
        np.testing.assert_allclose(own, look[hierarchy.face[basis.leaf]], atol=1e-12)


def test_constant_elements_are_the_special_case() -> None:
    hierarchy, linear = basis_of(box_room()[0], 48)
    basis = constant_basis(hierarchy)
    assert basis.is_constant
    assert not linear.is_constant
    assert basis.mass() is None
    values = np.random.default_rng(0).normal(size=(48, 2))
    np.testing.assert_allclose(basis.points(hierarchy), hierarchy.corners[basis.leaf].mean(axis=1))
    corner = np.tile([0.2, 0.7, 0.1], (48, 1))
    np.testing.assert_allclose(basis.evaluate(values, np.arange(48), corner), values)
    np.testing.assert_allclose(basis.leaf_means(values), values)
    assert basis.from_nodes(values) is values
