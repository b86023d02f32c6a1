"""Radiosity on arrays: no bpy, no files.

>>> from radiosity_addon.solver import PointLight, Scene, SolverSettings, solve
>>> solution = solve(Scene(triangles, reflectance, emission, lights=[PointLight((0, 0, 2), 100.0)]))
>>> solution.triangle_irradiance, solution.report["power_W"]
"""

from __future__ import annotations

from ..base import SILENT, Progress
from ..lights import AreaLight, EnvironmentLight, PointLight, SpotLight, SunLight
from ..scene import Scene
from .methods import solve_by_method
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
]


def solve(scene: Scene, settings: SolverSettings | None = None, progress: Progress = SILENT) -> Solution:
    """Solve the radiosity equation of a scene by the method the settings name.

    `progress` is shown the state so far: the same object all along.
    """
    state = solve_by_method(scene, settings or SolverSettings(), progress)
    progress.at(1.0, state)
    return Solution(state)
