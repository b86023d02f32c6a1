"""Surfaces that lie in one another: no method makes light of them."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.options.methods import METHODS
from radiosity_addon.scene.overlaps import OVERLAP, shares
from radiosity_addon.solver import Scene, SolverSettings, solve
from radiosity_addon.solver.methods import solve_by_method
from tests.rooms import CEILING, FLOOR, area_mean, box_room, gray, gray_scene


def test_sums_below_the_limit_are_left_alone() -> None:
    sums = np.array([0.0, 0.5, 1.0, OVERLAP, 2.0, 4.0])
    assert shares(sums).tolist() == [1.0, 1.0, 1.0, 1.0, 0.5, 0.25]


def room_with_its_floor(times: int) -> Scene:
    """A closed cube whose ceiling shines, all floors in one plane and facing up."""
    triangles, surface = box_room()
    floor = np.flatnonzero(surface == FLOOR)
    triangles = np.concatenate([triangles, *[triangles[floor]] * (times - 1)])
    emission = gray(len(triangles), 0.0)
    emission[: len(surface)][surface == CEILING] = 1.0
    return gray_scene(triangles, 0.8, emission)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_a_doubled_floor_makes_no_light(method: str) -> None:
    """All methods converge, and the room is as bright as with one floor."""
    # Shooting takes as many shots as elements, squared.
    elements = 72 if method == "shooting" else 200
    settings = SolverSettings(
        method=method, elements=elements, patches=60, contrast=10.0, tolerance=1e-4, min_area=2e-3, error=1e-3
    )
    single, double = solve(room_with_its_floor(1), settings), solve(room_with_its_floor(2), settings)
    assert double.report["residual"] <= 1e-4
    walls, areas = slice(4, 12), np.ones(8)
    one = area_mean(single.triangle_irradiance[walls], areas)
    two = area_mean(double.triangle_irradiance[walls], areas)
    np.testing.assert_allclose(two, one, rtol=5e-3)
    power = double.report["power_W"]
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=5e-3)


def leaf_radiosity(scene: Scene, **settings: object) -> np.ndarray:
    state = solve_by_method(scene, SolverSettings(**{"elements": 28, "tolerance": 1e-8, **settings}))
    return state.radiosity[state.hierarchy.leaves]


@pytest.mark.parametrize("two_sided", [False, True])
def test_the_methods_agree_on_overlapping_surfaces_too(two_sided: bool) -> None:
    """The same elements, to 1e-6."""
    room = room_with_its_floor(2)
    scene = Scene(room.triangles, room.reflectance, room.emission, two_sided=two_sided)
    dense = leaf_radiosity(scene, method="dense")
    for method in ("jacobi", "gauss-seidel", "conjugate-gradient", "shooting"):
        np.testing.assert_allclose(leaf_radiosity(scene, method=method), dense, rtol=1e-6)
    one_a_patch = leaf_radiosity(scene, method="two-level", patches=28, contrast=100.0)
    np.testing.assert_allclose(one_a_patch, dense, rtol=1e-10)


def test_a_doubled_room_is_as_bright_as_one() -> None:
    """What counts of each pair of walls is E / (1 − ρ) bright, and nothing of what it covers is left."""
    room = box_room()[0]
    twice = gray_scene(np.concatenate([room, room]), 0.8, 2.0)
    for method in ("dense", "conjugate-gradient", "shooting"):
        found = leaf_radiosity(twice, method=method)
        counts = found[:, 0] > 1.0
        np.testing.assert_allclose(found[counts], 10.0, rtol=1e-3)
        assert (found[~counts] == 0.0).all()
        solution = solve(twice, SolverSettings(elements=28, tolerance=1e-8, method=method))
        power = solution.report["power_W"]
        assert power["emitted"] == pytest.approx(12.0)
        assert power["absorbed"] == pytest.approx(12.0, rel=1e-3)
