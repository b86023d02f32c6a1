"""Light at texels: direct light, gather points, and sweeps along stored hits.

Needs a solved scene; traces each ray once.
"""

from __future__ import annotations

from .accuracy import light_within
from .error_picture import residual_summary, texel_residual
from .gather_links import StoredLinks
from .gather_settings import GatherSettings
from .part_links import HitNumbers, PartHits, PartLinks, Parts, gather_parts, lit_footprints
from .partial_light import LightSoFar
from .reconstruction import STARTS, gather_at, gather_footprints, on_lattice, reconstruct, resolver, sample_of
from .relighting import kept_bytes, relight_texels
from .sweeps import LitTexels, TexelLight, TexelTransport, sweep
from .traced_texels import GatherPointLayout, LightingRecord
from .warm_start import EarlierLight

__all__ = [
    "STARTS",
    "EarlierLight",
    "GatherPointLayout",
    "GatherSettings",
    "HitNumbers",
    "LightSoFar",
    "LightingRecord",
    "LitTexels",
    "PartHits",
    "PartLinks",
    "Parts",
    "StoredLinks",
    "TexelLight",
    "TexelTransport",
    "gather_at",
    "gather_footprints",
    "gather_parts",
    "kept_bytes",
    "light_within",
    "lit_footprints",
    "on_lattice",
    "reconstruct",
    "relight_texels",
    "residual_summary",
    "resolver",
    "sample_of",
    "sweep",
    "texel_residual",
]
