"""The matrix methods against closed forms, published values and orders of convergence."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from radiosity_addon.base.errors import UsageError
from radiosity_addon.form_factors.formulas import point_to_polygon
from radiosity_addon.solver import EnvironmentLight, Scene, SolverSettings
from radiosity_addon.solver.equations.linear_basis import INWARD
from radiosity_addon.solver.methods import solve_by_method
from radiosity_addon.solver.methods.dense import dense
from radiosity_addon.solver.methods.matrix import MatrixState
from tests.cornell import cornell_box
from tests.published import (
    CIE_5_6_CEILING_PERCENT,
    CIE_5_6_WALL_PERCENT,
    CIE_5_8_INDIRECT_LX,
    CUBE_WITH_EMITTING_CEILING,
    cie_5_6,
    cie_5_8,
    cie_5_8_indirect,
    parallel_plates,
    shining_cube,
)
from tests.rooms import CEILING, FLOOR, WALLS, area_mean, box_room, gray, gray_scene, rectangle, sphere
from tests.systems import assembled

ASSEMBLIES = ("galerkin", "collocation", "linear")
MATRIX_METHODS = ("dense", "jacobi", "gauss-seidel", "conjugate-gradient")

# Galerkin solutions with exact form factors on n = 4 … 20 grids, extrapolated; ρ = 0.5.
CUBE_OF_SIX_ELEMENTS_FLOOR = 0.181746


def solved(scene: Scene, method: str = "dense", **settings: object) -> MatrixState:
    """Run a matrix method and return its last state."""
    state = solve_by_method(scene, SolverSettings(**{"method": method, "elements": 96, **settings}))
    assert isinstance(state, MatrixState)
    return state


def cube_errors(state: MatrixState) -> np.ndarray:
    """Errors of the mean radiosities of floor, ceiling and the four walls together."""
    wall = np.minimum(box_room()[1], WALLS)
    faces = state.hierarchy.area[:12]
    return np.array(
        [
            area_mean(state.radiosity[:12][wall == s], faces[wall == s])[0] - exact
            for s, exact in CUBE_WITH_EMITTING_CEILING.items()
        ]
    )


# --- enclosures -------------------------------------------------------------------------------


@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.9])
@pytest.mark.parametrize(
    ("assembly", "within"), [("galerkin", 1e-4), ("collocation", 1e-11), ("linear", 1e-11)]
)
@pytest.mark.parametrize("shape", ["cube", "long", "sphere"])
def test_uniform_enclosure(shape: str, assembly: str, within: float, reflectance: float) -> None:
    """All surfaces emit 2 and reflect ρ: B = 2 / (1 − ρ) at every unknown.

    As exact as ΣF = 1 is: to rounding for Lambert's formula at points; the area averages of
    touching elements have an error of some 1e-5, which bounces 1 / (1 − ρ) times.
    """
    triangles = {"cube": box_room()[0], "long": box_room((1, 3, 0.5))[0], "sphere": sphere(1)}[shape]
    scene = gray_scene(triangles, reflectance, 2.0)
    state = solved(scene, assembly=assembly, elements=4 * len(triangles))
    np.testing.assert_allclose(state.values, 2.0 / (1.0 - reflectance), rtol=within)
    np.testing.assert_allclose(state.radiosity, 2.0 / (1.0 - reflectance), rtol=within)
    np.testing.assert_allclose(state.irradiance, 2.0 / (1.0 - reflectance), rtol=within)
    np.testing.assert_allclose(state.closure(), 1.0, rtol=within)


def test_six_elements_of_a_cube() -> None:
    """One constant a wall: F to the opposite 0.1998, to the others 0.2000; the floor's B is 0.181746.

    From the Galerkin factors of two triangles a wall, averaged to squares.
    """
    scene, surface = shining_cube(), box_room()[1]
    wall = np.zeros((6, 12))
    wall[surface, np.arange(12)] = 0.5
    factors = wall @ assembled(scene, 12, "galerkin")[2].transport @ wall.T * 2.0
    assert factors[FLOOR, CEILING] == pytest.approx(0.1998248957, abs=3e-5)
    np.testing.assert_allclose(factors[FLOOR, WALLS:], 0.2000437761, atol=3e-5)
    radiosity = np.linalg.solve(np.eye(6) - 0.5 * factors, np.eye(6)[CEILING])
    assert radiosity[FLOOR] == pytest.approx(CUBE_OF_SIX_ELEMENTS_FLOOR, rel=1e-4)


@pytest.mark.parametrize(
    ("assembly", "order", "largest"),
    [("galerkin", 1.6, 4e-4), ("collocation", 1.4, 8e-4), ("linear", 1.2, 1.4e-3)],
)
def test_cube_converges_to_the_reference(assembly: str, order: float, largest: float) -> None:
    """Means of the walls of a cube with a shining ceiling: errors fall with h^order.

    Order 2 were the solution smooth; beside the ceiling's edges it is not, and collocation asks
    there. The orders are those observed.
    """
    coarse, fine = (
        np.abs(cube_errors(solved(shining_cube(), assembly=assembly, elements=count))).max()
        for count in (48, 768)
    )
    assert np.log(coarse / fine) / np.log(4.0) == pytest.approx(order, abs=0.15)
    assert fine < largest


@pytest.mark.parametrize("method", MATRIX_METHODS)
def test_power_is_conserved_in_the_cube(method: str) -> None:
    """Emitted = absorbed: (1 − ρ) Σ A H = 1 W, to the closure of the form factors."""
    state = solved(shining_cube(), method, tolerance=1e-9)
    leaves = state.hierarchy.leaves
    absorbed = 0.5 * float(state.hierarchy.area[leaves] @ state.irradiance[leaves, 0])
    assert absorbed == pytest.approx(1.0, abs=2e-4)


@pytest.mark.parametrize("assembly", ASSEMBLIES)
def test_surfaces_in_one_another_make_no_light(assembly: str) -> None:
    """A closed room modeled twice, in the same place, is lit as if it were there once.

    ΣFV would be 2 and, with ρ = 0.8, every bounce brighter than the one before. The copies are covered:
    they send nothing, and receive what their covers do.
    """
    room, _ = box_room()
    twice = gray_scene(np.concatenate([room, room]), 0.8, 2.0)
    state = solved(twice, "jacobi", assembly=assembly, tolerance=1e-9)
    covered = state.hierarchy.face >= len(room)
    np.testing.assert_allclose(state.radiosity[~covered], 2.0 / (1.0 - 0.8), rtol=1e-4)
    np.testing.assert_array_equal(state.radiosity[covered], 0.0)
    np.testing.assert_allclose(state.irradiance, 2.0 / (1.0 - 0.8), rtol=1e-4)
    details = state.details["matrix"]
    assert details["overlapping"] == 0
    # Of Jacobi's iteration, in which a mass matrix takes part.
    expected = 0.8 if assembly != "linear" else 1.0 - 0.2 / (1.0 - 2.0 * INWARD / 3.0)
    assert details["spectral_radius"] == pytest.approx(expected, rel=1e-4)
    once = gray_scene(room, 0.8, 2.0)
    assert solved(once, "jacobi", assembly=assembly).details["matrix"]["overlapping"] == 0


# --- published cases --------------------------------------------------------------------------


@pytest.mark.parametrize("reflectance", CIE_5_8_INDIRECT_LX)
@pytest.mark.parametrize(
    ("assembly", "elements", "within"),
    [("galerkin", 192, 0.005), ("collocation", 192, 0.015), ("linear", 768, 0.06)],
)
def test_cie_171_5_8(assembly: str, elements: int, within: float, reflectance: float) -> None:
    """Collocation does not conserve power exactly, and hats cut off the tops of what they follow."""
    state = solved(cie_5_8(reflectance), assembly=assembly, elements=elements)
    indirect = cie_5_8_indirect(state.irradiance[:12], state.hierarchy.area[:12])
    np.testing.assert_allclose(indirect, CIE_5_8_INDIRECT_LX[reflectance], rtol=within)


def test_cie_171_5_6() -> None:
    """Linear elements at the standard's points.

    Black walls only receive: collocation makes the value at a node exact.
    """
    hierarchy, basis, system = assembled(cie_5_6(), 768, "linear")
    points, normals = basis.points(hierarchy), hierarchy.faces.normal[basis.faces(hierarchy)]
    floor = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], dtype=float)
    exact = 100.0 * point_to_polygon(points, normals, np.repeat(floor[None], len(points), axis=0))
    irradiance = system.gather(dense(system))[:, 0]
    np.testing.assert_allclose(irradiance, exact, atol=1e-9)
    values = basis.from_nodes(irradiance[:, None])
    centroid = hierarchy.corners[basis.leaf].mean(axis=1)
    for place, percent in (
        *(((2.0, 0.0, z), p) for z, p in CIE_5_6_WALL_PERCENT.items()),
        *(((2.0, y, 3.0), p) for y, p in CIE_5_6_CEILING_PERCENT.items()),
    ):
        row = _leaf_under(hierarchy.corners[basis.leaf], np.asarray(place))
        weights = np.linalg.lstsq(
            np.vstack([hierarchy.corners[basis.leaf[row]].T, np.ones(3)]), np.append(place, 1.0), rcond=None
        )[0]
        assert np.linalg.norm(centroid[row] - place) < 1.0
        found = basis.evaluate(values, np.array([row]), weights[None])[0, 0]
        assert found == pytest.approx(percent, rel=0.01)


def _leaf_under(corners: np.ndarray, point: np.ndarray) -> int:
    """Return the first of (l, 3, 3) triangles that holds a point."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    whole = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    parts = sum(np.linalg.norm(np.cross(p - point, q - point), axis=1) for p, q in ((a, b), (b, c), (c, a)))
    return int(np.argmin(np.abs(parts - whole) > 1e-9))


@pytest.mark.parametrize("assembly", ASSEMBLIES)
def test_parallel_plates(assembly: str) -> None:
    state = solved(parallel_plates(), assembly=assembly, elements=16)
    inner = 0.03 if assembly == "linear" else 0.01  # hats reach to the open rim
    np.testing.assert_allclose(state.radiosity[:2], 4 / 3, rtol=inner)
    np.testing.assert_allclose(state.radiosity[2:4], 2 / 3, rtol=inner)


def test_a_plate_under_a_sky() -> None:
    """H = πL in the open, whatever the assembly."""
    plate = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    scene = gray_scene(plate, lights=[EnvironmentLight(2.0)])
    for assembly in ASSEMBLIES:
        state = solved(scene, assembly=assembly, elements=32)
        np.testing.assert_allclose(state.irradiance, 2.0 * np.pi, rtol=1e-7)
        np.testing.assert_allclose(state.radiosity, np.pi, rtol=1e-7)


# --- bases ------------------------------------------------------------------------------------


def facing_plates() -> Scene:
    """A square that shines and is black, and one that only reflects, 1 above it."""
    below = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    above = rectangle((0, 0, 1), (0, 1, 0), (1, 0, 0))
    emission = np.concatenate([gray(2, 1.0), gray(2, 0.0)])
    return Scene(np.concatenate([below, above]), np.concatenate([gray(2, 0.0), gray(2, 0.5)]), emission)


@cache
def rms_error(assembly: str, elements: int) -> float:
    """Of B̂ on the upper square at 20 000 points, against 0.5 · Lambert's factor."""
    hierarchy, basis, system = assembled(facing_plates(), elements, assembly)
    values = dense(system)[:, :1]
    above = np.flatnonzero(hierarchy.face[basis.leaf] >= 2)
    rng = np.random.default_rng(1)
    rows = np.repeat(above, 20_000 // len(above))
    barycentric = rng.dirichlet((1, 1, 1), len(rows))
    points = np.einsum("nc,nck->nk", barycentric, hierarchy.corners[basis.leaf[rows]])
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    count = len(points)
    factor = point_to_polygon(points, np.tile([0, 0, -1.0], (count, 1)), np.tile(square, (count, 1, 1)))
    return float(np.sqrt(np.mean((basis.evaluate(values, rows, barycentric)[:, 0] - 0.5 * factor) ** 2)))


def test_linear_elements_converge_an_order_faster() -> None:
    """Where radiosity is smooth: constants with h, hats with h², and far better at equal size."""
    for assembly, order in (("galerkin", 1.0), ("collocation", 1.0), ("linear", 2.0)):
        coarse, fine = rms_error(assembly, 64), rms_error(assembly, 256)
        assert np.log2(coarse / fine) == pytest.approx(order, abs=0.12), assembly
    assert rms_error("linear", 256) < 0.21 * min(rms_error("collocation", 256), rms_error("galerkin", 256))


@pytest.mark.parametrize("assembly", ["collocation", "linear"])
def test_the_residual_vanishes_at_the_nodes(assembly: str) -> None:
    """r(x_i) = B̂(x_i) − E − ρ ∫ B̂ κ dA' = 0 (3.9), each part asked anew at the node."""
    scene = shining_cube()
    hierarchy, basis, system = assembled(scene, 96, assembly)
    values = dense(system)
    at_nodes = basis.evaluate(values, basis.home, basis.place)
    face = basis.faces(hierarchy)
    points, normals = basis.points(hierarchy), hierarchy.faces.normal[face]
    irradiance = np.zeros((len(basis), 3))
    for row, leaf in enumerate(basis.leaf):
        corners = np.repeat(hierarchy.corners[leaf][None], len(basis), axis=0)
        if assembly == "collocation":
            factors = point_to_polygon(points, normals, corners)
            irradiance += factors[:, None] * values[row]
        else:
            # Hats by many small parts, each at its centroid: near what the assembly does.
            irradiance += _by_parts(points, normals, corners, values[basis.corner[row]])
    residual = at_nodes - hierarchy.faces.emission[face] - hierarchy.faces.reflectance[face] * irradiance
    np.testing.assert_allclose(residual, 0.0, atol=1e-12 if assembly == "collocation" else 1e-4)


def _by_parts(points: np.ndarray, normals: np.ndarray, corners: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Irradiance from a triangle whose radiosity is linear between its corners, in 256 parts."""
    n = 16
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    up, down = i + j < n, i + j < n - 1
    lower = np.stack([np.stack([i, j], -1), np.stack([i + 1, j], -1), np.stack([i, j + 1], -1)], 1)[up]
    upper = np.stack([np.stack([i + 1, j + 1], -1), np.stack([i, j + 1], -1), np.stack([i + 1, j], -1)], 1)
    inner = np.concatenate([lower, upper[down]]) / n
    weights = np.concatenate([1.0 - inner.sum(axis=-1, keepdims=True), inner], axis=-1)
    parts = weights @ corners[0]
    many = len(parts)
    factors = point_to_polygon(
        np.repeat(points, many, axis=0), np.repeat(normals, many, axis=0), np.tile(parts, (len(points), 1, 1))
    )
    return np.asarray(factors.reshape(-1, many) @ (weights.mean(axis=1) @ ends))


def test_a_linear_function_is_its_own_interpolant() -> None:
    """Unknowns fitted to a linear function's values at the nodes give it back everywhere."""
    hierarchy, basis, _ = assembled(facing_plates(), 64, "linear")
    slope = np.array([[1.0], [2.0], [-3.0]])
    values = basis.from_nodes(basis.points(hierarchy) @ slope)
    rng = np.random.default_rng(0)
    rows = rng.integers(0, len(basis.leaf), 500)
    barycentric = rng.dirichlet((1, 1, 1), 500)
    points = np.einsum("nc,nck->nk", barycentric, hierarchy.corners[basis.leaf[rows]])
    np.testing.assert_allclose(basis.evaluate(values, rows, barycentric), points @ slope, atol=1e-12)
    mass = basis.mass()
    assert mass is not None
    np.testing.assert_allclose(mass @ values, basis.points(hierarchy) @ slope, atol=1e-12)


# --- through the front ------------------------------------------------------------------------


def test_the_methods_agree_on_the_same_elements() -> None:
    """In the Cornell box, blocks and all, to 1e-6 of the brightest."""
    states = [solved(cornell_box(), method, elements=300, tolerance=1e-9) for method in MATRIX_METHODS]
    truth = states[0]
    for state in states:
        np.testing.assert_allclose(state.radiosity, truth.radiosity, atol=1e-6 * truth.radiosity.max())
        np.testing.assert_allclose(state.irradiance, truth.irradiance, atol=1e-6 * truth.irradiance.max())
        assert state.residual < 1e-9
        assert state.details["matrix"]["asymmetry"] == 0.0
        assert state.details["matrix"]["converged"]
        assert state.n_links == truth.n_links > 0


@pytest.mark.parametrize("method", ["jacobi", "gauss-seidel", "conjugate-gradient"])
def test_the_history_reports_every_iteration(method: str) -> None:
    state = solved(cornell_box(), method, elements=100, tolerance=1e-5)
    assert [entry.iteration for entry in state.history] == list(range(state.iterations + 1))
    residuals = np.array([entry.residual for entry in state.history])
    assert residuals[-1] == state.residual < 1e-5
    assert (residuals[:-1] >= 1e-5 / 2).all()
    if method != "conjugate-gradient":  # which is monotone in another norm
        assert (np.diff(residuals) < 0).all()


def test_what_ends_at_its_limit_has_not_converged() -> None:
    assert not solved(cornell_box(), "jacobi", max_iterations=3, tolerance=1e-9).details["matrix"][
        "converged"
    ]


@pytest.mark.parametrize("assembly", ["collocation", "linear"])
def test_conjugate_gradients_refuse_other_assemblies(assembly: str) -> None:
    with pytest.raises(UsageError, match=rf"{assembly} assembly.*galerkin.*jacobi or gauss-seidel"):
        solved(cornell_box(), "conjugate-gradient", assembly=assembly)


@pytest.mark.parametrize("method", MATRIX_METHODS)
def test_too_large_a_system_is_refused_before_it_is_made(method: str) -> None:
    """A million elements would take terabytes; nothing of them is allocated."""
    with pytest.raises(
        UsageError,
        match=rf"{method} with 1000000 unknowns needs .* GiB.*limit of 4 GiB.*hierarchical, or shooting",
    ):
        solved(cornell_box(), method, elements=1_000_000)


def test_the_memory_limit_counts_faces_and_is_exact() -> None:
    """More faces than elements asked for: 108 faces, dense holds three matrices."""
    triangles, _ = box_room(n=3)
    scene = gray_scene(triangles, 0.5, 1.0)
    needed = 3 * 8 * 108**2 / 2**30
    assert solved(scene, elements=1, memory_limit=needed).details["matrix"]["memory_GiB"] == needed
    with pytest.raises(UsageError, match=r"108 unknowns.* GiB.*hierarchical"):
        solved(scene, elements=1, memory_limit=0.999 * needed)
    with pytest.raises(UsageError, match="use fewer elements"):
        solved(scene, elements=432, memory_limit=needed)


@pytest.mark.parametrize("assembly", ASSEMBLIES)
def test_threads_change_nothing(assembly: str) -> None:
    one, two = (solved(cornell_box(), assembly=assembly, threads=threads) for threads in (1, 2))
    assert one.radiosity.tobytes() == two.radiosity.tobytes()


def test_colors_do_not_mix() -> None:
    """Each channel is a system of its own."""
    state = solved(cornell_box(), elements=64)
    scene = cornell_box()
    for channel in range(3):
        alone = Scene(
            scene.triangles,
            np.repeat(scene.reflectance[:, channel, None], 3, axis=1),
            np.repeat(scene.emission[:, channel, None], 3, axis=1),
        )
        gray_state = solved(alone, elements=64)
        np.testing.assert_allclose(gray_state.radiosity[:, 0], state.radiosity[:, channel], rtol=1e-9)
