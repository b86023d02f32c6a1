"""Gather points: a few texels that light is gathered at, and interpolation between them.

Weights of a local linear fit in world space.
"""

from __future__ import annotations

from .interpolation import LIFT, SAGITTA, GatherPoints, Interpolation, fit_steps, refit

__all__ = [
    "LIFT",
    "SAGITTA",
    "GatherPoints",
    "Interpolation",
    "fit_steps",
    "refit",
]
