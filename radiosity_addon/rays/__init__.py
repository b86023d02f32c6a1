"""Ray casting: the first triangle that a ray meets, and whether two points see each other.

Embree does the work; only `embree.py` imports it.
"""

from __future__ import annotations

from .caster import NO_HIT, SAGITTA, SIGHT_LIFT, Hits, RayCaster, free_segment, passing_light, surface_offset
from .embree import TARGET_SLACK, EmbreeCaster, embree_work
from .ray_count import RayCount, counted_apart

__all__ = [
    "NO_HIT",
    "SAGITTA",
    "SIGHT_LIFT",
    "TARGET_SLACK",
    "EmbreeCaster",
    "Hits",
    "RayCaster",
    "RayCount",
    "counted_apart",
    "embree_work",
    "free_segment",
    "passing_light",
    "surface_offset",
]
