"""What of the light of texels stands after some triangles moved: only what they touch is traced again.

Everything else keeps what its rays met.
"""

from __future__ import annotations

from .affected import AffectedTexels
from .previous import PreviousLight, StandingHits

__all__ = [
    "AffectedTexels",
    "PreviousLight",
    "StandingHits",
]
