"""Lamps and the sky: what each sends to a point, in closed form, and rays that ask what is in the way.

Cycles' lamps are the model. A lamp's irradiance on an unoccluded point is
`strength × unit_irradiance`; `shadow_rays` sample the same integral, so that a visibility is a
ratio of sums and has no noise where all rays agree. A lamp's shape casts no shadow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .bulb_lights import PointLight, SpotLight
from .curved_factor import cap_cosine, point_to_ellipse
from .geometry_term import ray_geometry_term, throughput
from .light_base import Emitter, Float64Array, Lamp, Light, Rays, Samples, directions_to, row_cosines
from .point_factor import point_to_polygon
from .radiometry import radiance_of_flux
from .sampling import concentric_disk, cosine_hemisphere, to_world, uniform_cone

__all__ = [
    "AREA_SHAPES",
    "AreaLight",
    "EnvironmentLight",
    "Lamp",
    "Light",
    "PointLight",
    "SpotLight",
    "SunLight",
]

AREA_SHAPES = ("rectangle", "ellipse")


@dataclass(frozen=True, eq=False)
class SunLight(Lamp):
    """Parallel light, or light from a round patch of the sky.

    Parameters
    ----------
    direction : (3,) float
        The way the light travels.
    irradiance : float or (3,) float [W/m²]
        On a surface that faces it, whatever the angle.
    angle : float [rad]
        The full angle the sun's disk spans, 0 to π.

    Raises
    ------
    SceneError
        If a value is out of range.
    """

    direction: npt.ArrayLike
    irradiance: npt.ArrayLike
    angle: float = 0.0

    def __post_init__(self) -> None:
        self._set_vector("direction", unit=True)
        self._set_rgb("irradiance")
        self._set_number("angle", 0.0, float(np.pi) + 1e-6)

    @property
    def unit_direction(self) -> Float64Array:
        """(3,) the way the light travels, of length 1."""
        return np.asarray(self.direction)

    @property
    def strength(self) -> Float64Array:
        """(3,) RGB irradiance of what faces it [W/m²]."""
        return np.asarray(self.irradiance, dtype=np.float64)

    def unit_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:  # noqa: ARG002
        """Return cosθ, or what the cap keeps of it at the horizon (see `Lamp.unit_irradiance`)."""
        return cap_cosine(-(normals @ np.asarray(self.direction)), np.sin(0.5 * self.angle))

    def shadow_rays(self, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return rays to samples of the sun's cap, uniform over it (see `Lamp.shadow_rays`)."""
        toward = np.broadcast_to(-np.asarray(self.direction), (len(points), 3))
        drop = 2.0 * np.sin(0.25 * self.angle) ** 2
        directions = to_world(uniform_cone(np.asarray(u, dtype=np.float64), drop), toward)
        # Radiance 1/(π sin²α) over the solid angle 2π (1 − cosα), shared by k rays.
        share = 2.0 / ((2.0 - drop) * directions.shape[1])
        return directions, np.full(directions.shape[:2], np.inf), share * row_cosines(directions, normals)


@dataclass(frozen=True, eq=False)
class AreaLight(Emitter):
    """A flat lamp of uniform radiance power/(π area) on one side.

    Parameters
    ----------
    position : (3,) float [m]
        Its centre.
    edge_u, edge_v : (3,) float [m]
        Full edge vectors, or full conjugate axes of an ellipse; it shines to the side that
        edge_u × edge_v points to.
    power : float or (3,) float [W]
    shape : "rectangle" or "ellipse"

    Raises
    ------
    SceneError
        If a value is out of range or the lamp has no area.
    """

    position: npt.ArrayLike
    edge_u: npt.ArrayLike
    edge_v: npt.ArrayLike
    power: npt.ArrayLike
    shape: str = "rectangle"

    def __post_init__(self) -> None:
        for field in ("position", "edge_u", "edge_v"):
            self._set_vector(field)
        self._set_rgb("power")
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
        """A vector along the side it shines to."""
        facing: Float64Array = np.cross(np.asarray(self.edge_u), np.asarray(self.edge_v))
        return facing

    @property
    def flux(self) -> Float64Array:
        """(3,) RGB power it sends out [W]."""
        return self.strength.copy()

    def emit(self, place: Samples, way: Samples) -> Rays:
        """Return rays uniform over the lamp, cosine-distributed (see `Emitter.emit`)."""
        normal = self._facing / np.linalg.norm(self._facing)
        directions = to_world(cosine_hemisphere(np.asarray(way, dtype=np.float64))[None], normal[None])[0]
        return self._points(np.asarray(place, dtype=np.float64)), directions, np.ones(len(directions))

    def unit_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:
        """Return the irradiance per power, F / area (see `Lamp.unit_irradiance`)."""
        centre, half_u, half_v = self._half_axes()
        if self.shape == "ellipse":
            return point_to_ellipse(points, normals, centre, half_u, half_v) / self.area
        corners = centre + np.stack([-half_u - half_v, half_u - half_v, half_u + half_v, half_v - half_u])
        return point_to_polygon(points, normals, np.broadcast_to(corners, (len(points), 4, 3))) / self.area

    def shadow_rays(self, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return rays to samples uniform over the lamp (see `Lamp.shadow_rays`)."""
        samples = self._points(np.asarray(u, dtype=np.float64))
        directions, distances = directions_to(samples - points[:, None])
        facing = -(directions @ (self._facing / np.linalg.norm(self._facing)))
        geometry = ray_geometry_term(row_cosines(directions, normals), facing, distances)
        # Each ray stands for a k-th of the lamp: radiance times what it throws on a square metre.
        thrown = throughput(geometry, 1.0, self.area / directions.shape[1])
        return directions, distances, radiance_of_flux(1.0, self.area) * thrown

    def _points(self, square: Float64Array) -> Float64Array:
        """Map (…, 2) points of the unit square to uniform points of the lamp, (…, 3)."""
        centre, half_u, half_v = self._half_axes()
        across = concentric_disk(square) if self.shape == "ellipse" else 2.0 * square - 1.0
        points: Float64Array = centre + across @ np.stack([half_u, half_v])
        return points

    def _half_axes(self) -> tuple[Float64Array, Float64Array, Float64Array]:
        return np.asarray(self.position), 0.5 * np.asarray(self.edge_u), 0.5 * np.asarray(self.edge_v)


@dataclass(frozen=True, eq=False)
class EnvironmentLight(Light):
    """A sky of constant radiance around the scene, as seen by whatever is not covered.

    Parameters
    ----------
    radiance : float or (3,) float [W/m²/sr]

    Raises
    ------
    SceneError
        If it is negative, NaN or infinite.
    """

    radiance: npt.ArrayLike

    def __post_init__(self) -> None:
        self._set_rgb("radiance")

    @property
    def strength(self) -> Float64Array:
        """(3,) RGB radiance [W/m²/sr]."""
        return np.asarray(self.radiance, dtype=np.float64)
