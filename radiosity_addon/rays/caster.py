"""Visibility: the interface of ray casters, and a plain NumPy reference implementation.

Rays start at the surface, moved along the receiving side's normal by `surface_offset`,
a few float32 steps of the scene's extent: far enough not to hit the surface itself, so
close that a point covered by a box starts inside the box and stays dark.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..numerics import Array

OFFSET_STEPS = 64
"""Ray origins leave the surface by this many float32 steps at the scene's border."""

NO_HIT = -1

SIGHT_LIFT = 2.0
"""Lines of sight between points of surfaces run this many surface offsets above them, …"""

SAGITTA = 0.6
"""… and, where a surface bends, this part of length · √(1 − cos of the turn) more: what a sphere of few
facets needs."""


@dataclass(frozen=True)
class Hits:
    """The first surfaces that n rays met.

    triangle (n,) int32: Row of the scene's triangles, or NO_HIT.
    barycentric (n, 2) float32: Weights of the triangle's second and third corner.
    front (n,) bool: Whether the ray came from the triangle's front.
    distance (n,) float32: Along the unit direction [m]; infinite without a hit.
    tint (n, 3) float32: What the light that comes along each ray is multiplied with on its way through glass;
        None where there is none.
    """

    triangle: Array
    barycentric: Array
    front: Array
    distance: Array
    tint: Array | None = None

    def take(self, rows: Array) -> Hits:
        """Return the hits of a boolean mask or of row numbers."""
        tint = None if self.tint is None else self.tint[rows]
        return Hits(self.triangle[rows], self.barycentric[rows], self.front[rows], self.distance[rows], tint)


class RayCaster(Protocol):
    """Answers visibility queries about one fixed set of triangles."""

    surface_offset: float
    """How far ray origins leave their surface [m]."""

    @property
    def tinted(self) -> bool:
        """Whether rays meet glass: light then passes by color, and hits have a tint."""
        ...

    @property
    def rays(self) -> int:
        """Rays traced so far."""
        ...

    @property
    def for_lamps(self) -> RayCaster:
        """The caster for the light of lamps; usually this one."""
        ...

    def unoccluded(self, origins: Array, directions: Array, distances: Array) -> Array:
        """Return (n,) bool: nothing lies within `distances` along the unit `directions`."""
        ...

    def passing(self, origins: Array, directions: Array, distances: Array, least: float = 0.0) -> Array:
        """Return (n,) the share of light that passes: as `unoccluded`, but between 0 and 1 through cut-outs.

        Their opacity counts as at least `least` and as at most 1 − `least`, for callers that judge
        by few rays: where some met a cut-out, more are needed. Of a tinted caster the mean of the channels.
        """
        ...

    def passing_colors(
        self, origins: Array, directions: Array, distances: Array, least: float = 0.0
    ) -> Array:
        """Return (n, 3) the share of each channel's light that passes; of a tinted caster alone."""
        ...

    def intersect(self, origins: Array, directions: Array) -> Hits:
        """Return what each ray meets first."""
        ...


def surface_offset(triangles: Array) -> float:
    """Return the distance [m] by which ray origins leave the surface of (t, 3, 3) `triangles`."""
    if len(triangles) == 0:
        return 1e-6
    corners = triangles.reshape(-1, 3)
    extent = float(np.max(corners.max(axis=0) - corners.min(axis=0)))
    return max(OFFSET_STEPS * float(np.finfo(np.float32).eps) * extent, 1e-12)


def passing_light(
    caster: RayCaster, origins: Array, directions: Array, distances: Array, least: float = 0.0
) -> Array:
    """Return the share of light that passes: (n,), or (n, 3) by channel if the caster is tinted."""
    if caster.tinted:
        return caster.passing_colors(origins, directions, distances, least)
    return caster.passing(origins, directions, distances, least)


def free_segment(caster: RayCaster, start: Array, end: Array) -> Array:
    """Return (n,) whether nothing lies between (n, 3) points."""
    along = end - start
    length = np.sqrt(np.einsum("nk,nk->n", along, along))
    return caster.unoccluded(start, along / np.maximum(length, 1e-300)[:, None], length)


class BruteForceCaster:
    """Tests every ray against every triangle (Möller and Trumbore 1997): slow, obvious, the reference."""

    def __init__(self, triangles: Array) -> None:
        self._corner = np.asarray(triangles, dtype=np.float64)[:, 0]
        self._edge_1 = triangles[:, 1] - self._corner
        self._edge_2 = triangles[:, 2] - self._corner
        self._normal = np.cross(self._edge_1, self._edge_2)
        self.surface_offset = surface_offset(triangles)
        self.rays = 0
        self.tinted = False

    @property
    def for_lamps(self) -> RayCaster:
        """All triangles stop the light of lamps here."""
        return self

    def unoccluded(self, origins: Array, directions: Array, distances: Array) -> Array:
        """See `RayCaster.unoccluded`."""
        return np.asarray(self.intersect(origins, directions).distance >= distances)

    def passing(self, origins: Array, directions: Array, distances: Array, least: float = 0.0) -> Array:  # noqa: ARG002
        """Return the same: all surfaces are whole."""
        return self.unoccluded(origins, directions, distances)

    def passing_colors(
        self, origins: Array, directions: Array, distances: Array, least: float = 0.0
    ) -> Array:
        """Return the same for each channel."""
        return np.repeat(self.passing(origins, directions, distances, least)[:, None], 3, axis=1)

    def intersect(self, origins: Array, directions: Array) -> Hits:
        """See `RayCaster.intersect`."""
        self.rays += len(origins)
        cross_2 = np.cross(directions[:, None], self._edge_2[None])
        determinant = np.einsum("tk,ntk->nt", self._edge_1, cross_2)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / determinant
            from_corner = origins[:, None] - self._corner[None]
            u = inverse * np.einsum("ntk,ntk->nt", from_corner, cross_2)
            cross_1 = np.cross(from_corner, self._edge_1[None])
            v = inverse * np.einsum("nk,ntk->nt", directions, cross_1)
            t = inverse * np.einsum("tk,ntk->nt", self._edge_2, cross_1)
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (determinant != 0)
        t = np.where(hit, t, np.inf)
        nearest = np.argmin(t, axis=1)
        row = np.arange(len(origins))
        distance = t[row, nearest]
        triangle = np.where(np.isfinite(distance), nearest, NO_HIT).astype(np.int32)
        front = np.einsum("nk,nk->n", directions, self._normal[nearest]) < 0
        weights = np.stack([u[row, nearest], v[row, nearest]], axis=1)
        weights[triangle == NO_HIT] = 0
        return Hits(triangle, weights.astype(np.float32), front, distance.astype(np.float32))
