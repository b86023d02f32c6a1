"""Gather points: a few texels that light is gathered at, and interpolation between them.

Weights of a local linear fit in world space.
"""

from __future__ import annotations

from .interpolation import GatherPoints, Interpolation, fit
from .refitting import refit

__all__ = [
    "GatherPoints",
    "Interpolation",
    "fit",
    "refit",
]
