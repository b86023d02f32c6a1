"""Light at texels, of a bake, after a move, and for other strengths of the lights.

Needs a solved scene.
"""

from __future__ import annotations

from .accuracy import light_within
from .error_picture import residual_summary, texel_residual
from .partial_light import LightSoFar
from .reconstruction import light_texels, lit_as_texels
from .relighting import estimated_error, kept_bytes, relight_texels

__all__ = [
    "LightSoFar",
    "estimated_error",
    "kept_bytes",
    "light_texels",
    "light_within",
    "lit_as_texels",
    "relight_texels",
    "residual_summary",
    "texel_residual",
]
