"""Triangles that lie in the same place as others, where Cycles' bake is black.

A ray of Cycles' bake starts on its surface, and meets a face in the same place at once. Our rays do not, so
lightmaps hold the light each face would get alone. Solids that rest on a surface are not counted: their
contact is dark in both.
"""

from __future__ import annotations

import numpy as np

from ..numerics import Array
from .layers import ONE_PLANE
from .scene import Scene


def coincident_triangles(scene: Scene) -> Array:
    """Return (t,) bool: triangles whose fronts are baked as if alone, though another face is in their place.

    Of faces one above the other, within the tolerance of `coincident_pairs`, the lower ones.
    """
    found = np.zeros(len(scene), dtype=bool)
    covers = scene.layers.covers
    # Backs cover fronts only where a solid rests on something.
    covers = covers.take(np.flatnonzero(covers.by % 2 == 0))
    if len(covers) == 0:
        return found
    side, by = covers.side, covers.by
    middle = scene.layers.points(side, covers.part.mean(axis=1))
    apart = middle - scene.layers.points(by, covers.in_cover.mean(axis=1))
    height = np.abs(np.einsum("nk,nk->n", apart, scene.face_normals[by // 2]))
    allowed = np.maximum(scene.layers.tolerance[side // 2], scene.layers.tolerance[by // 2])
    found[side[(side % 2 == 0) & (height <= allowed)] // 2] = True
    one_plane = height <= ONE_PLANE * allowed
    found[by[one_plane] // 2] = True
    found[side[one_plane] // 2] = True
    return found
