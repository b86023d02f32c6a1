"""The solvers, one file each, with one interface: `solve(scene, settings, progress)` returns the state."""

from __future__ import annotations

from importlib import import_module
from typing import cast

from ...base import SILENT, Progress
from ...scene import Scene
from ..settings import SolverSettings
from ..state import SolverState
from .hierarchical import HierarchicalState

__all__ = ["HierarchicalState", "solve_by_method"]


def solve_by_method(scene: Scene, settings: SolverSettings, progress: Progress = SILENT) -> SolverState:
    """Solve by the method in the settings; `progress` receives the state, always the same object."""
    module = import_module("." + settings.method.replace("-", "_"), __name__)
    return cast(SolverState, module.solve(scene, settings, progress))
