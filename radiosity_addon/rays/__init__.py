"""Casting rays at triangles: what a ray meets first, and whether two points see each other.

Embree does the work; only `embree.py` imports it.
"""

from __future__ import annotations

from .caster import NO_HIT, Hits, RayCaster, sees, surface_offset
from .embree import TARGET_SLACK, EmbreeCaster

__all__ = [
    "NO_HIT",
    "TARGET_SLACK",
    "EmbreeCaster",
    "Hits",
    "RayCaster",
    "sees",
    "surface_offset",
]
