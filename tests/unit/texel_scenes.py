"""Hand-made scenes with lightmap coordinates, and objects to bake, without Blender."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from radiosity_addon.lightmap.texels.rasterization import rasterize
from radiosity_addon.lightmap.texels.texel_geometry import TexelGeometry
from radiosity_addon.scene.bake_scene import BakeObject, BakeScene
from radiosity_addon.solver import Scene

QUAD_UV = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], dtype=np.float32)
"""UVs of the two triangles of one `rectangle`, over the unit square."""


def in_cell(low: Sequence[float], high: Sequence[float]) -> np.ndarray:
    """Return (2, 3, 2) UVs of a rectangle in part of the page."""
    low, high = np.asarray(low, dtype=np.float32), np.asarray(high, dtype=np.float32)
    return np.asarray(low + QUAD_UV * (high - low), dtype=np.float32)


def texel_geometry(
    scene: Scene, uv: np.ndarray, resolution: int, pages: np.ndarray | None = None
) -> TexelGeometry:
    """Rasterize a scene; `pages` is each triangle's page, −1 for none, all on one by default."""
    pages = np.zeros(len(scene), dtype=np.int32) if pages is None else np.asarray(pages, dtype=np.int32)
    rows = [np.flatnonzero(pages == page) for page in range(int(pages.max()) + 1)]
    return TexelGeometry(scene, uv, pages, [rasterize(uv[of], resolution) for of in rows], rows)


def bake_object(
    name: str, first: int, count: int, uv: np.ndarray | None = None, bake: bool = True
) -> BakeObject:
    """One object of `count` triangles, two to a polygon."""
    loops = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return BakeObject(name, first, count, bake, np.arange(count, dtype=np.int32) // 2, loops, uv)


def bake_scene(scene: Scene, *parts: tuple[Any, ...]) -> BakeScene:
    """Make a BakeScene of (name, count[, uv[, bake]]) parts that follow each other."""
    objects, first = [], 0
    for name, count, *rest in parts:
        objects.append(bake_object(name, first, count, *rest))
        first += count
    assert first == len(scene)
    return BakeScene(scene, tuple(objects))
