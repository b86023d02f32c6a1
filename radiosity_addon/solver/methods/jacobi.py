"""Jacobi iteration: all elements gather at once from the previous radiosities (handout §3.4.1, (3.35))."""

from __future__ import annotations

from collections.abc import Iterator

from ...base import SILENT, Progress
from ...numerics import Array
from ...scene import Scene
from ..equations import LinearSystem
from ..settings import SolverSettings
from ..state import SolverState
from .matrix import Iterate, solve_matrix


def jacobi(system: LinearSystem, start: Array | None = None) -> Iterator[Iterate]:
    """Iterate B_i ← (E_i − Σ_{j≠i} K_ij B_j) / K_ii endlessly.

    K_ii divides the whole, E_i included (the handout's (3.35) divides the sum alone, which is
    right only where K_ii = 1). Written with the residual r = E − K B it is B ← B + r / K_ii.

    start (n, 3): None starts from B = E: then iteration k holds the light of k bounces.
    Yields radiosity (n, 3): Iteration 0 is the start; an array of its own each time.
    Yields residual (3,): Its Σ A |E − K B| [W].
    """
    diagonal = system.diagonal()
    radiosity = system.emission if start is None else start
    while True:
        residual = system.residual(radiosity)
        yield radiosity, system.area @ abs(residual)
        radiosity = radiosity + residual / diagonal


def solve(scene: Scene, settings: SolverSettings, progress: Progress = SILENT) -> SolverState:
    """Return the solved state; `progress` receives it on the way."""
    return solve_matrix(scene, settings, progress, jacobi, copies=2)
