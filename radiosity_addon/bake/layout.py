"""Where the objects of a bake lie on pages: density, padding, and glass, which gets no texels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base import Progress
from ..lightmap.unwrap import Atlas, AtlasInput, AtlasObject, AtlasOptions, Limits, build_atlas, padding_for
from ..numerics import Array, numbered
from ..options import BakeSettings
from ..scene import BakeObject, BakeScene
from .importance import scales_of, thinned_out

COLORS = 4.0
"""Triangles share texels if they emit alike, and their reflectances are alike in units of a quarter."""


def lay_out(
    bake_scene: BakeScene, baked: list[BakeObject], settings: BakeSettings, progress: Progress
) -> Atlas:
    """Lay the objects' charts out on pages."""
    scene, scales = bake_scene.scene, scales_of(bake_scene, baked, settings)
    looks = np.column_stack((np.rint(COLORS * scene.reflectance), scene.emission))
    kind = numbered(looks)
    inputs = [
        _to_lay_out(item, scene.triangles[item.rows], item.texel_scale * scale, kind[item.rows])
        for item, scale in zip(baked, scales, strict=True)
    ]
    options = AtlasOptions(
        settings.resolution,
        settings.texel_density,
        settings.atlas == "shared",
        settings.pages,
        Limits(settings.max_resolution, padding(settings)),
        settings.unwrap_seconds,
        settings.threads,
        settings.pack == "rectangles" and settings.atlas == "shared",
    )
    atlas = build_atlas(inputs, options, progress)
    texels = [
        float(scene.areas[item.rows][item.lit].sum()) * (item.texel_scale * scale) ** 2
        for item, scale in zip(baked, scales, strict=True)
    ]
    thinned = thinned_out([item.name for item in baked], scales, texels)
    placed = [_with_glass(item, each) for item, each in zip(baked, atlas.objects, strict=True)]
    return replace(atlas, objects=tuple(placed), warnings=(*thinned, *atlas.warnings))


def _to_lay_out(item: BakeObject, triangles: Array, scale: float, kind: Array) -> AtlasInput:
    """Return what gets texels of an object."""
    polygon, uv = item.polygon, item.uv
    if item.glass is not None:
        uv = None if uv is None else uv[item.lit]
        triangles, polygon, kind = triangles[item.lit], polygon[item.lit], kind[item.lit]
    return AtlasInput(item.name, triangles, polygon, uv, scale, kind, item.page)


def _with_glass(item: BakeObject, placed: AtlasObject) -> AtlasObject:
    """Return where all triangles of an object lie: glass where it was, or nowhere."""
    if item.glass is None:
        return placed
    uv = np.zeros((item.count, 3, 2), dtype=np.float32) if item.uv is None else item.uv.copy()
    uv[item.lit] = placed.uv
    return replace(placed, uv=uv)


def padding(settings: BakeSettings) -> int:
    """Return the free texels between charts."""
    return padding_for(settings.mip_levels) if settings.padding is None else settings.padding
