"""The sides of a scene's triangles that take part in the light."""

from __future__ import annotations

import numpy as np

from ..numerics import Array
from .scene import Scene
from .uncovered_parts import OwnParts

NO_FACE = -1


class Faces:
    """The f sides of the scene's triangles that take part: fronts first, then backs.

    Triangles without area, or out of the bounces, have no faces. Backs exist where `two_sided`, except those
    that are left out.

    left_out (t,) bool: Backs that no light reaches, as from `Scene.sealed`; None for none.
    """

    STORED = ("triangle", "normal", "center", "area")

    def __init__(self, scene: Scene, left_out: Array | None = None) -> None:
        solid = np.flatnonzero((scene.areas > 0) & scene.in_bounces)
        self.left_out = np.zeros(len(scene), dtype=bool) if left_out is None else left_out
        """(t,) bool"""
        has_back = scene.two_sided[solid] & ~self.left_out[solid]
        self.has_black_backs = not bool(has_back.all())
        """Whether rays may end on backs without a face: below a solid that stands on a floor, too"""
        backs = solid[has_back]
        self.triangle = np.concatenate([solid, backs]).astype(np.int32)
        """(f,) int32"""
        self.front = np.arange(len(self.triangle)) < len(solid)
        """(f,) bool"""
        # A scene of which every front takes part, and no back, is not stored a second time.
        rows: slice | Array = slice(None) if len(solid) == len(scene) and not len(backs) else self.triangle
        corners = scene.triangles[rows]
        if len(backs):
            corners[len(solid) :] = corners[len(solid) :, [0, 2, 1]]
        self.corners = corners
        """(f, 3, 3) float64, counter-clockwise as seen from the side's own half-space"""
        self.center = corners.mean(axis=1)
        """(f, 3) float64: the centroids [m]"""
        normal = scene.face_normals[rows]
        if len(backs):
            normal[len(solid) :] *= -1.0
        self.normal = normal
        """(f, 3) float64"""
        self.area = scene.areas[rows]
        """(f,) float64 [m²]"""
        self.reflectance = scene.reflectance[rows]
        """(f, 3) float64"""
        self.exitance = scene.emission[rows]
        """(f, 3) float64 [W/m²]: what a face emits where nothing covers it"""
        self.emission = self.exitance
        """(f, 3) float64 [W/m²]"""
        self.opacity = scene.opacity[rows]
        """(f,) float64: reflectance and emission are already multiplied by it. What other faces cover
        counts as cut out (`layers.py`)"""
        self.own: OwnParts | None = None
        """What covers leave of the scene's sides; None without any."""
        if scene.layers:
            self.own = scene.layers.own
            share = self.own.share_of(self.side)
            self.reflectance = self.reflectance * share[:, None]
            self.emission = self.exitance * share[:, None]
            self.opacity = self.opacity * share
        self.of_triangle = np.full((2, len(scene)), NO_FACE, dtype=np.int32)
        """(2, t) int32: the face of each triangle's front (row 0) and back (row 1), or −1"""
        self.of_triangle[0, solid] = np.arange(len(solid))
        self.of_triangle[1, backs] = np.arange(len(solid), len(self.triangle))

    def __len__(self) -> int:
        return len(self.triangle)

    @property
    def side(self) -> Array:
        """(f,) int: 2 t for the front of triangle t, 2 t + 1 for its back."""
        return np.asarray(2 * self.triangle.astype(np.int64) + ~self.front)
