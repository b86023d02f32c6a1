"""Conservation of light: every leaf sends out what it has, no more and no less.

Corrects visibilities that rays only estimate.
"""

from __future__ import annotations

from .conservation import Balance, Conservation, received_by_faces

__all__ = [
    "Balance",
    "Conservation",
    "received_by_faces",
]
