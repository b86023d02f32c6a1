"""Direct solution: Gaussian elimination, the reference for all other methods (handout §3.4)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...base import SILENT, BakeError, Progress
from ...numerics import Array
from ...scene import Scene
from ..equations import LinearSystem
from ..settings import SolverSettings
from ..state import SolverState
from .matrix import Iterate, solve_matrix


def dense(system: LinearSystem) -> Array:
    """Solve K B = E exactly, up to rounding.

    Returns radiosity (n, 3) [W/m²].
    Raises BakeError if K is singular: a closed part of the scene reflects all light.
    """
    radiosity = np.empty((len(system), 3))
    solved = np.zeros(3, dtype=bool)
    for channel in range(3):
        if solved[channel]:
            continue
        # Channels of the same reflectance have the same matrix.
        same = (system.reflectance == system.reflectance[:, channel, None]).all(axis=0) & ~solved
        try:
            radiosity[:, same] = np.linalg.solve(system.matrix(channel), system.emission[:, same])
        except np.linalg.LinAlgError:
            raise BakeError(
                "the radiosity matrix is singular: a closed room of reflectance 1 never loses its light; "
                "lower the reflectance"
            ) from None
        solved |= same
    return radiosity


def iterates(system: LinearSystem) -> Iterator[Iterate]:
    """Yield (B, Σ A |E − K B|) once: there is nothing to iterate."""
    radiosity = dense(system)
    yield radiosity, system.residual_power(radiosity)


def solve(scene: Scene, settings: SolverSettings, progress: Progress = SILENT) -> SolverState:
    """Return the solved state; `progress` receives it on the way."""
    return solve_matrix(scene, settings, progress, iterates, copies=3)
