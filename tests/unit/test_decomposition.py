"""Independent sets: the parts of a scene that do not see each other."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver import Scene, SolverSettings
from radiosity_addon.solver.equations.decomposition import describe_sets, independent_sets
from radiosity_addon.solver.equations.linear_system import LinearSystem
from radiosity_addon.solver.methods import solve_by_method
from radiosity_addon.solver.methods.dense import dense
from radiosity_addon.solver.methods.jacobi import jacobi
from radiosity_addon.solver.methods.matrix import MatrixState
from tests.rooms import CEILING, box_room, gray, gray_scene, rectangle
from tests.systems import cornell_system, cube_system, iterate, side_by_side


def bare(exchange: np.ndarray, mass: np.ndarray | None = None, reciprocal: bool = False) -> LinearSystem:
    count = len(exchange)
    return LinearSystem(
        exchange, np.full((count, 3), 0.5), np.ones((count, 3)), np.ones(count), mass, reciprocal
    )


def as_lists(sets: list[np.ndarray]) -> list[list[int]]:
    return [rows.tolist() for rows in sets]


def test_a_chain_is_one_set_and_what_sees_nothing_is_alone() -> None:
    exchange = np.zeros((7, 7))
    for i, j in [(0, 2), (2, 4), (4, 6), (1, 5)]:
        exchange[i, j] = exchange[j, i] = 0.1
    sets, alone = independent_sets(bare(exchange, reciprocal=True))
    assert as_lists(sets) == [[0, 2, 4, 6], [1, 5]]
    assert alone.tolist() == [3]


def test_one_direction_is_enough() -> None:
    """Collocation may see an element's edge from a point, but not the point's element from there."""
    exchange = np.zeros((4, 4))
    exchange[3, 0] = 0.1
    exchange[1, 2] = 0.1
    sets, alone = independent_sets(bare(exchange))
    assert as_lists(sets) == [[0, 3], [1, 2]]
    assert len(alone) == 0


def test_a_shared_hat_joins_what_sees_nothing() -> None:
    mass = np.eye(3)
    mass[0, 2] = 0.1
    sets, alone = independent_sets(bare(np.zeros((3, 3)), mass))
    assert as_lists(sets) == [[0, 2]]
    assert alone.tolist() == [1]


def test_many_elements_are_all_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the chunks of rows: 40 rings of 5, shuffled."""
    monkeypatch.setattr("radiosity_addon.solver.equations.decomposition.CHUNK_ROWS", 3)
    order = np.random.default_rng(0).permutation(200)
    exchange = np.zeros((200, 200))
    for ring in order.reshape(40, 5):
        exchange[ring, np.roll(ring, 1)] = exchange[np.roll(ring, 1), ring] = 1.0
    sets, alone = independent_sets(bare(exchange, reciprocal=True))
    assert sorted(as_lists(sets)) == sorted(sorted(ring.tolist()) for ring in order.reshape(40, 5))
    assert len(alone) == 0


def test_blocks_alone_solve_the_whole() -> None:
    """K is block diagonal: the sets' own solutions are the solution, to 1e-12."""
    both = side_by_side(cube_system(), cornell_system())
    sets, alone = independent_sets(both)
    assert sorted(len(rows) for rows in sets) == sorted([len(cube_system()), len(cornell_system())])
    assert len(alone) == 0
    together = dense(both)
    for rows in sets:
        np.testing.assert_allclose(dense(both.take(rows)), together[rows], rtol=1e-12, atol=1e-12)
        apart, _ = iterate(jacobi(both.take(rows)), 20)
        whole, _ = iterate(jacobi(both), 20)
        np.testing.assert_allclose(apart, whole[rows], rtol=1e-12, atol=1e-12)


def test_description_names_the_largest_first() -> None:
    sets = [np.array([0, 1]), np.array([2, 3, 4])]
    area = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 9.0])
    triangle = np.array([7, 7, 5, 6, 5, 1])
    assert describe_sets(sets, area, np.arange(6), triangle) == [
        {"elements": 3, "area_m2": 12.0, "triangles": [5, 6]},
        {"elements": 2, "area_m2": 3.0, "triangles": [7]},
    ]


# --- in scenes --------------------------------------------------------------------------------


def two_rooms() -> tuple[np.ndarray, np.ndarray]:
    """Two closed boxes with a gap between them, and which room each triangle belongs to."""
    one, _ = box_room((2, 2, 2))
    other, _ = box_room((1, 1, 1))
    triangles = np.concatenate([one, other + np.array([3.0, 0, 0])])
    return triangles, np.repeat([0, 1], 12)


def solve(scene: Scene, **settings: object) -> MatrixState:
    state = solve_by_method(scene, SolverSettings(**{"method": "dense", "elements": 120, **settings}))
    assert isinstance(state, MatrixState)
    return state


@pytest.mark.parametrize("assembly", ["galerkin", "collocation", "linear"])
def test_rooms_are_reported_as_blocks(assembly: str) -> None:
    triangles, room = two_rooms()
    emission = gray(24, 0.0)
    emission[2:4] = 1.0
    emission[14:16] = 3.0
    state = solve(gray_scene(triangles, 0.5, emission), assembly=assembly)
    blocks = state.details["independent_sets"]
    assert [block["area_m2"] for block in blocks] == pytest.approx([24.0, 6.0])
    assert sum(block["elements"] for block in blocks) == len(state.hierarchy.leaves)
    for number, block in enumerate(blocks):
        assert set(block["triangles"]) <= set(np.flatnonzero(room == number).tolist())
    assert state.details["matrix"]["blocks"] == 2
    assert state.details["matrix"]["alone"] == 0


@pytest.mark.parametrize("method", ["dense", "jacobi", "gauss-seidel", "conjugate-gradient"])
def test_rooms_together_are_what_they_are_apart(method: str) -> None:
    """The same elements solved in one scene and in two, to 1e-12."""
    triangles, room = two_rooms()
    emission = gray(24, 0.0)
    emission[2:4], emission[14:16] = 1.0, 3.0
    options = {"method": method, "tolerance": 1e-14}
    # Both rooms down to triangles of one size: 192 and 48 of them.
    together = solve(gray_scene(triangles, 0.7, emission), elements=240, **options)
    for number, elements in ((0, 192), (1, 48)):
        rows = room == number
        apart = solve(gray_scene(triangles[rows], 0.7, emission[rows]), elements=elements, **options)
        assert len(apart.values) == elements
        np.testing.assert_allclose(apart.radiosity[:12], together.radiosity[:24][rows], rtol=1e-12)
        np.testing.assert_allclose(apart.irradiance[:12], together.irradiance[:24][rows], rtol=1e-12)
    assert together.details["matrix"]["converged"]


def test_the_outside_of_walls_is_alone() -> None:
    """Backs that see nothing are no block: B is what a lamp gives them, here nothing."""
    triangles, surface = box_room()
    emission = gray(12, 0.0)
    emission[surface == CEILING] = 1.0
    scene = gray_scene(triangles, 0.5, emission, two_sided=True)
    state = solve(scene, elements=96)
    assert state.details["matrix"]["blocks"] == 1
    assert state.details["matrix"]["alone"] == 48
    backs = ~state.hierarchy.faces.front
    np.testing.assert_array_equal(state.radiosity[:24][backs], state.hierarchy.faces.emission[backs])
    assert (state.irradiance[:24][backs] == 0).all()


def test_a_plate_by_itself_has_no_block() -> None:
    plate = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    state = solve(gray_scene(plate, 0.5, 1.0), elements=32, method="jacobi")
    assert state.details["independent_sets"] == []
    assert state.details["matrix"]["converged"]
    assert state.residual == 0.0
    np.testing.assert_array_equal(state.radiosity, 1.0)


@pytest.mark.parametrize("assembly", ["galerkin", "collocation"])
def test_a_thin_wall_parts_two_rooms(assembly: str) -> None:
    """One room cut in two by a single two-sided plane: no ray finds a way around its edges."""
    room, _ = box_room((2, 1, 1), n=2)
    wall = rectangle((1, 0, 0), (0, 1, 0), (0, 0, 1))
    triangles = np.concatenate([room, wall])
    left = triangles.mean(axis=1)[:, 0] < 1.0
    emission = gray(len(triangles), 0.0)
    emission[0] = 1.0
    scene = gray_scene(triangles, 0.5, emission, two_sided=True)
    state = solve(scene, elements=500, assembly=assembly)
    blocks = state.details["independent_sets"]
    # Two cubes of six walls each; the room's outside sees nothing.
    assert [block["area_m2"] for block in blocks] == pytest.approx([6.0, 6.0])
    dark = state.hierarchy.faces.triangle[state.radiosity[: len(state.hierarchy.faces), 0] == 0]
    lit_room = left if left[0] else ~left
    rooms_of_wall = np.arange(len(triangles)) >= len(room)
    assert set(np.flatnonzero(~lit_room & ~rooms_of_wall)) <= set(dark.tolist())
