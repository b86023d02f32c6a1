"""Shooting: its bookkeeping shot by shot, what it shows, when it stops, what it keeps."""

from __future__ import annotations

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest

from radiosity_addon import solver
from radiosity_addon.base import Progress
from radiosity_addon.base.errors import UsageError
from radiosity_addon.solver import PointLight, Scene, Solution, SolverSettings
from radiosity_addon.solver.equations.exchange import exchange_areas
from radiosity_addon.solver.methods import shooting
from radiosity_addon.solver.methods.shooting import LOOK_AHEAD, MOST_COLUMNS, ShootingState, solve
from tests.cornell import cornell_box
from tests.rooms import box_room, gray, gray_scene
from tests.watched import watching


def settings(**changes: object) -> SolverSettings:
    return SolverSettings(**{"method": "shooting", "elements": 120, "tolerance": 1e-3, **changes})


def run(scene: Scene, **changes: object) -> ShootingState:
    return solve(scene, settings(**changes))


def form_factors(state: ShootingState) -> np.ndarray:
    """(l, l) the same form factors, from the same exchange of each pair."""
    leaves = state.leaves
    i, j = (grid.ravel() for grid in np.meshgrid(leaves, leaves, indexing="ij"))
    exchange = exchange_areas(state.hierarchy, state.caster, i, j, state.settings.seed)
    return exchange.reshape(len(leaves), -1) / state.hierarchy.area[leaves][:, None]


def test_the_unshot_is_the_residual_of_what_was_shot() -> None:
    """E' − K S = ΔB after every shot, element by element; so no light is made or lost on the way."""
    factors = direct = None

    def look(state: ShootingState) -> None:
        nonlocal factors, direct
        if len(state.leaves) == 0:
            return
        if factors is None:
            factors = form_factors(state)
            direct = state.unshot.copy()  # nothing is shot yet: E'
        radiosity = state.radiosity[state.leaves]
        shot = radiosity - state.unshot
        reflected = state.reflectance[state.leaves] * (factors @ shot)
        np.testing.assert_allclose(direct + reflected - shot, state.unshot, rtol=0, atol=1e-12)
        # B itself is one gather further: its residual is what the unshot light would add.
        gathered = direct + state.reflectance[state.leaves] * (factors @ radiosity) - radiosity
        power = state.hierarchy.area[state.leaves] @ np.abs(gathered)
        assert (power < 0.78 * state.unshot_power()).all()

    state = solve(cornell_box(), settings(max_iterations=200), watching(look))
    assert state.iterations == 200


def test_the_balance_of_power_holds_after_every_shot() -> None:
    """Of what was shot, A S, part was taken back in as irradiance: Σ A S ΣF = Σ A H."""

    def look(state: ShootingState) -> None:
        if state.iterations in (1, 10, 100):
            leaves, area = state.leaves, state.hierarchy.area[state.leaves]
            shot = state.radiosity[leaves] - state.unshot
            # An element that has shot knows its ΣF; others have shot nothing.
            np.testing.assert_allclose((area * state.reach) @ shot, area @ state.received, rtol=1e-12)

    solve(cornell_box(), settings(max_iterations=100), watching(look))


def test_each_shot_is_the_largest_and_lowers_the_unshot_power() -> None:
    state = run(cornell_box(), max_iterations=0)
    assert state.iterations == 0
    before = state.unshot_power()
    for _ in range(150):
        power = state.hierarchy.area[state.leaves] * state.unshot.max(axis=1)
        chosen = shooting.shoot(state)
        assert power[chosen] == power.max() > 0
        assert (state.unshot[chosen] == 0).all()
        after = state.unshot_power()
        assert (after < before).all()
        before = after


def test_stops_at_the_tolerance_or_at_the_number_of_shots() -> None:
    done = run(cornell_box(), tolerance=0.05)
    assert done.residual < 0.05
    fewer = run(cornell_box(), tolerance=0.05, max_iterations=done.iterations - 1)
    assert fewer.iterations == done.iterations - 1
    assert fewer.residual >= 0.05
    assert done.details["shooting"]["shots"] == done.iterations


def test_every_shot_is_shown_and_the_history_is_thinned() -> None:
    fractions, shots = [], []

    def look(state: ShootingState) -> None:
        assert len(state.shown()) == state.hierarchy.n_elements
        shots.append(state.iterations)

    progress = Progress(lambda status: fractions.append(status.fraction), look=look)
    state = solver.solve(cornell_box(), settings(tolerance=0.01), progress).local_pass.elements.state
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert np.diff(shots).max() == 1
    noted = [entry.iteration for entry in state.history]
    assert noted[:30] == list(range(30))
    assert noted[-1] == state.iterations
    assert len(noted) < 100 < state.iterations
    assert all(a.residual > b.residual and a.links < b.links for a, b in pairwise(state.history))


def test_the_ambient_term_changes_only_what_is_shown() -> None:
    seen: dict[bool, list[tuple]] = {False: [], True: []}

    def shoot(on: bool) -> ShootingState:
        def look(state: ShootingState) -> None:
            same = (state.radiosity.tobytes(), state.irradiance.tobytes(), state.unshot.tobytes())
            seen[on].append((*same, state.residual, state.shown().copy(), state.shown() is state.radiosity))

        return solve(cornell_box(), settings(ambient=on, max_iterations=250), watching(look))

    one, other = shoot(False), shoot(True)
    differs = 0
    for plain, ambient in zip(seen[False], seen[True], strict=True):
        assert plain[:4] == ambient[:4]
        assert plain[5]
        differs += (ambient[4] > plain[4]).any()
    assert differs > 100
    first, second = Solution(one), Solution(other)
    assert first.triangle_irradiance.tobytes() == second.triangle_irradiance.tobytes()


def test_the_ambient_term_is_exact_where_all_surfaces_are_alike() -> None:
    """B + ρ a = E / (1 − ρ) before the first shot, and its area mean stays so after each."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    triangles = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    scene = Scene(triangles, np.tile([0.2, 0.5, 0.9], (4, 1)), gray(4, 2.0))
    exact = 2.0 / (1.0 - np.array([0.2, 0.5, 0.9]))

    def look(state: ShootingState) -> None:
        if state.iterations == 0 and len(state.leaves):
            np.testing.assert_allclose(state.shown(), np.tile(exact, (4, 1)), rtol=1e-14)
        if len(state.leaves):
            # The factors of the four faces add up to 1 within the outline integral's 3e-5.
            np.testing.assert_allclose(state.shown().mean(axis=0), exact, rtol=1e-3)

    state = solve(scene, settings(elements=4, ambient=True, tolerance=1e-6), watching(look))
    assert state.iterations > 50


def test_memory_grows_with_the_elements_not_with_their_square() -> None:
    """Past the scene's own, what shooting allocates at its peak is linear in n, and n² far off."""
    peaks, counts = [], (4_000, 12_000)
    for count in counts:
        run(cornell_box(), max_iterations=1)  # tables that are made once
        state = run(cornell_box(), elements=count, max_iterations=0, threads=1)
        tracemalloc.start()
        for _ in range(4):
            shooting.shoot(state)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * counts[1] / counts[0] * peaks[0]
    assert peaks[1] < 0.06 * 8 * counts[1] ** 2


def test_columns_are_few_and_made_ahead() -> None:
    """Few columns wait at any time, and few are made in vain; that changes no shot."""
    waiting = []

    def look(state: ShootingState) -> None:
        waiting.append(len(state.columns))

    state = solve(cornell_box(), settings(tolerance=0.05), watching(look))
    assert LOOK_AHEAD <= max(waiting) < MOST_COLUMNS
    assert state.n_links <= state.pairs < 1.2 * state.n_links


@pytest.mark.parametrize("ahead", [1, 5])
def test_how_many_columns_are_made_ahead_changes_nothing(monkeypatch: pytest.MonkeyPatch, ahead: int) -> None:
    usual = run(cornell_box(), max_iterations=60)
    monkeypatch.setattr(shooting, "LOOK_AHEAD", ahead)
    other = run(cornell_box(), max_iterations=60)
    assert other.radiosity.tobytes() == usual.radiosity.tobytes()


def test_lamps_shine_before_the_first_shot() -> None:
    """E' = E + ρ H_direct is what there is to shoot, and the irradiance holds the lamps' share."""
    triangles, _ = box_room((4, 4, 4))
    scene = gray_scene(triangles, lights=[PointLight((2, 2, 2), 10_000.0)])
    start = run(scene, max_iterations=0)
    mean = start.hierarchy.area[start.leaves] @ start.received / 96.0
    np.testing.assert_allclose(mean, 10_000.0 / 96.0, rtol=0.005)
    np.testing.assert_array_equal(start.unshot, 0.5 * start.received)
    done = run(scene, tolerance=1e-4)
    mean = done.hierarchy.area[done.leaves] @ done.received / 96.0
    # ρ = 0.5: all bounces double the light.
    np.testing.assert_allclose(mean, 20_000.0 / 96.0, rtol=0.01)
    assert Solution(done).report["closure_area_mean"] == pytest.approx(1.0, abs=0.005)


def test_without_light_nothing_is_shot() -> None:
    assert run(gray_scene(box_room()[0])).iterations == 0


def test_refuses_what_does_not_fit_into_memory() -> None:
    with pytest.raises(UsageError, match=r"shooting between 120 elements needs .* fewer elements"):
        run(cornell_box(), memory_limit=1e-4)
