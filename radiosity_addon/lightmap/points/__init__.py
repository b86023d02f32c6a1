"""Gather points: a few texels that light is gathered at, and interpolation between them.

Weights of a local linear fit in world space.
"""

from __future__ import annotations

from .interpolation import GatherPoints, Interpolation, fit
from .refitting import refit
from .smoothing import PASSES, Smoothing, alike_neighbors, choose_smoothing, columns

__all__ = [
    "PASSES",
    "GatherPoints",
    "Interpolation",
    "Smoothing",
    "alike_neighbors",
    "choose_smoothing",
    "columns",
    "fit",
    "refit",
]
