"""Texels lit again after some triangles moved: only what they touch is traced again.

Everything else keeps what its rays met.
"""

from __future__ import annotations

from .affected import AffectedTexels
from .moved import PreviousLight, light_after_move

__all__ = [
    "AffectedTexels",
    "PreviousLight",
    "light_after_move",
]
