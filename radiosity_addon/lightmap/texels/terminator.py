"""Shadow rays of smooth surfaces start on the surface that the normals describe, as in Cycles.

A coarse mesh that is shaded smooth is lit past the planes of its triangles, where they and their
neighbors lie in their own shadow: a jagged terminator. Near it rays start above the triangle, on
the curved patch through its corners (a parabola over each edge).
"""

from __future__ import annotations

from copy import copy

import numpy as np

from ...numerics import Array, weights_at
from .texel_geometry import TexelGeometry

CUTOFF = 0.1
"""The cosine below which rays are lifted, Blender's default of *Shadow Terminator Geometry Offset*;
between this and its double the lift sets in."""

_FLAT = 1e-9
"""Normals that turn by less over a triangle, relative to its edges, are those of a flat one."""


class SmoothLift:
    """Lifts the starts of shadow rays off the texels of smooth triangles."""

    def __init__(self, geometry: TexelGeometry) -> None:
        corners, normals = geometry.triangles, geometry.normals
        # In the order (2 − 0, 2 − 1, 1 − 0): how much the normals open along each edge.
        edges = [(corners[:, i] - corners[:, j], normals[:, i] - normals[:, j]) for i, j in _EDGES]
        opening = np.stack([np.einsum("tk,tk->t", edge, turn) for edge, turn in edges], axis=1)
        length = np.stack([np.einsum("tk,tk->t", edge, edge) for edge, _ in edges], axis=1)
        self._opening = np.where(np.abs(opening) > _FLAT * np.sqrt(length), opening, 0.0)
        """(t, 3) [m]: four times the height of the parabola over the middle of each edge"""
        self._geometry = geometry
        self._smooth = (self._opening > 0).any(axis=1)
        self._texels: Array | None = None

    @property
    def heights(self) -> Array:
        """(t,) float64: rays from triangles are lifted no more than this [m]."""
        return np.asarray(0.25 * np.maximum(self._opening, 0.0).sum(axis=1))

    def of(self, chosen: Array) -> SmoothLift:
        """Return the lifts of the starts of selected texels' rays, numbered among these."""
        lift = copy(self)
        lift._texels = chosen if self._texels is None else self._texels[chosen]
        return lift

    def __call__(self, texels: Array, starts: Array, directions: Array) -> Array:
        """Return where rays start instead.

        texels (r,) int.
        starts (r, k, 3): Points of the texels' triangles.
        directions (r, k, 3): Unit, toward the lamp.
        """
        texels = texels if self._texels is None else self._texels[texels]
        # The points of a shared texel lie on other triangles, too.
        smooth = self._smooth[self._geometry.triangle[texels]] & ~self._geometry.is_shared(texels)
        rows = np.flatnonzero(smooth)
        if len(rows) == 0:
            return starts
        texel = texels[rows]
        triangle = self._geometry.triangle[texel]
        weights = np.clip(weights_at(self._geometry.triangles[triangle], starts[rows]), 0.0, 1.0)
        first, second, third = weights[..., 0], weights[..., 1], weights[..., 2]
        over = self._opening[triangle]
        height = over[:, :1] * first * third + over[:, 1:2] * second * third + over[:, 2:] * first * second
        shading = np.einsum("rkc,rcd->rkd", weights, self._geometry.normals[triangle])
        shading /= np.maximum(np.linalg.norm(shading, axis=2, keepdims=True), 1e-12)
        along = directions[rows]
        above_plane = np.einsum("rkd,rd->rk", along, self._geometry.surface_normal[texel])
        above_patch = np.einsum("rkd,rkd->rk", along, shading)
        near = above_patch < CUTOFF
        amount = np.where(near, 2.0 - (above_plane + above_patch) / CUTOFF, 1.0 - above_plane / CUTOFF)
        lift = np.clip(amount, 0.0, 1.0) * np.maximum(height, 0.0)
        lifted = starts.copy()
        lifted[rows] += lift[..., None] * shading
        return lifted


_EDGES = ((2, 0), (2, 1), (1, 0))
