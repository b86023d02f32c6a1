"""Boxes around what moved, and what passes through them: rays, segments, and the fans of rays to a lamp.

All is judged to the safe side: what is said to pass by does, what is said to meet a box may miss what is
in it.
"""

from __future__ import annotations

import numpy as np

from ...lights import AreaLight, Lamp, PointLight, SkyPatch, SpotLight, SunLight
from ...numerics import Array
from ..emitters import EmitterGroup

MAX_SKY_ANGLE = 1.5
"""A part of the sky farther than this from its middle [rad] is everywhere."""


class Boxes:
    """Some boxes along the axes.

    low, high (b, 3) [m].
    """

    def __init__(self, low: Array, high: Array) -> None:
        self.low, self.high = low, high

    def __len__(self) -> int:
        return len(self.low)

    @staticmethod
    def around(parts: list[Array], margin: float) -> Boxes:
        """Return boxes around sets of triangles (t, 3, 3), `margin` larger on all sides; none around none."""
        parts = [part for part in parts if len(part)]
        low = np.array([part.min(axis=(0, 1)) for part in parts]).reshape(-1, 3)
        high = np.array([part.max(axis=(0, 1)) for part in parts]).reshape(-1, 3)
        return Boxes(low - margin, high + margin)

    def near(self, points: Array, reach: Array) -> Array:
        """Return (n,) whether a box is within `reach` (n,) of points (n, 3) [m]."""
        return self.touching(points - reach[:, None], points + reach[:, None])

    def touching(self, low: Array, high: Array) -> Array:
        """Return (n,) whether boxes with these corners, (n, 3) each, touch one of these."""
        found = np.zeros(len(low), dtype=bool)
        for lower, upper in zip(self.low, self.high, strict=True):
            found |= ((low <= upper) & (high >= lower)).all(axis=1)
        return found

    def above(self, points: Array, normals: Array, reach: Array) -> Array:
        """Return (n,) whether a box, so much larger, rises over the planes of points with unit normals."""
        found = np.zeros(len(points), dtype=bool)
        for lower, upper in zip(self.low, self.high, strict=True):
            middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
            highest = ((middle - points) * normals).sum(axis=1) + np.abs(normals) @ half
            found |= highest + reach * np.abs(normals).sum(axis=1) >= 0.0
        return found

    def met_by(self, start: Array, along: Array, widen: Array, end: float = np.inf) -> Array:
        """Return which rays meet a box that is `widen` larger on all sides.

        start (n, 3).
        along (n, k, 3).
        widen (n,) [m].
        end: In lengths of `along`: 1 for segments.
        Returns meets (n, k) bool.
        """
        inverse = along.astype(np.float32)
        inverse = 1.0 / np.where(np.abs(inverse) < 1e-12, np.float32(1e-12), inverse)
        found = np.zeros(along.shape[:2], dtype=bool)
        for lower, upper in zip(self.low, self.high, strict=True):
            enter = np.zeros(along.shape[:2], dtype=np.float32)
            leave = np.full(along.shape[:2], end, dtype=np.float32)
            for axis in range(3):
                one = (lower[axis] - widen - start[:, axis]).astype(np.float32)[:, None] * inverse[..., axis]
                other = (upper[axis] + widen - start[:, axis]).astype(np.float32)[:, None] * inverse[
                    ..., axis
                ]
                np.maximum(enter, np.minimum(one, other), out=enter)
                np.minimum(leave, np.maximum(one, other), out=leave)
            found |= enter <= leave
        return found

    def met_by_fans(self, start: Array, along: Array, grow: Array, widen: Array, end: float = 1.0) -> Array:
        """Return which fans of rays meet a box: from a point to all of another box, or of a patch of the sky.

        start (n, 3).
        along (n, k, 3): To the middle of what is at the fan's end.
        grow (…, 3), broadcast against `along`: How far that reaches along each axis from its middle.
        widen (n,) [m]: How much larger boxes are taken.
        end: In lengths of `along`; infinite for the sky.
        Returns meets (n, k) bool.
        """
        found = np.zeros(along.shape[:2], dtype=bool)
        with np.errstate(divide="ignore", invalid="ignore"):
            for lower, upper in zip(self.low, self.high, strict=True):
                first, last = np.zeros(along.shape[:2]), np.full(along.shape[:2], end)
                for axis in range(3):
                    below = (start[:, axis] - lower[axis] + widen)[:, None]
                    over = (upper[axis] + widen - start[:, axis])[:, None]
                    # There the fan's lower side must be below the top, and its upper side over the bottom.
                    for slope, room in (
                        (along[..., axis] - grow[..., axis], over),
                        (-along[..., axis] - grow[..., axis], below),
                    ):
                        limit = room / slope
                        last = np.where(slope > 0, np.minimum(last, limit), last)
                        first = np.where(slope < 0, np.maximum(first, limit), first)
                        last = np.where((slope == 0) & (room < 0), -1.0, last)
                found |= first <= last
        return found

    def between(self, points: Array, light: Lamp | EmitterGroup, widen: Array) -> Array:
        """Return (n,) whether a box may be between points (n, 3) and any part of a lamp."""
        end, middle, grow = _extent(light)
        if not np.isfinite(grow).all():
            return np.ones(len(points), dtype=bool)
        along = np.broadcast_to(middle, points.shape) if np.isinf(end) else middle - points
        return self.met_by_fans(points, along[:, None], grow, widen, end)[:, 0]


def _extent(light: Lamp | EmitterGroup) -> tuple[float, Array, Array]:
    """Return where a lamp is: 1 and a box's middle and half its size [m], or ∞, a direction and how it opens.

    What is not known is everywhere: then the size is infinite.
    """
    everywhere = np.full(3, np.inf)
    if isinstance(light, EmitterGroup):
        low, high = light.bounds
        return 1.0, 0.5 * (low + high), 0.5 * (high - low)
    if isinstance(light, PointLight | SpotLight):
        return 1.0, np.asarray(light.position), np.full(3, light.radius)
    if isinstance(light, AreaLight):
        half = 0.5 * (np.abs(np.asarray(light.edge_u)) + np.abs(np.asarray(light.edge_v)))
        return 1.0, np.asarray(light.position), half
    if isinstance(light, SunLight):
        return np.inf, -light.unit_direction, _opening(0.5 * light.angle)
    if isinstance(light, SkyPatch):
        return np.inf, -light.direction, _opening(light.half_angle)
    return 1.0, np.zeros(3), everywhere


def _opening(half_angle: float) -> Array:
    """Return (3,) how far off its axis a cone gets for each meter along it."""
    return np.full(3, np.tan(half_angle) if half_angle < MAX_SKY_ANGLE else np.inf)
