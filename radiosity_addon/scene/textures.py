"""Textures of surfaces: images of reflectance, emission and opacity.

One image holds the texels of all textured triangles, each triangle's own part of it placed
by its corners' coordinates. Where opacity is below 1 a surface is only partly there: what is
not neither reflects, emits nor blocks. So look-ups give reflectance and emission multiplied
by opacity, which is what a piece of surface sends for what arrives on all of it, and what may
be averaged; `where_there` divides again.

What goes through is gray as a rule: 1 − opacity. Where it has a color, a second image holds it by channel,
and opacity is 1 − its mean.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..base import SceneError
from ..numerics import (
    MAX_REFLECTANCE,
    WHOLE_TRIANGLE,
    Array,
    most_reflectance,
    points_at,
    split_in_four,
    texels_around,
)

CHANNELS = 7
"""Reflectance RGB, emission RGB, opacity."""

MAX_DEPTH = 8
"""An area's mean is taken over 4^8 parts at most."""

LEAST_DEPTH = 2
"""An area's mean is taken over 4^2 parts at least."""

SMALL = 8.0
"""Areas up to this many texels wide, whose samples often lie at the boundary, take four times as many."""

THIN = 4.0
"""The maximum length of parts in texels, however thin they are."""

CHUNK_SAMPLES = 1 << 18
"""Look-ups done at once; their temporaries take about 60 MB."""

ROUNDING = 1e-4
"""Coordinates may leave [0, 1], and opacity may miss 1, by this much."""


class SurfaceImages:
    """Reflectance, emission and opacity of triangles as one image.

    values (h, w, 7): Reflectance RGB in [0, 1], clamped like a scene's, and to what `passes` leaves of each
        channel (`most_reflectance`); exitance RGB of each emitting side [W/m²]; opacity in [0, 1]. Linear,
        row 0 is v = 0. Reflectance and emission are those of the existing surface, not multiplied by opacity.
    image_uv (t, 3, 2): The corners of every scene triangle in the image, in [0, 1]; texel (r, c) covers [c/w,
        (c+1)/w] × [r/h, (r+1)/h]. Look-ups are bilinear and reach half a texel beyond the triangle:
        neighbors in the image need a border of their own texels.
    textured (t,) bool: Other rows use the scene's constants and are opaque.
    passes (h, w, 3): The share of each channel's light that goes straight through; its mean is 1 − opacity.
        None: the same of all channels.
    glass (t,) bool: Triangles that are glass: where they reflect and emit nothing, rays go on through them
        with what is left of their light. None: none.
    Raises SceneError if shapes do not match, or a textured triangle meets a value out of range.
    """

    def __init__(
        self,
        values: Array,
        image_uv: Array,
        textured: Array,
        passes: Array | None = None,
        glass: Array | None = None,
    ) -> None:
        self.values = np.array(values, dtype=np.float32)
        self.image_uv = np.array(image_uv, dtype=np.float32)
        self.textured = np.array(textured, dtype=bool)
        if self.values.ndim != 3 or self.values.shape[2] != CHANNELS or 0 in self.values.shape:
            raise SceneError(f"the surface image has shape {self.values.shape}; (h, w, {CHANNELS}) is needed")
        if self.textured.ndim != 1 or self.image_uv.shape != (len(self.textured), 3, 2):
            raise SceneError(
                f"image_uv has shape {self.image_uv.shape} and textured {self.textured.shape}; "
                "(t, 3, 2) and (t,) are needed"
            )
        self.glass = (
            np.zeros(len(self.textured), dtype=bool) if glass is None else np.array(glass, dtype=bool)
        )
        self.passes = None if passes is None else np.array(passes, dtype=np.float32)
        if self.glass.shape != self.textured.shape or (
            self.passes is not None and self.passes.shape != (*self.values.shape[:2], 3)
        ):
            raise SceneError("glass and passes are not of the same triangles and texels as the surface image")
        if self.passes is None and self.glass.any():
            self.passes = np.repeat(1.0 - self.values[..., 6:], 3, axis=2)
        self._check()
        self.image_uv = np.clip(self.image_uv, 0.0, 1.0)
        self.image_uv[~self.textured] = 0.0
        self.values = np.maximum(np.where(np.isfinite(self.values), self.values, 0.0), 0.0)
        self.values[..., 6] = np.minimum(self.values[..., 6], 1.0)
        most: float | Array = MAX_REFLECTANCE
        if self.passes is not None:
            self.passes = np.clip(np.where(np.isfinite(self.passes), self.passes, 0.0), 0.0, 1.0)
            most = most_reflectance(self.values[..., 6], self.passes)
        self.values[..., :3] = np.minimum(self.values[..., :3], most)
        self._weighed = self.values
        if not (self.values[..., 6] == 1.0).all():
            self._weighed = self.values.copy()
            self._weighed[..., :6] *= self.values[..., 6:]
        self._opacity = np.ascontiguousarray(self.values[..., 6:])

    def __len__(self) -> int:
        return len(self.textured)

    def same_as(self, other: SurfaceImages) -> bool:
        """Whether another image has the same values on the same triangles."""
        return all(
            np.array_equal(getattr(self, name), getattr(other, name))
            for name in ("textured", "image_uv", "values", "passes", "glass")
        )

    @cached_property
    def cut_out(self) -> Array:
        """(t,) bool: triangles that anything may be seen through."""
        return self._meets(self.values[..., 6] < 1.0 - ROUNDING)

    @cached_property
    def clear(self) -> Array:
        """(t,) bool: glass that neither reflects nor emits."""
        if not self.glass.any():
            return self.glass
        return np.asarray(self.glass & ~self._meets((self._weighed[..., :6] > ROUNDING).any(axis=2)))

    @cached_property
    def tinting(self) -> Array:
        """(t,) bool: cut-outs of whose color the light that goes on takes a share."""
        if self.passes is None:
            return np.zeros(len(self), dtype=bool)
        colors = np.ptp(self.passes, axis=2) > ROUNDING
        return np.asarray(self.cut_out & ~self.invisible & (self.clear | self._meets(colors)))

    @cached_property
    def invisible(self) -> Array:
        """(t,) bool: clear glass that takes nothing of the light, which need not be traced."""
        found, rows = np.zeros(len(self), dtype=bool), np.flatnonzero(self.clear)
        if len(rows):
            whole = np.broadcast_to(WHOLE_TRIANGLE, (len(rows), 3, 2))
            found[rows] = (self.mean_passes(rows, whole) > 1.0 - ROUNDING).all(axis=1)
        return found

    def at(self, triangle: Array, barycentric: Array) -> Array:
        """Look up points of textured triangles, bilinearly.

        triangle (n,) int.
        barycentric (n, 2): Weights of the triangle's second and third corner.
        Returns weighed (n, 7) float32: Reflectance and emission, each multiplied by opacity, and opacity.
        """
        return _bilinear(self._weighed, self._place(triangle, barycentric))

    def opacity_at(self, triangle: Array, barycentric: Array) -> Array:
        """Return (n,) float32 the opacity at the same points."""
        return _bilinear(self._opacity, self._place(triangle, barycentric))[:, 0]

    def passes_at(self, triangle: Array, barycentric: Array) -> Array:
        """Return (n, 3) float32 the share of each channel that goes through at the same points."""
        assert self.passes is not None
        return _bilinear(self.passes, self._place(triangle, barycentric))

    def mean_passes(self, triangle: Array, corners: Array) -> Array:
        """Return (n, 3) means of what goes through by channel; parameters as of `area_means`."""
        assert self.passes is not None
        return self._means_of(self.passes, triangle, corners)

    def area_means(self, triangle: Array, corners: Array) -> Array:
        """Average over parts of textured triangles.

        The mean over the centroids of equal parts, at least two per texel and at most
        4^`MAX_DEPTH`, each with the value of its texel. Nothing is interpolated, so the light of a
        bright texel does not spread to a dark part next to it, which would then not be divided.

        triangle (n,) int.
        corners (n, 3, 2): Each part's corners, as weights of its triangle's second and third corner.
        Returns weighed (n, 7): As from `at`.
        """
        return self._means_of(self._weighed, triangle, corners)

    def _means_of(self, image: Array, triangle: Array, corners: Array) -> Array:
        """Return (n, k) means of an image (h, w, k) over parts of triangles."""
        means = np.empty((len(triangle), image.shape[2]))
        place = self._place(np.repeat(triangle, 3), corners.reshape(-1, 2)).reshape(-1, 3, 2)
        depth = _depth(place)
        for levels in np.unique(depth):
            inside = _centroids(int(levels))
            rows = np.flatnonzero(depth == levels)
            step = max(CHUNK_SAMPLES // len(inside), 1)
            for first in range(0, len(rows), step):
                chunk = rows[first : first + step]
                points = np.einsum("sc,nck->nsk", inside, place[chunk]).reshape(-1, 2)
                found = _nearest(image, points).reshape(len(chunk), len(inside), image.shape[2])
                means[chunk] = found.mean(axis=1, dtype=np.float64)
        return means

    def _place(self, triangle: Array, barycentric: Array) -> Array:
        """Return (n, 2) where points of triangles are in the image [texels]."""
        height, width = self.values.shape[:2]
        uv = points_at(self.image_uv[triangle].astype(np.float64), barycentric)
        return np.asarray(uv * (width, height))

    def _check(self) -> None:
        """Refuse invalid coordinates and texels, naming the first triangle that has some."""
        outside = ~np.isfinite(self.image_uv) | (self.image_uv < -ROUNDING) | (self.image_uv > 1 + ROUNDING)
        _refuse(self.textured & outside.any(axis=(1, 2)), "has image coordinates outside [0, 1]")
        self.image_uv[~self.textured] = 0.0
        values = self.values
        colors = ~(np.isfinite(values) & (values >= 0)).all(axis=2)
        _refuse(self._meets(colors), "meets a texel that is negative, NaN or infinite")
        above = (values[..., [0, 1, 2, 6]] > 1 + ROUNDING).any(axis=2)
        _refuse(self._meets(above), "meets a texel of a reflectance or opacity above 1")

    def _meets(self, marked: Array) -> Array:
        """Return (t,) bool: textured triangles whose box in the image meets a marked texel (h, w)."""
        height, width = marked.shape
        before = np.zeros((height + 1, width + 1), dtype=np.int64)
        before[1:, 1:] = marked.cumsum(axis=0).cumsum(axis=1)
        # What a bilinear look-up reads: half a texel further on every side.
        size = np.array([width, height])
        low = np.floor(self.image_uv.min(axis=1) * size - 0.5).astype(np.int64)
        high = np.floor(self.image_uv.max(axis=1) * size + 0.5).astype(np.int64) + 1
        (left, bottom), (right, top) = np.clip(low, 0, size - 1).T, np.clip(high, 1, size).T
        inside = before[top, right] - before[bottom, right] - before[top, left] + before[bottom, left]
        return np.asarray(self.textured & (inside > 0))


def where_there(weighed: Array) -> tuple[Array, Array]:
    """Return the reflectance and emission (n, 3) of the existing part of surfaces.

    weighed (n, 7): From look-ups: reflectance and emission multiplied by opacity, and opacity.
    """
    opacity = weighed[:, 6:]
    there = np.where(opacity > 0, opacity, 1.0)
    return weighed[:, :3] / there, weighed[:, 3:6] / there


def _refuse(bad: Array, complaint: str) -> None:
    """Raise a SceneError for the first triangle of a (t,) mask."""
    if bad.any():
        raise SceneError(f"triangle {int(np.flatnonzero(bad)[0])} {complaint}")


def _bilinear(image: Array, place: Array) -> Array:
    """Look (h, w, k) up at (n, 2) places in texels, (n, k); constant beyond the centers of border texels."""
    height, width = image.shape[:2]
    texels = image.reshape(height * width, -1)
    around, share = texels_around(place, width, height)
    left, right, upper_left, upper_right = around.T
    along, across = np.split(share.astype(np.float32), 2, axis=1)
    lower = texels[left] * (1 - along) + texels[right] * along
    upper = texels[upper_left] * (1 - along) + texels[upper_right] * along
    return np.asarray(lower * (1 - across) + upper * across)


def _nearest(image: Array, place: Array) -> Array:
    """Return (n, k) the texels of (h, w, k) that (n, 2) places lie in."""
    height, width = image.shape[:2]
    column, row = np.clip(place.astype(np.int64), 0, (width - 1, height - 1)).T
    return np.asarray(image.reshape(height * width, -1).take(row * width + column, axis=0))


def _depth(place: Array) -> Array:
    """Return (n,) how often to halve the sides of (n, 3, 2) triangles in texels until they are small."""
    edges = place - np.roll(place, 1, axis=1)
    area = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    longest = np.linalg.norm(edges, axis=2).max(axis=1, initial=0.0)
    size = np.maximum(np.sqrt(area), longest / THIN)
    finer = np.where(size < SMALL, 2.0 * size, size)
    depth = np.ceil(np.log2(np.maximum(finer, 1.0))).astype(int)
    return np.asarray(np.clip(depth, LEAST_DEPTH, MAX_DEPTH))


def _centroids(depth: int) -> Array:
    """Return (4^depth, 3) the centroids of a triangle's equal parts, as weights of its corners."""
    parts = np.eye(3)[None]
    for _ in range(depth):
        parts = split_in_four(parts).reshape(-1, 3, 3)
    return np.asarray(parts.mean(axis=1))
