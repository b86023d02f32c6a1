"""Radiosity on arrays: no bpy, no files.

>>> from radiosity_addon.solver import PointLight, Scene, SolverSettings, solve
>>> solution = solve(Scene(triangles, reflectance, emission, lights=[PointLight((0, 0, 2), 100.0)]))
>>> solution.triangle_irradiance, solution.report["power_W"]
"""

from __future__ import annotations

from collections.abc import Generator

from ..lights import AreaLight, EnvironmentLight, PointLight, SpotLight, SunLight
from ..scene import Scene
from .methods import steps_of
from .settings import SolverSettings
from .solution import Solution
from .state import SolverState

__all__ = [
    "AreaLight",
    "EnvironmentLight",
    "PointLight",
    "Scene",
    "Solution",
    "SolverSettings",
    "SolverState",
    "SpotLight",
    "SunLight",
    "solve",
    "solve_progress",
]


def solve(scene: Scene, settings: SolverSettings | None = None) -> Solution:
    """Solve the radiosity equation of a scene by the method the settings name."""
    steps = solve_progress(scene, settings or SolverSettings())
    while True:
        try:
            next(steps)
        except StopIteration as done:
            solution: Solution = done.value
            return solution


def solve_progress(
    scene: Scene, settings: SolverSettings
) -> Generator[tuple[float, SolverState], None, Solution]:
    """Solve step by step: yields the fraction done and the state so far, returns the `Solution`."""
    state = None
    for fraction, state in steps_of(scene, settings):
        yield fraction, state
    assert state is not None  # every method yields at least once
    return Solution(state)
