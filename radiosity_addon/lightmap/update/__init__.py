"""Texels lit again after some triangles moved: only what they touch is traced again.

Everything else keeps what its rays met.
"""

from __future__ import annotations

from .affected import Disturbance
from .moved import LitBefore, moved_steps

__all__ = [
    "Disturbance",
    "LitBefore",
    "moved_steps",
]
