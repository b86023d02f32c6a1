"""Properties of radiosity matrices against closed forms and plain linear algebra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.equations.linear_system import LinearSystem
from radiosity_addon.solver.equations.matrix_report import (
    asymmetry,
    diagonal_dominance,
    extreme_eigenvalues,
    filled_share,
    matrix_properties,
    reciprocity_error,
    symmetric_form,
)
from radiosity_addon.solver.methods.dense import dense
from tests.systems import cornell_system, cube_system, with_reflectance


def eigenvalues(system: LinearSystem, channel: int) -> np.ndarray:
    """Of Jacobi's iteration matrix I − D⁻¹ K, by a full eigenvalue decomposition."""
    matrix = system.matrix(channel)
    return np.linalg.eigvals(np.eye(len(system)) - matrix / np.diagonal(matrix)[:, None])


def test_size_and_fill() -> None:
    """An entry vanishes where ρ_i = 0 or nothing is seen; the diagonal never."""
    system = cube_system()
    assert matrix_properties(system).size == len(system) == 192
    # Every element sees those of the five other walls; 32 are on its own.
    assert filled_share(system) == pytest.approx((1 + 160) / 192)
    black = system.reflectance.copy()
    black[:48] = 0.0
    assert filled_share(replace(system, reflectance=black)) == pytest.approx((0.75 * 161 + 0.25) / 192)
    one_channel = black.copy()
    one_channel[:48, 2] = 0.1
    assert filled_share(replace(system, reflectance=one_channel)) == filled_share(system)


@pytest.mark.parametrize("reflectance", [0.2, 0.5, 0.9])
def test_dominance_is_one_less_reflectance_in_an_enclosure(reflectance: float) -> None:
    """(3.34) in a closed room: Σ_{j≠i} |K_ij| = ρ for every row."""
    assert diagonal_dominance(with_reflectance(cube_system("collocation"), reflectance)) == pytest.approx(
        1.0 - reflectance, abs=1e-12
    )
    # Area-averaged factors of touching elements are right to some 1e-5.
    assert diagonal_dominance(with_reflectance(cube_system(), reflectance)) == pytest.approx(
        1.0 - reflectance, abs=1e-4
    )


def test_dominance_is_the_worst_rows() -> None:
    system = cornell_system("linear")
    worst = min(
        (2 * abs(row[i]) - np.abs(row).sum()) / abs(row[i])
        for channel in range(3)
        for i, row in enumerate(system.matrix(channel))
    )
    assert diagonal_dominance(system) == pytest.approx(worst, abs=1e-13)


@pytest.mark.parametrize("reflectance", [0.2, 0.5, 0.9])
def test_spectral_radius_in_an_enclosure_is_the_reflectance(reflectance: float) -> None:
    """P F 1 = ρ 1 in a closed room of one reflectance."""
    _, high = extreme_eigenvalues(with_reflectance(cube_system("collocation"), reflectance))
    np.testing.assert_allclose(high, reflectance, rtol=1e-12)
    _, high = extreme_eigenvalues(with_reflectance(cube_system(), reflectance))
    np.testing.assert_allclose(high, reflectance, rtol=1e-4)


def test_extreme_eigenvalues_are_those_of_a_full_decomposition() -> None:
    system = cornell_system()
    low, high = extreme_eigenvalues(system)
    for channel in range(3):
        spectrum = eigenvalues(system, channel)
        assert np.abs(spectrum.imag).max() < 1e-12  # similar to a symmetric matrix
        assert high[channel] == pytest.approx(spectrum.real.max(), rel=1e-5)
        assert high[channel] <= spectrum.real.max() + 1e-12  # a Rayleigh quotient
        assert low[channel] == pytest.approx(spectrum.real.min(), rel=0.02)
    assert (high <= system.reflectance.max(axis=0)).all()


@pytest.mark.parametrize("assembly", ["collocation", "linear"])
def test_spectral_radius_of_other_assemblies(assembly: str) -> None:
    """Not similar to symmetric matrices; the largest eigenvalue is found all the same."""
    system = cornell_system(assembly)
    exact = [np.abs(eigenvalues(system, channel)).max() for channel in range(3)]
    assert matrix_properties(system).spectral_radius == pytest.approx(max(exact), rel=0.01)
    assert max(exact) < 1.0


def test_condition_is_that_of_the_scaled_symmetric_matrix() -> None:
    """… and at most (1 + ρ) / (1 − ρ)."""
    system = with_reflectance(cornell_system(), 0.8)
    matrix, _, rows = symmetric_form(system, 0)
    scale = np.sqrt(np.diagonal(matrix))
    exact = float(np.linalg.cond(matrix / scale[:, None] / scale))
    found = matrix_properties(system).condition
    assert found == pytest.approx(exact, rel=0.02)
    assert found <= 1.8 / 0.2
    assert len(rows) == len(system)


def test_the_symmetric_form_has_the_same_solution() -> None:
    """(A/ρ − A F) B = A E/ρ, black rows moved to the right side."""
    system = cornell_system()
    reflectance = system.reflectance.copy()
    reflectance[::4] = 0.0
    system = replace(system, reflectance=reflectance)
    truth = dense(system)
    for channel in range(3):
        matrix, right_side, rows = symmetric_form(system, channel)
        assert (matrix == matrix.T).all()
        np.testing.assert_array_equal(rows, np.flatnonzero(reflectance[:, channel] > 0))
        np.testing.assert_allclose(np.linalg.solve(matrix, right_side), truth[rows, channel], rtol=1e-10)
        np.linalg.cholesky(matrix)  # positive definite
        assert matrix_properties(system).symmetrised == len(rows) < len(system)


def test_scaling_by_area_alone_is_not_enough() -> None:
    """The handout's slip: A K is symmetric for uniform ρ only."""
    system = cornell_system()
    assert asymmetry(system.area[:, None] * system.matrix(0)) > 0.01
    uniform = with_reflectance(system, 0.5)
    assert asymmetry(uniform.area[:, None] * uniform.matrix(0)) < 1e-14


def test_the_symmetric_form_needs_constant_elements() -> None:
    with pytest.raises(ValueError, match="constant elements"):
        symmetric_form(cornell_system("linear"), 0)


def test_exchange_is_reciprocal_bit_for_bit() -> None:
    """A_i F_ij = A_j F_ji: one number for each pair (3.30)."""
    system = cornell_system()
    assert system.reciprocal
    assert (system.exchange == system.exchange.T).all()
    assert matrix_properties(system).asymmetry == 0.0
    assert reciprocity_error(system.area, system.transport) < 1e-15


def test_collocation_is_not_reciprocal() -> None:
    """… but nearly so: from a centroid or as an area mean, a factor is about the same."""
    system = cornell_system("collocation")
    assert not system.reciprocal
    found = matrix_properties(system).asymmetry
    assert found == pytest.approx(reciprocity_error(system.area, system.transport), rel=1e-9)
    assert 0.001 < found < 1.0


def test_reciprocity_error_is_relative_to_the_largest_exchange() -> None:
    area = np.array([1.0, 2.0])
    assert reciprocity_error(area, np.array([[0.0, 0.5], [0.25, 0.0]])) == 0.0
    assert reciprocity_error(area, np.array([[0.0, 0.5], [0.20, 0.0]])) == pytest.approx(0.2)
    assert reciprocity_error(area, np.zeros((2, 2))) == 0.0


def test_a_black_scene_is_the_identity() -> None:
    properties = matrix_properties(with_reflectance(cube_system(), 0.0))
    assert properties.spectral_radius == 0.0
    assert properties.condition == 1.0
    assert properties.dominance == 1.0
    assert properties.fill == pytest.approx(1 / 192)


def test_light_that_never_ends_has_no_bounded_condition() -> None:
    """λ = 1: two elements of ρ = 1 that see only each other."""
    ones = np.ones((2, 3))
    properties = matrix_properties(LinearSystem(1.0 - np.eye(2), ones, ones, np.ones(2), reciprocal=True))
    assert properties.spectral_radius == pytest.approx(1.0)
    assert properties.dominance == 0.0
    assert properties.condition > 1e12
    assert properties.report()["condition"] is None


def test_of_nothing() -> None:
    nothing = LinearSystem(np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    assert matrix_properties(nothing).report() == {
        "size": 0, "fill": 0.0, "dominance": 1.0, "spectral_radius": 0.0, "condition": 1.0,
        "symmetrised": 0, "asymmetry": 0.0,
    }  # fmt: skip
