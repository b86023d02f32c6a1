"""Area lamps: flat and one-sided, as Cycles has them, and its soft-box that narrows their spread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..form_factors import point_to_ellipse, point_to_polygon, ray_geometry_term, throughput
from ..numerics import concentric_disk, cosine_hemisphere, radiance_of_flux, to_world, uniform_cone
from .light import Emitter, Float64Array, Rays, Samples, directions_to, row_cosines

AREA_SHAPES = ("rectangle", "ellipse")

_NODES = 10
"""Gauss-Legendre nodes, along each axis, over the part of a lamp that a point sees through the soft-box."""

_NARROWEST = 1e-3
"""Smallest spread [rad], nearly parallel light: a millimeter of blur at a meter."""

_NODES_CHUNK = 1 << 9
"""Points integrated at a time; temporaries stay in the processor's cache."""


@dataclass(frozen=True, eq=False)
class AreaLight(Emitter):
    """A flat lamp of uniform radiance power/(π area) on one side.

    position (3,) [m]: Its center.
    edge_u, edge_v (3,) [m]: Full edge vectors, or full conjugate axes of an ellipse; it shines to the side
        that edge_u × edge_v points to.
    power float or (3,) float [W].
    shape "rectangle" or "ellipse".
    spread float [rad]: The full angle of the cone that each point of the lamp shines into, 0 to π: as through
        the slats of a soft-box, radiance falls as 1 − tan θ / tan(spread/2), and the power is kept.
    Raises SceneError if a value is out of range or the lamp has no area.
    """

    position: npt.ArrayLike
    edge_u: npt.ArrayLike
    edge_v: npt.ArrayLike
    power: npt.ArrayLike
    shape: str = "rectangle"
    spread: float = np.pi

    def __post_init__(self) -> None:
        for field in ("position", "edge_u", "edge_v"):
            self._set_vector(field)
        self._set_rgb("power")
        self._set_number("spread", 0.0, float(np.pi) + 1e-6)
        object.__setattr__(self, "spread", max(self.spread, _NARROWEST))
        if self.shape not in AREA_SHAPES:
            raise self._fail(f"shape {self.shape!r} is unknown", f"choose one of {', '.join(AREA_SHAPES)}")
        if not self.area > 0.0:
            raise self._fail("it has no area", "give it a size above 0 both ways")

    @property
    def strength(self) -> Float64Array:
        """(3,) RGB power [W]."""
        return np.asarray(self.power, dtype=np.float64)

    @property
    def area(self) -> float:
        """The area that shines [m²]."""
        parallelogram = float(np.linalg.norm(self._facing))
        return parallelogram if self.shape == "rectangle" else 0.25 * np.pi * parallelogram

    @property
    def _facing(self) -> Float64Array:
        """A vector toward the side that it lights."""
        return np.cross(np.asarray(self.edge_u), np.asarray(self.edge_v))

    @property
    def flux(self) -> Float64Array:
        """(3,) RGB power it sends out [W]."""
        return self.strength.copy()

    def emit(self, place: Samples, way: Samples) -> Rays:
        """Return rays uniform over the lamp, cosine-distributed (see `Emitter.emit`)."""
        normal, unit = self._normal, np.asarray(way, dtype=np.float64)
        if self.is_open:
            local, shares = cosine_hemisphere(unit), np.ones(len(unit))
        else:
            local = uniform_cone(unit, 2.0 * np.sin(0.25 * self.spread) ** 2)
            shares = local[:, 2] * self._through_slats(np.hypot(local[:, 0], local[:, 1]), local[:, 2])
        return (
            self._points(np.asarray(place, dtype=np.float64)),
            to_world(local[None], normal[None])[0],
            shares,
        )

    def unit_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:
        """Return the irradiance per power, F / area (see `Lamp.unit_irradiance`)."""
        if not self.is_open:
            return self._narrow_irradiance(points, normals)
        center, half_u, half_v = self.half_axes
        if self.shape == "ellipse":
            return point_to_ellipse(points, normals, center, half_u, half_v) / self.area
        corners = center + np.stack([-half_u - half_v, half_u - half_v, half_u + half_v, half_v - half_u])
        return point_to_polygon(points, normals, np.broadcast_to(corners, (len(points), 4, 3))) / self.area

    def shadow_rays(self, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return rays to samples uniform over the emitting area of the lamp (see `Lamp.shadow_rays`)."""
        if not self.is_open:
            directions, distances, weights = self._narrow_rays(points, normals, np.asarray(u, np.float64))
            return directions, distances, weights / u.shape[1]
        samples = self._points(np.asarray(u, dtype=np.float64))
        directions, distances = directions_to(samples - points[:, None])
        facing = -(directions @ self._normal)
        geometry = ray_geometry_term(row_cosines(directions, normals), facing, distances)
        # Each ray stands for a k-th of the lamp: radiance times what it throws on a square meter.
        thrown = throughput(geometry, 1.0, self.area / directions.shape[1])
        return directions, distances, radiance_of_flux(1.0, self.area) * thrown

    def _points(self, square: Float64Array) -> Float64Array:
        """Map (…, 2) points of the unit square to uniform points of the lamp, (…, 3)."""
        center, half_u, half_v = self.half_axes
        across = concentric_disk(square) if self.shape == "ellipse" else 2.0 * square - 1.0
        return center + across @ np.stack([half_u, half_v])

    @property
    def is_open(self) -> bool:
        """Whether there is no soft-box."""
        return self.spread > np.pi - 1e-4

    @property
    def _normal(self) -> Float64Array:
        return self._facing / np.linalg.norm(self._facing)

    def _through_slats(self, across: Float64Array, ahead: Float64Array) -> Float64Array:
        """Return the share of radiance by `across` and `ahead`; its power over all angles is 1."""
        half = 0.5 * self.spread
        # tan α − α, whose terms cancel for a small α.
        excess = np.tan(half) - half if half > 0.05 else half**3 / 3.0 * (1.0 + 0.4 * half * half)
        tangent = across / np.where(ahead > 0.0, ahead, np.inf)
        return np.where(ahead > 0.0, np.maximum(np.tan(half) - tangent, 0.0) / excess, 0.0)

    def _narrow_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:
        """Integrate over the part of the lamp that shines on each point, which the slats end smoothly."""
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)  # type: ignore[no-untyped-call, unused-ignore]
        u = np.stack(np.meshgrid(0.5 + 0.5 * nodes, 0.5 + 0.5 * nodes), axis=-1).reshape(1, -1, 2)
        area = (0.25 * weights[:, None] * weights[None]).ravel()
        total = np.zeros(len(points))
        shining = np.flatnonzero(self._shines_on(points))
        for first in range(0, len(shining), _NODES_CHUNK):
            rows = shining[first : first + _NODES_CHUNK]
            square = np.broadcast_to(u, (len(rows), *u.shape[1:]))
            total[rows] = self._narrow_rays(points[rows], normals[rows], square)[2] @ area
        return total

    def _shines_on(self, points: Float64Array) -> npt.NDArray[np.bool_]:
        """Return (n,) whether a point may be in the beam: its disk meets the circle around the lamp."""
        center, half_u, half_v = self.half_axes
        above = points - center
        height = above @ self._normal
        aside = np.linalg.norm(above - height[:, None] * self._normal, axis=1)
        circle = max(np.linalg.norm(half_u + half_v), np.linalg.norm(half_u - half_v))
        return (height > 0) & (aside < height * np.tan(0.5 * self.spread) + circle)

    def _narrow_rays(self, points: Float64Array, normals: Float64Array, u: Float64Array) -> Rays:
        """Return rays to (n, k, 2) points of the square, carried onto what shines; weights not yet by k.

        From a point at height h the slats leave a disk of radius h tan(spread/2) about its foot.
        The lamp's plane is measured in half axes: s across, where strip after strip is cut out of both
        the disk and the lamp, and t along the strips.
        """
        center, half_u, half_v = self.half_axes
        above = points - center
        height = above @ self._normal
        radius = np.maximum(height, 0.0)[:, None] * np.tan(0.5 * self.spread)
        uu, uv, vv = half_u @ half_u, half_u @ half_v, half_v @ half_v
        determinant = uu * vv - uv * uv
        to_u, to_v = above @ half_u, above @ half_v
        foot_s = ((vv * to_u - uv * to_v) / determinant)[:, None]
        foot_t = ((uu * to_v - uv * to_u) / determinant)[:, None]
        reach = radius * np.sqrt(vv / determinant)
        low, high = np.maximum(foot_s - reach, -1.0), np.minimum(foot_s + reach, 1.0)
        width = np.maximum(high - low, 0.0)
        s = low + u[..., 0] * width
        middle = foot_t - (uv / vv) * (s - foot_s)
        chord = np.sqrt(np.maximum((radius**2 - (s - foot_s) ** 2 * determinant / vv) / vv, 0.0))
        end = np.sqrt(np.maximum(1.0 - s * s, 0.0)) if self.shape == "ellipse" else 1.0
        bottom, top = np.maximum(middle - chord, -end), np.minimum(middle + chord, end)
        length = np.maximum(top - bottom, 0.0)
        t = bottom + u[..., 1] * length

        offsets = s[..., None] * half_u + t[..., None] * half_v - above[:, None]
        directions, distances = directions_to(offsets)
        cosines, facing = row_cosines(directions, normals), -(directions @ self._normal)
        across = np.sqrt(np.maximum(1.0 - facing * facing, 0.0))
        radiance = radiance_of_flux(1.0, self.area) * self._through_slats(across, facing)
        # A square meter of the plane is this many of the unit square.
        sampled = width * length * np.sqrt(determinant)
        return (
            directions,
            distances,
            radiance * throughput(ray_geometry_term(cosines, facing, distances), 1.0, sampled),
        )

    @property
    def half_axes(self) -> tuple[Float64Array, Float64Array, Float64Array]:
        """(3,) float64 thrice [m]: its center, and half of each edge vector."""
        return np.asarray(self.position), 0.5 * np.asarray(self.edge_u), 0.5 * np.asarray(self.edge_v)
