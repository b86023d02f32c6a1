"""What of the light of texels stands after some triangles moved: only what they touch is traced again.

Everything else keeps what its rays met.
"""

from __future__ import annotations

from .affected import AffectedTexels
from .moved_light import texel_gains
from .moved_points import kept_points
from .moved_sub_cells import kept_cells
from .previous import PreviousLight, StandingHits

__all__ = [
    "AffectedTexels",
    "PreviousLight",
    "StandingHits",
    "kept_cells",
    "kept_points",
    "texel_gains",
]
