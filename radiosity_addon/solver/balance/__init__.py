"""Conservation of light: every leaf sends exactly the light it has."""

from __future__ import annotations

from .conservation import Conservation
from .link_sums import received_by_faces

__all__ = [
    "Conservation",
    "received_by_faces",
]
