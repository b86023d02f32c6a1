"""Shooting against the dense solution, and against gathering at the same cost (handout §3.4.1, §3.4.2)."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver import Scene, SolverSettings, solve
from radiosity_addon.solver.equations.assembly import galerkin, with_lamps
from radiosity_addon.solver.equations.fixed_elements import subdivide_evenly
from radiosity_addon.solver.equations.linear_system import LinearSystem
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.methods import shooting, solve_by_method
from radiosity_addon.solver.methods.shooting import ShootingState
from radiosity_addon.solver.state.state import SolverState
from tests.cornell import cornell_box
from tests.published import (
    CIE_5_8_INDIRECT_LX,
    CUBE_MEANS,
    cie_5_8,
    cie_5_8_indirect,
    shining_cube,
    wall_means,
)
from tests.rooms import box_room, colored_room, gray, gray_scene
from tests.watched import watching

ELEMENTS = 90


def by(method: str, scene: Scene, **changes: object) -> SolverState:
    settings = SolverSettings(method=method, elements=ELEMENTS, **changes)
    return solve_by_method(scene, settings)


@pytest.mark.parametrize("scene", [cornell_box, colored_room])
def test_converged_shooting_is_the_dense_solution(scene) -> None:
    """The same elements, the same exchange of each pair: to 1e-6 of the brightest."""
    dense = by("dense", scene())
    shot = by("shooting", scene(), tolerance=2e-8, max_iterations=100_000)
    assert shot.residual < 2e-8
    for name in ("radiosity", "irradiance"):
        exact, found = getattr(dense, name), getattr(shot, name)
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-6 * exact.max())
    np.testing.assert_allclose(shot.closure(), dense.closure(), rtol=0, atol=1e-9)


def test_cube_with_emitting_ceiling() -> None:
    """Area means of radiosity, ρ = 0.5, from exact Galerkin solutions extrapolated over grids."""
    scene = shining_cube()
    solution = solve(scene, SolverSettings(method="shooting", elements=192, tolerance=1e-4))
    means = wall_means(solution.triangle_radiosity, scene.areas)
    np.testing.assert_allclose(means, np.tile(CUBE_MEANS, (3, 1)).T, rtol=0.004)
    power = solution.report["power_W"]
    # What is not yet absorbed is unshot.
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=3e-4)


@pytest.mark.parametrize("reflectance", [0.2, 0.5])
def test_cie_171_5_8(reflectance: float) -> None:
    scene = cie_5_8(reflectance)
    solution = solve(scene, SolverSettings(method="shooting", elements=192, tolerance=1e-4))
    indirect = cie_5_8_indirect(solution.triangle_irradiance, scene.areas)
    np.testing.assert_allclose(indirect, CIE_5_8_INDIRECT_LX[reflectance], rtol=0.002)


def cornell_system() -> LinearSystem:
    scene = cornell_box()
    hierarchy = Hierarchy(scene)
    subdivide_evenly(hierarchy, ELEMENTS)
    return galerkin(hierarchy, EmbreeCaster(scene.triangles))


def relax(system: LinearSystem, residual: np.ndarray, row: int) -> None:
    """Make row's equation true by S_row += r_row, and bring the residual E − K S up to date."""
    change = residual[row].copy()
    column = system.exchange[:, row] / system.area
    residual[row] = 0.0
    residual += system.reflectance * column[:, None] * change


def test_shooting_is_never_behind_gathering_of_the_same_cost() -> None:
    """Σ A |E − K S| after k shots is at most that after k rows of cyclic gathers, for every k.

    Both relax one row a step, from S = 0 in the Cornell box: shooting in the order of unshot
    power, Gauss–Seidel in the order of rows. K is an M-matrix, so no order makes r negative.
    """
    system = cornell_system()
    gathering = system.emission.copy()
    expected = [system.area @ gathering]
    for step in range(5 * len(system)):
        relax(system, gathering, step % len(system))
        expected.append(system.area @ gathering)
        assert gathering.min() >= 0

    found = []
    settings = SolverSettings(elements=ELEMENTS, tolerance=0.0, max_iterations=5 * len(system))

    def look(state: ShootingState) -> None:
        if len(state.leaves) and len(found) <= state.iterations:
            found.append(state.unshot_power())

    shooting.solve(cornell_box(), settings, watching(look))
    found, cyclic = np.array(found), np.array(expected)
    assert found.shape == cyclic.shape
    assert (found <= cyclic * (1 + 1e-12)).all()
    # And far ahead for the first pictures: a third of the steps until half is left.
    halved = [int(np.argmax(each.max(axis=1) < 0.5 * each[0].max())) for each in (found, cyclic)]
    assert 3 * halved[0] < halved[1]


def test_a_shot_is_the_relaxation_of_a_row() -> None:
    """The method's ΔB, computed from columns on the fly, is the matrix's relaxation in its order."""
    system = cornell_system()
    residual = system.emission.copy()
    settings = SolverSettings(elements=ELEMENTS, tolerance=0.0, max_iterations=300)
    shots_before = np.zeros(len(system), dtype=int)

    def look(state: ShootingState) -> None:
        nonlocal shots_before
        if len(state.leaves) and state.shots_of.sum() > shots_before.sum():
            relax(system, residual, int(np.argmax(state.shots_of - shots_before)))
            shots_before = state.shots_of.copy()
            np.testing.assert_allclose(state.unshot, residual, rtol=0, atol=1e-12 * 30)

    shooting.solve(cornell_box(), settings, watching(look))
    assert shots_before.sum() == 300


def test_shots_gather_the_bounces_from_below() -> None:
    """B only rises while shooting, toward the dense solution, and never past it."""
    dense = by("dense", cornell_box()).radiosity
    before = np.zeros_like(dense)

    def look(state: ShootingState) -> None:
        nonlocal before
        if len(state.leaves) == 0:
            return
        assert (state.radiosity >= before * (1 - 1e-14)).all()
        assert (state.radiosity <= dense + 1e-12 * dense.max()).all()
        before = state.radiosity

    state = shooting.solve(cornell_box(), SolverSettings(elements=ELEMENTS, tolerance=1e-3), watching(look))
    leaves = state.leaves
    error = state.hierarchy.area[leaves] @ (dense - before)[leaves] / state.power
    # Σ A (B∞ − B) = Σ A Σ_k (ρF)^k ρF ΔB ≤ ρ / (1 − ρ) Σ A ΔB.
    assert (error <= 0.78 / (1 - 0.78) * state.residual).all()
    assert (error > 0).all()


def test_the_ambient_term_anticipates_the_mean() -> None:
    """In a closed room of one reflectance the mean shown is the solution's from the first picture on."""
    triangles, surface = box_room((3, 3, 2))
    emission = gray(12, 5.0) * (surface == 1)[:, None]
    scene = gray_scene(triangles, 0.7, emission)
    dense = by("dense", scene)
    area = dense.hierarchy.area[dense.hierarchy.leaves]
    exact = area @ dense.radiosity[dense.hierarchy.leaves] / area.sum()
    settings = SolverSettings(elements=ELEMENTS, tolerance=1e-3, ambient=True)
    behind = []

    def look(state: ShootingState) -> None:
        if len(state.leaves):
            shown = area @ state.shown()[state.leaves] / area.sum()
            # One ρ in a closed room: the mean is exact but for what closure is off.
            np.testing.assert_allclose(shown, exact, rtol=3e-3)
            plain = area @ state.radiosity[state.leaves] / area.sum()
            behind.append(float((1.0 - plain / exact).max()))

    shooting.solve(scene, settings, watching(look))
    assert behind[0] > 0.5
    assert behind[-1] < 3e-3


def test_lamps_are_emission() -> None:
    """The system of the lamps' light as E' = E + ρ H_direct has the same first residual."""
    scene = colored_room()
    state = shooting.solve(scene, SolverSettings(elements=ELEMENTS, max_iterations=0))
    system = with_lamps(galerkin(state.hierarchy, state.caster), state.received)
    assert state.unshot.tobytes() == system.emission.tobytes()
