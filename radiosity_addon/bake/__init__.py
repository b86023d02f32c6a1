"""The bake: unwrap, rasterize, solve, light the texels, encode. Plain arrays, no Blender.

`pipeline.py` reads as prose.
"""

from __future__ import annotations

from .bake_warnings import coincident_counts, of_coincident
from .estimate import Estimate, LightmappedObject, estimate_bake, refuse_bake
from .importance import may_thin_out, thinned_out
from .keep import Baking, KeepOptions, can_keep, run_pipeline
from .plan import SHORT, BakeDigests, BakePlan, RememberedLightmap, ShownBake, plan_bake
from .scene_memory import refuse_many_triangles
from .stages import timed
from .texel_memory import pages_of, process_bytes, refuse_large_pages
from .turned_faces import of_inside_out

__all__ = [
    "SHORT",
    "BakeDigests",
    "BakePlan",
    "Baking",
    "Estimate",
    "KeepOptions",
    "LightmappedObject",
    "RememberedLightmap",
    "ShownBake",
    "can_keep",
    "coincident_counts",
    "estimate_bake",
    "may_thin_out",
    "of_coincident",
    "of_inside_out",
    "pages_of",
    "plan_bake",
    "process_bytes",
    "refuse_bake",
    "refuse_large_pages",
    "refuse_many_triangles",
    "run_pipeline",
    "thinned_out",
    "timed",
]
