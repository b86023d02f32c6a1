"""Anderson's mixing on linear iterations of known solution."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver import PointLight, SolverSettings
from radiosity_addon.solver.methods import hierarchical
from radiosity_addon.solver.methods.hierarchical import STALLED, exhausted, iterate
from radiosity_addon.solver.state.anderson import Anderson
from radiosity_addon.solver.state.iteration import bounce
from tests.rooms import box_room, gray_scene
from tests.unit.solved_rooms import solved


def steps_until(matrix: np.ndarray, right: np.ndarray, depth: int, tolerance: float) -> int:
    guess = np.zeros_like(right)
    mixer = Anderson(np.ones(len(right)), depth)
    for step in range(1, 2000):
        image = matrix @ guess + right
        if np.abs(image - guess).max() < tolerance:
            exact = np.linalg.solve(np.eye(len(right)) - matrix, right)
            norm = np.linalg.norm(np.linalg.inv(np.eye(len(right)) - matrix), np.inf)
            assert np.abs(guess - exact).max() <= norm * tolerance
            return step
        guess = mixer.next(guess, image)
    raise AssertionError("no convergence")


@pytest.fixture
def contraction() -> np.ndarray:
    """Rows that sum to 0.95, like a closed room's at ρ = 0.95."""
    matrix = np.random.default_rng(0).uniform(0, 1, (40, 40)) ** 4
    return 0.95 * matrix / matrix.sum(axis=1, keepdims=True)


def test_plain_iteration_is_depth_nought(contraction: np.ndarray) -> None:
    guess, right = np.zeros((40, 1)), np.ones((40, 1))
    image = contraction @ guess + right
    np.testing.assert_array_equal(Anderson(np.ones(40), 0).next(guess, image), image)
    assert steps_until(contraction, right, 0, 1e-6) > 200


def test_as_many_steps_as_eigenvalues_are_enough() -> None:
    """With three distinct eigenvalues the mixture is exact after four images, as a Krylov method's."""
    matrix = np.diag(np.repeat([0.9, 0.5, -0.7], 5))
    right = np.random.default_rng(1).uniform(1, 2, (15, 2))
    assert steps_until(matrix, right, 5, 1e-9) <= 6


def test_few_steps_where_jacobi_needs_hundreds(contraction: np.ndarray) -> None:
    right = np.random.default_rng(2).uniform(0, 1, (40, 3))
    assert steps_until(contraction, right, 5, 1e-6) < 0.1 * steps_until(contraction, right, 0, 1e-6)


def test_columns_are_systems_of_their_own(contraction: np.ndarray) -> None:
    """A column that is zero stays so; the others are mixed as if they were alone."""
    rng = np.random.default_rng(3)
    right = rng.uniform(0, 1, (40, 2)) * [1.0, 0.0]
    both, alone = Anderson(np.ones(40)), Anderson(np.ones(40))
    guess = np.zeros((40, 2))
    for _ in range(4):
        image = contraction @ guess + right
        mixed = both.next(guess, image)
        np.testing.assert_allclose(mixed[:, :1], alone.next(guess[:, :1], image[:, :1]), rtol=1e-12)
        assert (mixed[:, 1] == 0).all()
        guess = mixed


def test_growth_is_forgotten() -> None:
    """After a jump in the change nothing of what was before is mixed in: the plain step is taken."""
    mixer = Anderson(np.ones(2))
    mixer.next(np.zeros((2, 1)), np.array([[1.0], [0.5]]))
    mixer.next(np.array([[1.0], [0.5]]), np.array([[1.5], [0.6]]))
    image = np.array([[9.0], [-9.0]])
    np.testing.assert_array_equal(mixer.next(np.zeros((2, 1)), image), image)


def test_a_bright_closed_room_needs_a_quarter_of_jacobis_gathers() -> None:
    """ρ = 0.95 over the same links, from the same start, to the same residual."""
    triangles, _ = box_room((3, 2, 2), n=3)
    scene = gray_scene(triangles, 0.95, lights=[PointLight((1.0, 1.2, 0.7), 10.0)])
    state = solved(scene, error=3e-3)
    assert len(state.cluster_links) > 0
    assert state.settings == SolverSettings(error=3e-3)
    links = (state.links, state.direct())

    state.reset()
    state.iterations = 0
    iterate(state, 1e-5)
    accelerated, residual = state.iterations, state.residual
    solution = state.radiosity.copy()
    assert residual < 1e-5

    state.reset()
    state.iterations = 0
    while not exhausted(state):
        bounce(state, *links, state.sent, state.cluster_links, state.cut)
        if state.residual < 1e-5:
            break
    assert accelerated < 0.25 * state.iterations
    # Both stop near the same fixed point: a residual r leaves an error of at most r / (1 − ρ).
    area = state.hierarchy.area[state.hierarchy.leaves]
    apart = area @ np.abs(solution - state.radiosity)[state.hierarchy.leaves]
    assert apart.max() / state.power < 2 * 1e-5 / (1 - 0.95)


def test_an_iteration_whose_residual_falls_no_more_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    triangles, _ = box_room((1, 1, 1), n=1)
    scene = gray_scene(triangles, 0.5, 1.0)
    state = solved(scene, error=1e-2)
    state.reset()
    state.iterations = 0
    residuals = [0.9**step for step in range(20)]

    def stuck(state: hierarchical.HierarchicalState, *rest: object) -> None:
        state.residual = residuals[min(state.iterations, len(residuals) - 1)]
        state.iterations += 1

    monkeypatch.setattr(hierarchical, "bounce", stuck)
    iterate(state, 1e-5)
    assert len(residuals) + STALLED <= state.iterations <= len(residuals) + STALLED + 2
