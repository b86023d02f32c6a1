"""Coarser levels of detail: they show the lightmap of the finest one, and have no texels of their own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lightmap.unwrap import uvs_of_level
from ..numerics import Array, TriangleTree
from ..scene import BakeObject, BakeScene, LevelOfDetail
from .result import BakedObject

SAMPLES = 256
"""Triangles by which it is found whether levels lie in one place, or side by side."""

CLEARLY_NEARER = 0.5
"""A level is moved if that brings it this much nearer: what is symmetric is as near when it is mirrored."""


def with_levels(bake_scene: BakeScene, baked: Sequence[BakedObject]) -> tuple[BakedObject, ...]:
    """Return baked objects, followed by the coarser levels of them."""
    by_name = {each.object.name: each for each in baked}
    found = []
    for item in bake_scene.levels:
        assert item.level is not None
        base = by_name.get(item.level.base)
        if base is not None and len(item.level.triangles):
            uv = _level_uv(bake_scene, item.level, base)
            found.append(BakedObject(item, uv, base.page, base.density, 0.0))
    return (*baked, *found)


def _level_uv(bake_scene: BakeScene, level: LevelOfDetail, base: BakedObject) -> Array:
    item: BakeObject = base.object
    shown = item.lit & (bake_scene.scene.areas[item.rows] > 0)
    if not shown.any():
        shown = np.ones(item.count, dtype=bool)
    surface = bake_scene.scene.triangles[item.rows][shown]
    placed, order = _placed(level, surface)
    uv = uvs_of_level(placed[:, order], level.polygon, surface, base.uv[shown])
    return np.ascontiguousarray(uv[:, order])


def _placed(level: LevelOfDetail, surface: Array) -> tuple[Array, slice]:
    """Return a level's triangles where its base is: as they are, or moved there if that is clearly nearer.

    Returns also the order of their corners in which they face outward, which a mirror turns around.
    """
    as_they_are, turned = slice(None), slice(None, None, -1)
    moved = level.triangles @ level.to_base[:3, :3].T + level.to_base[:3, 3]
    if np.allclose(moved, level.triangles):
        return level.triangles, as_they_are
    some = np.linspace(0, len(moved) - 1, min(len(moved), SAMPLES)).astype(np.int64)
    tree = TriangleTree(surface)
    away = [tree.nearest(each[some].mean(axis=1))[2].mean() for each in (level.triangles, moved)]
    if away[1] >= CLEARLY_NEARER * away[0]:
        return level.triangles, as_they_are
    return moved, turned if np.linalg.det(level.to_base[:3, :3]) < 0.0 else as_they_are
