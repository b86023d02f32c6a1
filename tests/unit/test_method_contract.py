"""What every method of solving promises, whatever it does inside."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from radiosity_addon.base.progress import Status
from radiosity_addon.options import METHODS, options_of_method
from radiosity_addon.solver import Solution, SolverSettings, solve
from tests.cornell import cornell_box
from tests.published import shining_cube
from tests.rooms import box_room, colored_room, gray_scene
from tests.watched import noting

ITERATIVE = [method for method in METHODS if "max_iterations" in options_of_method(method)]

each_method = pytest.mark.parametrize("method", METHODS)


def settings(method: str, **changes: Any) -> SolverSettings:
    """Settings by which all of them solve a room quickly."""
    coarse = {"elements": 60, "patches": 32, "contrast": 1.0, "error": 1e-2, "form_factor_error": 0.05}
    return SolverSettings(**{"method": method, "tolerance": 1e-2, **coarse, **changes})


def without_seconds(solution: Solution) -> dict[str, Any]:
    history = [{**entry, "seconds": None} for entry in solution.report["history"]]
    return {**solution.report, "history": history}


@each_method
def test_threads_change_no_bit_and_the_seed_does(method: str) -> None:
    """Lamps, and things that hide each other."""
    scene = colored_room()
    one, two = (solve(scene, settings(method, threads=threads)) for threads in (1, 2))
    assert one.triangle_radiosity.tobytes() == two.triangle_radiosity.tobytes()
    assert without_seconds(one) == without_seconds(two)
    other = solve(scene, settings(method, seed=1))
    assert other.triangle_radiosity.tobytes() != one.triangle_radiosity.tobytes()


@each_method
@pytest.mark.parametrize("count", [0, 1, 12])
def test_without_light_all_is_black(method: str, count: int) -> None:
    solution = solve(gray_scene(box_room()[0][:count]), settings(method))
    assert solution.triangle_radiosity.shape == (count, 3)
    assert not solution.triangle_radiosity.any()
    assert solution.report["power_W"] == {"emitted": 0.0, "absorbed": 0.0, "escaped": 0.0}
    assert solution.report["residual"] == 0.0


@each_method
def test_progress_never_falls_and_ends_at_one(method: str) -> None:
    noted: list[Status] = []
    solve(cornell_box(), settings(method), noting(noted))
    fractions = [status.fraction for status in noted]
    assert (np.diff(fractions) >= 0).all()
    assert fractions[-1] == 1.0
    assert len(fractions) > 3


@each_method
def test_the_history_ends_in_what_is_reported(method: str) -> None:
    report = solve(cornell_box(), settings(method)).report
    assert report["method"] == method
    history = report["history"]
    iterations = [entry["iteration"] for entry in history]
    assert iterations == sorted(iterations)
    assert (np.diff([entry["seconds"] for entry in history]) >= 0).all()
    for name in ("residual", "links", "elements"):
        assert history[-1][name] == report[name]
    assert iterations[-1] == report["iterations"]


@pytest.mark.parametrize("method", ITERATIVE)
def test_iterations_end_at_the_tolerance_or_at_their_limit(method: str) -> None:
    assert solve(shining_cube(), settings(method)).report["residual"] < 1e-2
    for limit in (1, 3):
        report = solve(shining_cube(), settings(method, max_iterations=limit, tolerance=1e-6)).report
        assert report["iterations"] == limit
        assert report["residual"] > 1e-6
