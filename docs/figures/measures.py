"""Solving for figures: one state or solution by any method, and what is asserted of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from radiosity_addon.solver import Scene, SolverSettings, SolverState, solve
from radiosity_addon.solver.equations.assembly import galerkin
from radiosity_addon.solver.equations.fixed_elements import subdivide_evenly
from radiosity_addon.solver.equations.linear_system import LinearSystem
from radiosity_addon.solver.state.state import begin


def solved(scene: Scene, **settings: Any) -> SolverState:
    """Solve a scene and return the final state; `settings` are fields of `SolverSettings`."""
    return solve(scene, SolverSettings(**settings)).local_pass.elements.state


def assembled(scene: Scene, elements: int) -> LinearSystem:
    """Return the Galerkin system of a scene on about that many elements."""
    state = begin(scene, SolverSettings(), SolverState)
    subdivide_evenly(state.hierarchy, elements)
    return galerkin(state.hierarchy, state.caster)


def leaf_mean(state: SolverState, values: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return the (3,) area mean of (e, 3) element values over the leaves of the chosen triangles."""
    leaves = state.hierarchy.leaves
    triangle = state.hierarchy.faces.triangle[state.hierarchy.face[leaves]]
    leaves = leaves[np.isin(triangle, np.flatnonzero(chosen))]
    area = state.hierarchy.area[leaves]
    return np.asarray(area @ values[leaves] / area.sum())


def order(x: Any, y: Any) -> float:
    """Return the exponent p of y ~ x^p, by least squares of the logarithms."""
    return float(np.polyfit(np.log(np.asarray(x, dtype=float)), np.log(np.asarray(y, dtype=float)), 1)[0])
