"""The linear system K B = E: its parts, and the solvers that must agree on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError, UsageError
from radiosity_addon.solver.equations.linear_system import LinearSystem
from radiosity_addon.solver.equations.matrix_report import extreme_eigenvalues
from radiosity_addon.solver.methods.conjugate_gradient import conjugate_gradient
from radiosity_addon.solver.methods.dense import dense
from radiosity_addon.solver.methods.gauss_seidel import gauss_seidel
from radiosity_addon.solver.methods.jacobi import jacobi
from tests.systems import cornell_system, cube_system, iterate, with_reflectance

ITERATIVE = {"jacobi": jacobi, "gauss-seidel": gauss_seidel, "conjugate-gradient": conjugate_gradient}


def random_system(count: int = 12, mass: bool = False, seed: int = 0) -> LinearSystem:
    """A diagonally dominant system with a full matrix, own form factors F_ii and no symmetry."""
    rng = np.random.default_rng(seed)
    area = rng.uniform(0.5, 2.0, count)
    transport = rng.uniform(0.0, 1.0, (count, count))
    transport /= transport.sum(axis=1, keepdims=True)
    matrix = None
    if mass:
        matrix = np.eye(count) + rng.uniform(0.0, 0.3 / count, (count, count))
    reflectance, emission = rng.uniform(0.0, 0.6, (count, 3)), rng.uniform(0.0, 1.0, (count, 3))
    return LinearSystem(transport * area[:, None], reflectance, emission, area, matrix)


# --- the system's parts -----------------------------------------------------------------------


@pytest.mark.parametrize("mass", [False, True])
def test_the_parts_agree_with_the_matrix(mass: bool) -> None:
    """K = M − P F: residual, diagonal, gather and matrix say the same, channel by channel."""
    system = random_system(mass=mass)
    radiosity = np.random.default_rng(1).normal(size=(len(system), 3))
    weights = np.eye(len(system)) if system.mass is None else system.mass
    residual = system.residual(radiosity)
    for channel in range(3):
        matrix = weights - np.diag(system.reflectance[:, channel]) @ system.transport
        np.testing.assert_allclose(system.matrix(channel), matrix, atol=1e-15)
        np.testing.assert_allclose(system.diagonal()[:, channel], np.diagonal(matrix), atol=1e-15)
        expected = system.emission[:, channel] - matrix @ radiosity[:, channel]
        np.testing.assert_allclose(residual[:, channel], expected, atol=1e-13)
    np.testing.assert_allclose(system.gather(radiosity), system.transport @ radiosity, atol=1e-14)
    np.testing.assert_allclose(system.residual_power(radiosity), system.area @ np.abs(residual), rtol=1e-13)


def test_taking_rows_leaves_out_the_others_light() -> None:
    system = random_system(mass=True)
    rows = np.array([7, 2, 5])
    part = system.take(rows)
    assert system.mass is not None
    np.testing.assert_array_equal(part.matrix(1), system.matrix(1)[np.ix_(rows, rows)])
    np.testing.assert_array_equal(part.emission, system.emission[rows])
    assert system.take(np.arange(len(system))) is system


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match="reflectance has shape"):
        LinearSystem(np.eye(2), np.zeros(2), np.zeros((2, 3)), np.ones(2))
    with pytest.raises(ValueError, match="mass has shape"):
        LinearSystem(np.eye(2), np.zeros((2, 3)), np.zeros((2, 3)), np.ones(2), np.eye(3))


# --- the solvers agree ------------------------------------------------------------------------


def test_dense_solves_each_channel() -> None:
    """Channels of equal and of different reflectance alike, to rounding."""
    system = cornell_system()
    for case in (system, with_reflectance(system, 0.7)):
        radiosity = dense(case)
        assert case.residual_power(radiosity).max() < 1e-13 * float((case.area @ case.emission).max())
    swapped = replace(system, reflectance=system.reflectance[:, ::-1], emission=system.emission[:, ::-1])
    np.testing.assert_allclose(dense(swapped)[:, ::-1], dense(system), rtol=1e-12)


@pytest.mark.parametrize("name", ITERATIVE)
def test_iterations_agree_with_dense_in_the_cornell_box(name: str) -> None:
    """On the same elements of a box with two blocks, to 1e-6 of the brightest; here to 1e-11."""
    system = cornell_system()
    truth = dense(system)
    radiosity, residuals = iterate(ITERATIVE[name](system), 100)
    np.testing.assert_allclose(radiosity, truth, rtol=1e-9, atol=1e-11 * truth.max())
    assert residuals[-1].max() < 1e-10 * residuals[0].max()


@pytest.mark.parametrize("method", [jacobi, gauss_seidel])
@pytest.mark.parametrize("assembly", ["collocation", "linear"])
def test_iterations_agree_with_dense_for_other_assemblies(method: Callable, assembly: str) -> None:
    system = cornell_system(assembly)
    radiosity, _ = iterate(method(system), 100)
    np.testing.assert_allclose(radiosity, dense(system), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("mass", [False, True])
@pytest.mark.parametrize("method", [jacobi, gauss_seidel])
def test_the_diagonal_divides_emission_too(method: Callable, mass: bool) -> None:
    """K_ii ≠ 1, which (3.35) as printed does not survive."""
    system = random_system(mass=mass)
    assert np.abs(system.diagonal() - 1.0).max() > 0.03
    radiosity, _ = iterate(method(system), 200)
    np.testing.assert_allclose(radiosity, dense(system), rtol=1e-12)


@pytest.mark.parametrize("name", ITERATIVE)
def test_residuals_are_those_of_the_iterates(name: str) -> None:
    """What is yielded beside B is Σ A |E − K B| of that B, from iteration 0 on."""
    system = cornell_system()
    scale = float((system.area @ system.emission).max())
    for number, (radiosity, residual) in enumerate(ITERATIVE[name](system)):
        np.testing.assert_allclose(residual, system.residual_power(radiosity), atol=1e-13 * scale)
        if number == 0:
            np.testing.assert_array_equal(radiosity, system.emission)
        if number == 20:
            break


@pytest.mark.parametrize("name", ITERATIVE)
def test_iterates_are_not_overwritten(name: str) -> None:
    iterates = ITERATIVE[name](cornell_system())
    first, _ = next(iterates)
    copy = first.copy()
    for _ in range(3):
        next(iterates)
    np.testing.assert_array_equal(first, copy)


@pytest.mark.parametrize("name", ITERATIVE)
def test_starting_from_the_solution_stays_there(name: str) -> None:
    system = cornell_system()
    truth = dense(system)
    radiosity, residuals = iterate(ITERATIVE[name](system, truth), 3)
    assert residuals.max() < 1e-12 * float((system.area @ system.emission).max())
    np.testing.assert_allclose(radiosity, truth, rtol=1e-12)


@pytest.mark.parametrize("name", ITERATIVE)
def test_black_rows_keep_their_emission(name: str) -> None:
    """Rows with ρ = 0: B = E exactly, and they still light the others."""
    system = cornell_system()
    reflectance = system.reflectance.copy()
    reflectance[::3] = 0.0
    reflectance[::5, 1] = 0.0
    system = replace(system, reflectance=reflectance)
    radiosity, _ = iterate(ITERATIVE[name](system), 60)
    black = reflectance == 0
    np.testing.assert_array_equal(radiosity[black], system.emission[black])
    np.testing.assert_allclose(radiosity, dense(system), rtol=1e-9, atol=1e-11)


def test_all_black_is_emission() -> None:
    system = with_reflectance(cornell_system(), 0.0)
    for method in ITERATIVE.values():
        radiosity, residuals = iterate(method(system), 5)
        np.testing.assert_array_equal(radiosity, system.emission)
        assert not residuals.any()


# --- how fast they are ------------------------------------------------------------------------


def test_jacobi_gathers_one_bounce_an_iteration() -> None:
    """From B = E iterate k is Σ_{b ≤ k} (P F)^b E, the light of k bounces."""
    system = cornell_system()
    bounce = system.emission
    total = bounce.copy()
    for radiosity, _ in jacobi(system):
        np.testing.assert_allclose(radiosity, total, rtol=1e-12, atol=1e-12)
        bounce = system.reflectance * (system.transport @ bounce)
        total = total + bounce
        if bounce.max() < 1e-6:
            break


def test_jacobi_converges_by_the_spectral_radius() -> None:
    """Late residuals fall by the spectral radius, an iteration each, in every channel."""
    system = cornell_system()
    _, residuals = iterate(jacobi(system), 25)
    _, radius = extreme_eigenvalues(system)
    np.testing.assert_allclose(residuals[25] / residuals[24], radius, rtol=1e-3)


@pytest.mark.parametrize("reflectance", [0.3, 0.6, 0.9])
def test_gauss_seidel_beats_jacobi(reflectance: float) -> None:
    """Never slower (Stein and Rosenberg 1948); in a room about twice as fast in the end.

    The square of the radius is exact for consistently ordered matrices only, which this is not.
    """
    system = with_reflectance(cube_system(), reflectance)
    _, slow = iterate(jacobi(system), 16)
    _, fast = iterate(gauss_seidel(system), 12)
    rate_jacobi = (slow[16] / slow[12])[0] ** 0.25
    rate_gauss_seidel = (fast[12] / fast[8])[0] ** 0.25
    assert rate_jacobi == pytest.approx(reflectance, rel=1e-3)
    assert 1.7 < np.log(rate_gauss_seidel) / np.log(rate_jacobi) < 2.1
    assert (fast[1:] < slow[1:13]).all()


def test_gauss_seidel_squares_the_radius_of_two_blocks() -> None:
    """Elements in two groups that see only each other are consistently ordered: radius² exactly."""
    rng = np.random.default_rng(2)
    across = rng.uniform(0.0, 1.0, (8, 8))
    exchange = np.zeros((16, 16))
    exchange[:8, 8:], exchange[8:, :8] = across, across.T
    area = exchange.sum(axis=1)
    emission = rng.uniform(0.0, 1.0, (16, 3))
    system = LinearSystem(exchange, np.full((16, 3), 0.9), emission, area, reciprocal=True)
    _, fast = iterate(gauss_seidel(system), 40)
    np.testing.assert_allclose(fast[40] / fast[39], 0.9**2, rtol=1e-6)


def test_a_sweep_uses_what_it_has_just_computed() -> None:
    """Light that runs down a chain of elements arrives within one sweep, and against it one a sweep."""
    count = 5
    exchange = np.diag(np.ones(count - 1), -1)  # row i gathers from i − 1
    emission = np.zeros((count, 3))
    emission[0] = 1.0
    down = LinearSystem(exchange, np.full((count, 3), 0.5), emission, np.ones(count))
    after_one, _ = iterate(gauss_seidel(down), 1)
    np.testing.assert_allclose(after_one[:, 0], 0.5 ** np.arange(count))
    up = down.take(np.arange(count)[::-1])
    for sweeps in range(1, count):
        reached, _ = iterate(gauss_seidel(up), sweeps)
        assert np.count_nonzero(reached[:, 0]) == sweeps + 1


def test_conjugate_gradients_need_as_many_steps_as_there_are_eigenvalues() -> None:
    """A closed uniform sphere has F of rank one: exact after two steps, whatever ρ and E."""
    rng = np.random.default_rng(3)
    area = rng.uniform(0.1, 1.0, 50)
    exchange = np.outer(area, area) / area.sum()
    reflectance = np.full((50, 3), 0.8)
    system = LinearSystem(exchange, reflectance, rng.uniform(0, 1, (50, 3)), area, reciprocal=True)
    radiosity, residuals = iterate(conjugate_gradient(system), 2)
    np.testing.assert_allclose(radiosity, dense(system), rtol=1e-12)
    assert residuals[2].max() < 1e-12 * residuals[0].max()


def test_conjugate_gradients_beat_gauss_seidel_where_much_is_reflected() -> None:
    system = with_reflectance(cube_system(), 0.95)
    _, conjugate = iterate(conjugate_gradient(system), 40)
    _, relaxed = iterate(gauss_seidel(system), 40)

    def needed(residuals: np.ndarray) -> int:
        return int(np.flatnonzero(residuals[:, 0] < 1e-6 * residuals[0, 0])[0])

    assert needed(conjugate) < 0.5 * needed(np.vstack([relaxed, np.zeros((1, 3))]))


def test_energy_of_the_error_never_rises_in_conjugate_gradients() -> None:
    """In the norm of the symmetric matrix each step is the best of its space (Hestenes and Stiefel)."""
    system = cornell_system()
    truth = dense(system)
    energies = []
    for number, (radiosity, _) in enumerate(conjugate_gradient(system)):
        error = radiosity - truth
        scaled = system.area[:, None] / system.reflectance * error - system.exchange @ error
        energies.append((error * scaled).sum(axis=0))
        if number == 12:
            break
    for before, after in pairwise(energies):
        assert (after < before).all()


# --- what cannot be solved --------------------------------------------------------------------


@pytest.mark.parametrize("assembly", ["collocation", "linear"])
def test_conjugate_gradients_refuse_what_is_not_symmetric(assembly: str) -> None:
    with pytest.raises(UsageError, match=r"reciprocal form factors.*galerkin"):
        conjugate_gradient(cornell_system(assembly))


def test_conjugate_gradients_refuse_one_way_systems() -> None:
    with pytest.raises(UsageError, match="jacobi or gauss-seidel"):
        conjugate_gradient(replace(cornell_system(), reciprocal=False))


def two_mirrors(reflectance: float) -> LinearSystem:
    """Two elements that see nothing but each other."""
    emission = np.full((2, 3), 1.0)
    return LinearSystem(1.0 - np.eye(2), np.full((2, 3), reflectance), emission, np.ones(2), reciprocal=True)


def test_light_that_never_ends_is_refused() -> None:
    """ρ = 1 in a closed room: no solution, which dense says and the residual of others shows."""
    with pytest.raises(BakeError, match=r"singular.*reflectance"):
        dense(two_mirrors(1.0))
    for method in (jacobi, gauss_seidel):
        _, residuals = iterate(method(two_mirrors(1.0)), 50)
        assert residuals[-1].max() >= 0.999 * residuals[1].max() > 0
    np.testing.assert_allclose(dense(two_mirrors(0.99)), 100.0, rtol=1e-12)
