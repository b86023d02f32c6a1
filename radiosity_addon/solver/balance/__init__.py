"""Conservation of light: every leaf sends exactly the light it has.

Corrects visibilities that rays only estimate.
"""

from __future__ import annotations

from .conservation import Balance, Conservation, received_by_faces

__all__ = [
    "Balance",
    "Conservation",
    "received_by_faces",
]
