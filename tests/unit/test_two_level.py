"""The two-level method: averages, one gather, adaptive subdivision, what is computed and what is refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from radiosity_addon import solver
from radiosity_addon.base.errors import UsageError
from radiosity_addon.solver import PointLight, Scene, Solution, SolverSettings
from radiosity_addon.solver.equations.exchange import exchange_areas
from radiosity_addon.solver.methods import two_level
from radiosity_addon.solver.methods.two_level import MIN_ELEMENT_SHARE, TwoLevelState, contrasts, solve
from tests.cornell import cornell_box
from tests.rooms import box_room, gray, gray_scene
from tests.watched import watching

NEVER = 1e9
"""A contrast no scene has."""


def settings(**changes: object) -> SolverSettings:
    defaults = {"method": "two-level", "elements": 200, "patches": 60, "contrast": NEVER}
    return SolverSettings(**{**defaults, **changes})


def run(scene: Scene, **changes: object) -> TwoLevelState:
    return solve(scene, settings(**changes))


def test_elements_gather_once_from_the_patch_solution() -> None:
    """B_q = E_q + ρ_q Σ_j F_qj B_j (4.3), with the factors asked for anew."""
    state = run(cornell_box())
    elements, patches = state.leaves, state.patches
    assert (len(patches), len(elements)) == (59, 200)
    one, other = np.repeat(elements, len(patches)), np.tile(patches, len(elements))
    exchange = exchange_areas(state.hierarchy, state.caster, one, other, state.settings.seed)
    factors = exchange.reshape(len(elements), -1) / state.hierarchy.area[elements][:, None]
    irradiance = factors @ state.patch_radiosity
    np.testing.assert_allclose(state.irradiance[elements], irradiance, rtol=0, atol=1e-13)
    radiosity = state.emission[elements] + state.reflectance[elements] * irradiance
    np.testing.assert_allclose(state.radiosity[elements], radiosity, rtol=0, atol=1e-13)


def test_elements_average_to_their_patches() -> None:
    """By (4.1) and (4.3) the mean of a patch's elements is the patch's own solution."""
    state = run(cornell_box())
    np.testing.assert_allclose(state.radiosity[state.patches], state.patch_radiosity, rtol=0, atol=1e-13)
    assert state.residual < 1e-14


def test_patch_factors_are_area_means() -> None:
    """A_i F_ij = Σ A_q F_qj over the elements of patch i, wherever they were split."""
    state = run(cornell_box(), contrast=1.0)
    hierarchy = state.hierarchy
    factors = two_level.patch_factors(state)
    for row, patch in enumerate(state.patches):
        below = [patch]
        while not np.isin(below, state.leaves).all():
            split = [n for n in below if hierarchy.first_child[n] >= 0]
            below = [n for n in below if hierarchy.first_child[n] < 0]
            below += [hierarchy.first_child[n] + k for n in split for k in range(4)]
        rows = np.searchsorted(state.leaves, sorted(below))
        area = hierarchy.area[state.leaves[rows]]
        assert area.sum() == pytest.approx(hierarchy.area[patch], rel=1e-12)
        np.testing.assert_allclose(factors[row], area @ state.factors[rows] / area.sum(), atol=1e-14)
        assert (state.patch_of[rows] == row).all()


def test_only_the_rows_of_new_elements_are_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every pair of an element and a patch is measured once, ever."""
    asked: list[np.ndarray] = []

    def counting(hierarchy, caster, one, other, *rest):
        asked.append(np.stack([one, other], axis=1))
        return exchange_areas(hierarchy, caster, one, other, *rest)

    monkeypatch.setattr(two_level, "exchange_areas", counting)
    state = run(cornell_box(), contrast=1.0)
    pairs = np.concatenate(asked)
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    rows = state.details["two_level"]["rows"]
    assert len(rows) > 2
    assert len(pairs) == sum(rows) * len(state.patches)
    # Each split makes four elements of one.
    counts = state.details["two_level"]["elements"]
    assert counts[0] == rows[0] == 200
    for before, after, new in zip(counts[:-1], counts[1:], rows[1:], strict=True):
        assert after - before == 3 * new // 4
    assert counts[-1] == len(state.leaves)


def test_patch_radiosities_are_kept() -> None:
    plain, adaptive = run(cornell_box()), run(cornell_box(), contrast=1.0)
    assert len(adaptive.leaves) > len(plain.leaves)
    assert adaptive.patch_radiosity.tobytes() == plain.patch_radiosity.tobytes()
    # Rows of elements that were never split are what they were.
    same = np.isin(adaptive.leaves, plain.leaves)
    before = np.isin(plain.leaves, adaptive.leaves)
    assert same.sum() == before.sum() > 50
    assert adaptive.factors[same].tobytes() == plain.factors[before].tobytes()


@pytest.mark.parametrize("contrast", [0.4, 1.0])
def test_neighbors_differ_by_less_than_the_contrast_or_are_finest(contrast: float) -> None:
    state = run(cornell_box(), elements=100, patches=32, contrast=contrast)
    pairs, difference = contrasts(state)
    too_much = pairs[difference > state.limit].ravel()
    assert len(too_much) > 0
    area = state.hierarchy.area
    assert (area[too_much] < 4 * state.smallest).all()
    assert state.details["two_level"]["neighbours_above_limit"] == len(too_much) // 2
    start = run(cornell_box(), elements=100, patches=32)
    mean = area[start.leaves].mean()
    fewer = np.setdiff1d(state.leaves, start.leaves)
    assert area[fewer].min() >= MIN_ELEMENT_SHARE * mean == state.smallest


def test_seams_between_materials_do_not_count() -> None:
    """Across the seam of a checkered floor, all else being black, light differs as on a plain one."""
    triangles, surface = box_room((4, 4, 2))
    emission = gray(12, 1.0) * (surface == 1)[:, None]
    plain, checkered = gray(12, 0.0), gray(12, 0.0)
    plain[[0, 1]], checkered[[0, 1]] = 0.5, [[0.1] * 3, [0.9] * 3]
    differences = []
    for reflectance in (plain, checkered):
        state = run(Scene(triangles, reflectance, emission))
        pairs, difference = contrasts(state)
        seam = np.sort(state.hierarchy.face[pairs], axis=1).tolist()
        on_seam = [row for row, faces in enumerate(seam) if faces == [0, 1]]
        differences.append(difference[on_seam])
    assert len(differences[0]) >= 4
    np.testing.assert_allclose(differences[1], differences[0], rtol=0, atol=1e-14)
    radiosity = np.diff(state.radiosity[pairs[on_seam]], axis=1)
    assert np.abs(radiosity).min() > 5 * differences[1].max()


def test_memory_bounds_the_subdivision() -> None:
    """Rounds stop where the next rows would not fit; the largest differences go first."""
    unbounded = run(cornell_box(), contrast=0.5)
    patches = len(unbounded.patches)
    limit = (2 * 8 * 300 * patches + 3 * 8 * patches**2) / 2**30
    bounded = run(cornell_box(), contrast=0.5, memory_limit=limit)
    assert 290 < len(bounded.leaves) <= 300 < len(unbounded.leaves)
    assert bounded.details["two_level"]["neighbours_above_limit"] > 0


def test_refuses_what_does_not_fit_into_memory() -> None:
    with pytest.raises(
        UsageError, match=r"200 elements and 60 patches needs .* fewer elements or patches.* hierarchical"
    ):
        run(cornell_box(), memory_limit=1e-4)


def test_patches_are_at_most_as_many_as_elements() -> None:
    state = run(cornell_box(), elements=60, patches=500)
    assert len(state.patches) == len(state.leaves) == 59


@pytest.mark.parametrize("block", [1000, 1 << 19])
def test_there_is_a_picture_at_any_time(monkeypatch: pytest.MonkeyPatch, block: int) -> None:
    """Whenever the method yields, every element has a radiosity; halfway rounds show the parents'."""
    monkeypatch.setattr(two_level, "BLOCK_PAIRS", block)
    seen = []

    def look(state: TwoLevelState) -> None:
        assert len(state.shown()) == len(state.irradiance) == state.hierarchy.n_elements
        seen.append(state.hierarchy.area[state.hierarchy.leaves] @ state.shown()[state.hierarchy.leaves])

    solver.solve(cornell_box(), settings(contrast=1.0), watching(look))
    # The picture's power is the emitters' at first and the solution's from the first gather on.
    assert (seen[0] == seen[1]).all()
    np.testing.assert_allclose(seen[-len(seen) // 2 :], seen[-1:] * len(seen[-len(seen) // 2 :]), rtol=0.02)


def test_the_history_has_an_entry_a_round() -> None:
    state = run(cornell_box(), contrast=1.0)
    assert len(state.history) == state.iterations == len(state.details["two_level"]["rows"])
    assert all(a.links < b.links for a, b in pairwise(state.history))


def test_lamps_light_the_new_elements() -> None:
    """After subdivision the irradiance of a black room is the lamp's own, leaf by leaf."""
    triangles, _ = box_room((4, 4, 3))
    lamp = PointLight((1.0, 1.0, 2.5), 100.0)
    scene = gray_scene(triangles, 1e-9, lights=[lamp])
    state = run(scene, contrast=0.5)
    assert len(state.details["two_level"]["rows"]) > 1
    center = state.hierarchy.corners[state.leaves].mean(axis=1)
    exact = lamp.unit_irradiance(center, state.hierarchy.normal[state.leaves])[:, None] * lamp.strength
    np.testing.assert_allclose(state.irradiance[state.leaves], exact, rtol=0.25)
    total = state.hierarchy.area[state.leaves] @ state.irradiance[state.leaves]
    np.testing.assert_allclose(total, 100.0, rtol=0.01)


def test_black_surfaces_are_solved_and_never_split() -> None:
    scene = cornell_box()
    black = Scene(scene.triangles, np.zeros_like(scene.reflectance), scene.emission)
    state = run(black, contrast=0.1)
    assert len(state.leaves) == 200
    np.testing.assert_array_equal(state.radiosity, state.emission)
    assert state.irradiance.max() > 0


def test_closure_and_power_of_a_closed_room() -> None:
    triangles, surface = box_room()
    emission = gray(12, 1.0) * (surface == 1)[:, None]
    state = run(gray_scene(triangles, 0.5, emission), elements=300, patches=48)
    np.testing.assert_allclose(state.closure(), 1.0, atol=2e-3)
    power = Solution(state).report["power_W"]
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=0.02)
