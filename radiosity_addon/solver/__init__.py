"""Hierarchical radiosity on arrays: no bpy, no files.

>>> from radiosity_addon.solver import PointLight, Scene, SolverSettings, solve
>>> solution = solve(Scene(triangles, reflectance, emission, lights=[PointLight((0, 0, 2), 100.0)]))
>>> solution.triangle_irradiance, solution.report["power_W"]
"""

from __future__ import annotations

from collections.abc import Generator

from .lights import AreaLight, EnvironmentLight, PointLight, SpotLight, SunLight
from .methods.hierarchical import solve_steps
from .scene import Scene
from .settings import SolverSettings
from .solution import Solution

__all__ = [
    "AreaLight",
    "EnvironmentLight",
    "PointLight",
    "Scene",
    "Solution",
    "SolverSettings",
    "SpotLight",
    "SunLight",
    "solve",
    "solve_progress",
]


def solve(scene: Scene, settings: SolverSettings | None = None) -> Solution:
    """Solve the radiosity equation of a scene by refined hierarchical radiosity (handout §4.2.1)."""
    steps = solve_progress(scene, settings or SolverSettings())
    while True:
        try:
            next(steps)
        except StopIteration as done:
            solution: Solution = done.value
            return solution


def solve_progress(scene: Scene, settings: SolverSettings) -> Generator[float, None, Solution]:
    """Solve step by step: yields the fraction done, returns the `Solution`."""
    steps = solve_steps(scene, settings)
    fraction, state = next(steps)
    yield fraction
    # The solver works on one state all along.
    for fraction, _ in steps:
        yield fraction
    return Solution(state)
