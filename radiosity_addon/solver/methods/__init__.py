"""The solvers, one a file, one interface: `solve_steps(scene, settings)` yields (fraction, state)."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import cast

from ...scene import Scene
from ..settings import SolverSettings
from ..state import SolverState
from .hierarchical import HierarchicalState

__all__ = ["HierarchicalState", "steps_of"]


def steps_of(scene: Scene, settings: SolverSettings) -> Iterator[tuple[float, SolverState]]:
    """Begin to solve by the method the settings name.

    Yields the fraction done and the state, which is the same object all along; the last one
    is the solution.
    """
    module = import_module("." + settings.method.replace("-", "_"), __name__)
    return cast(Iterator[tuple[float, SolverState]], module.solve_steps(scene, settings))
