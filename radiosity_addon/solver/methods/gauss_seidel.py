"""Gauss–Seidel iteration: each element gathers the newest radiosities (handout §3.4.1, (3.36))."""

from __future__ import annotations

from collections.abc import Iterator

from ...base import SILENT, Progress
from ...numerics import Array
from ...scene import Scene
from ..equations import LinearSystem
from ..settings import SolverSettings
from ..state import SolverState
from .matrix import Iterate, solve_matrix


def gauss_seidel(system: LinearSystem, start: Array | None = None) -> Iterator[Iterate]:
    """Iterate B_i ← (E_i − Σ_{j≠i} K_ij B_j) / K_ii endlessly, with values already updated in this sweep.

    One row's update is gathering light to one element. See `jacobi.jacobi` for what is yielded.

    start (n, 3): None starts from B = E.
    """
    radiosity = (system.emission if start is None else start).copy()
    while True:
        yield radiosity.copy(), system.residual_power(radiosity)
        sweep(system, radiosity)


def sweep(system: LinearSystem, radiosity: Array) -> None:
    """Update every row once, in order, in place; the three channels together."""
    diagonal = system.diagonal()
    # ρ_i / A_i, so that a row costs one product with T.
    scale = system.reflectance / system.area[:, None]
    for row in range(len(system)):
        residual = system.emission[row] + scale[row] * (system.exchange[row] @ radiosity)
        residual -= radiosity[row] if system.mass is None else system.mass[row] @ radiosity
        radiosity[row] += residual / diagonal[row]


def solve(scene: Scene, settings: SolverSettings, progress: Progress = SILENT) -> SolverState:
    """Return the solved state; `progress` receives it on the way."""
    return solve_matrix(scene, settings, progress, gauss_seidel, copies=2)
