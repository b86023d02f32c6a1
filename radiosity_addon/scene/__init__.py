"""The solver's input: triangles with reflectance, emission and textures, and lamps.

Also which of several surfaces in one place counts, and rays that pass through cut-outs.
"""

from __future__ import annotations

from .bake_scene import LIGHTMAP_UV_LAYER, BakeObject, BakeScene, LevelOfDetail
from .closed_solids import closed_parts, places, sealed_backs, wound_parts
from .coincident_faces import coincident_triangles
from .faces import Faces
from .inside_out_parts import inside_out
from .opacity import ray_caster
from .overlaps import OVERLAP, arriving, shares
from .scene import Scene
from .texture_hash import Glow, glow_pattern, same_glow, texture_digest
from .textures import CHANNELS, SurfaceImages, where_there

__all__ = [
    "CHANNELS",
    "LIGHTMAP_UV_LAYER",
    "OVERLAP",
    "BakeObject",
    "BakeScene",
    "Faces",
    "Glow",
    "LevelOfDetail",
    "Scene",
    "SurfaceImages",
    "arriving",
    "closed_parts",
    "coincident_triangles",
    "glow_pattern",
    "inside_out",
    "places",
    "ray_caster",
    "same_glow",
    "sealed_backs",
    "shares",
    "texture_digest",
    "where_there",
    "wound_parts",
]
