"""The settings of a method of solving.

One frozen record for all methods.
"""

from __future__ import annotations

from .solver_settings import SolverSettings

__all__ = [
    "SolverSettings",
]
