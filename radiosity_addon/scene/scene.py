"""The solver's input: triangles with diffuse reflectance and emission, and lamps."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from functools import cached_property

import numpy as np

from ..base import SceneError
from ..lights import Light
from ..numerics import MAX_REFLECTANCE, WHOLE_TRIANGLE, Array, double_area_vectors
from .closed_solids import sealed_backs
from .layers import Layers
from .textures import SurfaceImages


class Scene:
    """Triangles that reflect, emit and block light, and the lamps that light them.

    triangles (t, 3, 3): World-space corners [m]; counter-clockwise order is seen from the front.
    reflectance (t, 3): Diffuse reflectance in [0, 1], linear RGB; clamped to `MAX_REFLECTANCE`.
    emission (t, 3): Self-emitted exitance of each emitting side [W/m²], linear RGB.
    two_sided bool or (t,) bool: True: the back receives, reflects and emits too, separately from the front.
        False: the back is black and blocks.
    normals (t, 3, 3): Unit shading normals at the corners; None for flat shading.
    images: Reflectance, emission and opacity of textured triangles in detail; their rows of `reflectance` and
        `emission` become the area means, opacity multiplied in.
    in_bounces, in_shadows bool or (t,) bool: Whether triangles meet the light that surfaces and sky send, and
        whether they stop that of lamps. Out of bounces a triangle is lit but neither reflects nor emits.
    Raises SceneError if shapes do not match, or a value is NaN, infinite or negative.
    """

    def __init__(
        self,
        triangles: Array,
        reflectance: Array,
        emission: Array,
        two_sided: bool | Array = False,
        lights: Sequence[Light] = (),
        normals: Array | None = None,
        images: SurfaceImages | None = None,
        in_bounces: bool | Array = True,
        in_shadows: bool | Array = True,
    ) -> None:
        self.triangles = np.ascontiguousarray(triangles, dtype=np.float64)
        if self.triangles.ndim != 3 or self.triangles.shape[1:] != (3, 3):
            raise SceneError(f"triangles have shape {self.triangles.shape}; (t, 3, 3) is needed")
        count = len(self.triangles)
        self.reflectance = np.minimum(_rgb_rows("reflectance", reflectance, count), MAX_REFLECTANCE)
        self.emission = _rgb_rows("emission", emission, count)
        self.two_sided = _flags("two_sided", two_sided, count)
        self.in_bounces = _flags("in_bounces", in_bounces, count)
        self.in_shadows = _flags("in_shadows", in_shadows, count)
        self.lights = tuple(lights)
        if not np.isfinite(self.triangles).all():
            row = int(np.flatnonzero(~np.isfinite(self.triangles).all(axis=(1, 2)))[0])
            raise SceneError(f"triangle {row} has a corner that is NaN or infinite")

        cross = double_area_vectors(self.triangles)
        double_area = np.linalg.norm(cross, axis=1)
        self.areas = 0.5 * double_area
        """(t,) float64 [m²]"""
        self.face_normals = cross / np.maximum(double_area, np.finfo(float).tiny)[:, None]
        """(t, 3) float64, unit; zero for a triangle without area"""
        if normals is None:
            self.normals = np.broadcast_to(self.face_normals[:, None, :], self.triangles.shape)
        else:
            self.normals = np.ascontiguousarray(normals, dtype=np.float64)
            if self.normals.shape != self.triangles.shape:
                raise SceneError(f"normals have shape {self.normals.shape}; {self.triangles.shape} is needed")
            if not np.isfinite(self.normals).all():
                raise SceneError("normals hold a value that is NaN or infinite")
        """(t, 3, 3) float64: shading normals at the corners"""
        self.images = images
        self.opacity = np.ones(count)
        """(t,) float64: area means"""
        if images is not None:
            self._average(images)

    @cached_property
    def layers(self) -> Layers:
        """The sides that coincident sides cover."""
        return Layers(self)

    def with_lights(self, lights: Sequence[Light]) -> Scene:
        """Return the same triangles with other lights of the same kinds in the same places."""
        scene = copy(self)
        scene.lights = tuple(lights)
        return scene

    @property
    def solid(self) -> Array:
        """(t,) bool: what stops all light."""
        solid = self.in_bounces & self.in_shadows
        return solid if self.images is None else solid & ~self.images.cut_out

    @cached_property
    def sealed(self) -> Array:
        """(t,) bool: backs inside closed, opaque solids: no light reaches them, and nobody sees them."""
        emits = self.emission.any(axis=1)
        return sealed_backs(self.triangles, self.solid, emits, self.lights) & self.two_sided

    def _average(self, images: SurfaceImages) -> None:
        """Use the images' area means as constants of the textured triangles."""
        if len(images) != len(self):
            raise SceneError(f"the surface images are of {len(images)} triangles; there are {len(self)}")
        rows = np.flatnonzero(images.textured)
        means = images.area_means(rows, np.broadcast_to(WHOLE_TRIANGLE, (len(rows), 3, 2)))
        self.reflectance[rows], self.emission[rows] = means[:, :3], means[:, 3:6]
        self.opacity[rows] = means[:, 6]

    def __len__(self) -> int:
        return len(self.triangles)


def _flags(name: str, values: bool | Array, count: int) -> Array:
    """Return `values` as (count,) bool."""
    flags = np.asarray(values, dtype=bool)
    if flags.shape not in ((), (count,)):
        raise SceneError(f"{name} has shape {flags.shape}; a bool or ({count},) is needed")
    return np.broadcast_to(flags, (count,)).copy()


def _rgb_rows(name: str, values: Array, count: int) -> Array:
    """Return `values` as (count, 3) float64, refusing values that are not finite and non-negative."""
    rows = np.asarray(values, dtype=np.float64)
    if rows.shape != (count, 3):
        raise SceneError(f"{name} has shape {rows.shape}; ({count}, 3) is needed")
    bad = ~(np.isfinite(rows).all(axis=1) & (rows >= 0).all(axis=1))
    if bad.any():
        raise SceneError(f"{name} of triangle {int(np.flatnonzero(bad)[0])} is negative, NaN or infinite")
    return rows
