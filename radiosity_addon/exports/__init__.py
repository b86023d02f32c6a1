"""Files for engines: HDR encodings, glTF with lightmaps, and the index that describes them.

Arrays and bytes only; `blender/exporting` makes the scene that is written.
"""

from __future__ import annotations

from .baked_light import emission_images
from .engine_files import static_files
from .glb import Glb, GlbError
from .half_exr import read_half_exr, write_half_exr
from .index_file import (
    INDEX_NAME,
    GroupEntry,
    LightmapIndex,
    NodeEntry,
    PageEntry,
    ViewSettings,
    lightmap_index,
)
from .ktx2 import read_ktx2, write_ktx2
from .lit_gltf import LIGHTMAP_CHANNEL, ExportedNames, emissive_only, with_lightmaps
from .pages import resampled
from .png8 import png_of_linear, srgb_of_linear
from .rgbm import decode_rgbm, encode_rgbm, write_rgbm
from .shared_exponent import decode_rgb9e5, encode_rgb9e5
from .shared_meshes import LightmapPlace, share_meshes
from .web_page import viewer_page

__all__ = [
    "INDEX_NAME",
    "LIGHTMAP_CHANNEL",
    "ExportedNames",
    "Glb",
    "GlbError",
    "GroupEntry",
    "LightmapIndex",
    "LightmapPlace",
    "NodeEntry",
    "PageEntry",
    "ViewSettings",
    "decode_rgb9e5",
    "decode_rgbm",
    "emission_images",
    "emissive_only",
    "encode_rgb9e5",
    "encode_rgbm",
    "lightmap_index",
    "png_of_linear",
    "read_half_exr",
    "read_ktx2",
    "resampled",
    "share_meshes",
    "srgb_of_linear",
    "static_files",
    "viewer_page",
    "with_lightmaps",
    "write_half_exr",
    "write_ktx2",
    "write_rgbm",
]
