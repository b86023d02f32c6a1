"""Cut-outs in one place: a ray that meets one of them meets them all.

A ray that passes a cut-out continues slightly behind it, and so misses other surfaces in the same place.
`Stacks` lists these, the outermost first.
"""

from __future__ import annotations

import numpy as np

from ..numerics import Array
from ..rays import Hits
from .layers import MOST_COVERS, Layers, PolygonRuns
from .scene import Scene


class Stacks:
    """Coincident cut-outs.

    scene: With images.
    met (t,) bool: The triangles that rays meet.
    """

    def __init__(self, scene: Scene, met: Array) -> None:
        assert scene.images is not None
        self._layers: Layers = scene.layers
        covers = self._layers.covers
        thin = met & scene.images.cut_out
        rows = np.flatnonzero(thin[covers.side // 2] & thin[covers.by // 2])
        covers = covers.take(rows)
        # Each pair both ways. Where the two face opposite ways, corners run clockwise on the cover.
        side = np.concatenate([covers.side, covers.by])
        order = np.argsort(side, kind="stable")
        turned = (covers.side ^ covers.by) & 1 == 1
        in_cover = np.where(turned[:, None, None], covers.in_cover[:, ::-1], covers.in_cover)
        part = np.concatenate([covers.part, in_cover])[order]
        self._other = np.concatenate([covers.by, covers.side])[order]
        self._parts = PolygonRuns(np.searchsorted(side[order], np.arange(2 * len(scene) + 1)), part)
        self._depth = _depths(covers.side, covers.by, 2 * len(scene))

    def __bool__(self) -> bool:
        return len(self._other) > 0

    def through(self, hits: Hits) -> tuple[Array, Hits]:
        """Return all cut-outs at the hits of n rays: (m,) the ray, sorted, and m hits."""
        ray = np.arange(len(hits.triangle))
        side = 2 * hits.triangle.astype(np.int64) + ~hits.front
        place = hits.barycentric.astype(np.float64)
        hit_row, part = self._parts.holding(side, place)
        if len(hit_row) == 0:
            return ray, hits
        other = self._other[part]
        points = self._layers.points(side[hit_row], place[hit_row])
        all_sides, all_rays = np.concatenate([side, other]), np.concatenate([ray, hit_row])
        order = np.lexsort((self._depth[all_sides], all_rays))
        ray, side = all_rays[order], all_sides[order]
        weights = np.concatenate([place, self._layers.weights(other, points)])[order]
        found = Hits(
            (side // 2).astype(np.int32), weights.astype(np.float32), side % 2 == 0, hits.distance[ray]
        )
        return ray, found


def _depths(side: Array, by: Array, count: int) -> Array:
    """Return (count,) how many covers lie on each side at most, one on the other."""
    depth = np.zeros(count, dtype=np.int64)
    for _ in range(MOST_COVERS):
        deeper = depth.copy()
        np.maximum.at(deeper, side, depth[by] + 1)
        if np.array_equal(deeper, depth):
            break
        depth = deeper
    return depth
