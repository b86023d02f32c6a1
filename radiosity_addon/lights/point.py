"""Lamps that shine from about a point: Cycles' point and spot lights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..form_factors import cap_cosine, ray_geometry_term
from ..numerics import (
    HEMISPHERE,
    concentric_disk,
    cone_solid_angle,
    cosine_hemisphere,
    intensity_of_flux,
    irradiance_from_point,
    radiance_of_disc,
    to_world,
    uniform_cone,
)
from .light import Emitter, Float64Array, Rays, Samples, directions_to, row_cosines

_INTENSITY = intensity_of_flux(1.0)
"""Of a lamp per power it sends out [1/sr]."""

_EDGE_SAMPLES = 16
"""Samples across a spot's disk, each way, that average the cone's edge over it."""

_RIM_SAMPLES = 256
"""Directions around a stretched cone, sampled for its largest and smallest width."""

_CONE_SAMPLES = 256
"""Samples over a stretched cone, along each axis, for its power."""

_EDGE_CHUNK = 1 << 10
"""Points whose edge samples are taken at a time; temporaries stay below 64 MB."""


class _Bulb(Emitter):
    """Common part of point and spot lamps: intensity power/4π, a radius and an attenuation by direction.

    With soft falloff the lamp is a disk of that radius facing the receiver, of radiance
    I/(π r²): H = I cosθ / (d² + r²) while all of it is up. Without, a sphere of the same
    radiance: H = I cosθ / d², and I/r² for points inside it.
    """

    position: npt.ArrayLike
    power: npt.ArrayLike
    radius: float
    soft_falloff: bool

    @property
    def strength(self) -> Float64Array:
        """(3,) RGB power [W]."""
        return np.asarray(self.power, dtype=np.float64)

    def _validate(self) -> None:
        self._set_vector("position")
        self._set_rgb("power")
        self._set_number("radius", 0.0, float(np.finfo(float).max))

    def _attenuation(self, directions: Float64Array) -> Float64Array:
        """Return (...,) shares of the intensity sent along unit directions (..., 3) from the lamp."""
        return np.ones(directions.shape[:-1])

    def unit_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:
        """Return the irradiance per power (see `Lamp.unit_irradiance`)."""
        toward, distance = directions_to(np.asarray(self.position) - points)
        cosine = np.einsum("ij,ij->i", toward, normals)
        reach = np.hypot(distance, self.radius) if self.soft_falloff else np.maximum(distance, self.radius)
        reach = np.where(reach > 0.0, reach, np.inf)
        effective = cap_cosine(cosine, self.radius / reach)
        if not self.soft_falloff:
            effective = np.where(distance < self.radius, 1.0, effective)
        return irradiance_from_point(_INTENSITY, effective, reach)

    def shadow_rays(self, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return rays to samples of the disk or sphere (see `Lamp.shadow_rays`)."""
        directions, distances, weights = self._plain_rays(points, normals, u)
        return directions, distances, weights * self._attenuation(-directions) * (_INTENSITY / u.shape[1])

    def _plain_rays(self, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return rays whose weights leave the attenuation out and average to irradiance per intensity."""
        toward, distance = directions_to(np.asarray(self.position) - points)
        if self.soft_falloff or self.radius == 0.0:
            return disk_rays(toward, distance, self.radius, normals, u)
        return self._sphere_rays(toward, distance, normals, u)

    def _starts(self, place: Samples, directions: Float64Array) -> Float64Array:
        """Return (n, 3) where rays along unit directions leave: the disk across them, or the sphere."""
        across = self.radius * concentric_disk(np.asarray(place, dtype=np.float64))
        square = self.radius**2 - np.einsum("ij,ij->i", across, across)
        bulge = np.zeros(len(across)) if self.soft_falloff else np.sqrt(np.maximum(square, 0.0))
        local = np.concatenate([across, bulge[:, None]], axis=1)
        return np.asarray(np.asarray(self.position) + to_world(local[:, None], directions)[:, 0])

    def _sphere_rays(
        self, toward: Float64Array, distance: Float64Array, normals: Float64Array, u: Samples
    ) -> Rays:
        """Sample the cone the sphere fills, or the hemisphere from inside."""
        square = np.where(distance > self.radius, distance, np.inf) ** 2
        sine_square = self.radius**2 / square
        drop = sine_square / (1.0 + np.sqrt(1.0 - sine_square))
        inside = distance <= self.radius
        samples = u.astype(np.float64)
        cone = to_world(uniform_cone(samples, drop[:, None]), toward)
        directions = np.where(inside[:, None, None], to_world(cosine_hemisphere(samples), normals), cone)
        ahead = distance[:, None] * np.einsum("ikj,ij->ik", directions, toward)
        half_chord = np.sqrt(np.maximum(self.radius**2 - distance[:, None] ** 2 + ahead * ahead, 0.0))
        distances = np.where(inside[:, None], ahead + half_chord, ahead - half_chord)
        cosine = row_cosines(directions, normals)
        # Radiance times solid angle times cosine; from inside the directions hold the cosine.
        seen = np.where(inside[:, None], HEMISPHERE, cone_solid_angle(drop)[:, None] * cosine)
        return directions, distances, seen * radiance_of_disc(1.0, self.radius)


@dataclass(frozen=True, eq=False)
class PointLight(_Bulb):
    """A lamp that shines equally in all directions.

    position (3,) [m].
    power float or (3,) float [W]: Emitted power; the intensity is power / 4π.
    radius float [m].
    soft_falloff: A disk facing the receiver (Blender's default) instead of a sphere. It sends slightly less
        than its power: power · R²/(R² + r²) through a sphere of radius R around it.
    Raises SceneError if a value is negative, NaN or infinite.
    """

    position: npt.ArrayLike
    power: npt.ArrayLike
    radius: float = 0.0
    soft_falloff: bool = True

    def __post_init__(self) -> None:
        self._validate()

    @property
    def flux(self) -> Float64Array:
        """(3,) RGB power it sends out [W]."""
        return self.strength.copy()

    def emit(self, place: Samples, way: Samples) -> Rays:
        """Return rays uniform over all directions (see `Emitter.emit`)."""
        directions = uniform_cone(np.asarray(way, dtype=np.float64), 2.0)
        return self._starts(place, directions), directions, np.ones(len(directions))


@dataclass(frozen=True, eq=False)
class SpotLight(_Bulb):
    """A point lamp that shines into a cone only, with the point lamp's intensity.

    position (3,) [m].
    direction (3,): The cone's axis, away from the lamp.
    power float or (3,) float [W]: The power an unshaded lamp of that intensity would emit: intensity = power
        / 4π.
    angle float [rad]: The full cone, above 0 to π.
    blend: Share of 1 − cos(angle/2) over which the edge fades by a smoothstep in the cosine.
    radius, soft_falloff as for a `PointLight`.
    round_from_world (3, 3): Takes directions to where the cone is round, with that angle and blend; None: it
        is in the world. So a lamp may be stretched: the intensity inside stays.
    Raises SceneError if a value is out of range.
    """

    position: npt.ArrayLike
    direction: npt.ArrayLike
    power: npt.ArrayLike
    angle: float
    blend: float = 0.15
    radius: float = 0.0
    soft_falloff: bool = True
    round_from_world: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        self._validate()
        self._set_vector("direction", unit=True)
        self._set_number("angle", 0.0, float(np.pi) + 1e-6, above=True)
        self._set_number("blend", 0.0, 1.0)
        if self.round_from_world is not None:
            turn = np.asarray(self.round_from_world, dtype=np.float64)
            if turn.shape != (3, 3) or not np.isfinite(turn).all() or np.linalg.det(turn) == 0.0:
                raise self._fail("its cone is flat or not finite", "set its scale to something other than 0")
            self._store("round_from_world", turn)

    @property
    def flux(self) -> Float64Array:
        """(3,) RGB power inside the cone [W]: the smoothstep's mean is a half."""
        share = 1.0 - 0.5 * self.blend
        if self.round_from_world is not None:
            step = (np.arange(_CONE_SAMPLES) + 0.5) / _CONE_SAMPLES
            square = np.stack(np.meshgrid(step, step), axis=-1).reshape(-1, 2)
            share = float(self.emit(square, square)[2].mean())
        return intensity_of_flux(self.strength) * cone_solid_angle(self._opening) * share

    @property
    def half_angles(self) -> tuple[float, float]:
        """How narrow and how wide the cone is, from its axis to its edge [rad]."""
        half = 0.5 * self.angle
        if self.round_from_world is None:
            return half, half
        turn = 2.0 * np.pi * np.arange(_RIM_SAMPLES) / _RIM_SAMPLES
        rim = np.stack([np.sin(half) * np.cos(turn), np.sin(half) * np.sin(turn)], axis=-1)
        rim = np.insert(rim, 2, np.cos(half), axis=1)
        seen, _ = self._in_world(to_world(rim[None], self._round_axis[None])[0])
        away = np.arccos(np.clip(seen @ np.asarray(self.direction), -1.0, 1.0))
        return float(away.min()), float(away.max())

    @property
    def _round_axis(self) -> Float64Array:
        """The cone's axis where it is round."""
        if self.round_from_world is None:
            return np.asarray(self.direction)
        axis: Float64Array = np.asarray(self.round_from_world) @ np.asarray(self.direction)
        return np.asarray(axis / np.linalg.norm(axis))

    def _in_world(self, directions: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Return unit directions (n, 3) of the round cone's space in the world, and how solid angles grow."""
        if self.round_from_world is None:
            return directions, np.ones(len(directions))
        back = np.linalg.inv(np.asarray(self.round_from_world))
        turned, length = directions_to(directions @ back.T)
        return turned, np.abs(np.linalg.det(back)) / length**3

    @property
    def _opening(self) -> float:
        """1 − cos(angle/2), exact for narrow cones too."""
        return float(2.0 * np.sin(0.25 * self.angle) ** 2)

    def emit(self, place: Samples, way: Samples) -> Rays:
        """Return rays uniform over the round cone (see `Emitter.emit`)."""
        cone = uniform_cone(np.asarray(way, dtype=np.float64), self._opening)
        directions, growth = self._in_world(to_world(cone[None], self._round_axis[None])[0])
        return self._starts(place, directions), directions, self._attenuation(directions) * growth

    def _attenuation(self, directions: Float64Array) -> Float64Array:
        edge = np.cos(0.5 * self.angle)
        if self.round_from_world is not None:
            directions = directions_to(directions @ np.asarray(self.round_from_world).T)[0]
        above = directions @ self._round_axis - edge
        if self.blend == 0.0:
            return np.where(above > 0.0, 1.0, 0.0)
        return smoothstep(np.clip(above / (self.blend * self._opening), 0.0, 1.0))

    def unit_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:
        """Return the irradiance per power; where the cone's edge crosses the lamp, averaged over it."""
        toward, distance = directions_to(np.asarray(self.position) - points)
        share = self._attenuation(-toward)
        rows = np.flatnonzero(self._edge_crosses(toward, distance))
        step = (np.arange(_EDGE_SAMPLES) + 0.5) / _EDGE_SAMPLES
        grid = np.stack(np.meshgrid(step, step), axis=-1).reshape(1, -1, 2)
        for start in range(0, len(rows), _EDGE_CHUNK):
            part = rows[start : start + _EDGE_CHUNK]
            u = np.broadcast_to(grid, (len(part), grid.shape[1], 2))
            directions, _, plain = self._plain_rays(points[part], normals[part], u)
            lit = (plain * self._attenuation(-directions)).sum(axis=1)
            total = plain.sum(axis=1)
            share[part] = lit / np.where(total > 0.0, total, 1.0)
        return super().unit_irradiance(points, normals) * share

    def _edge_crosses(self, toward: Float64Array, distance: Float64Array) -> npt.NDArray[np.bool_]:
        """Return (n,) whether the attenuation differs over the lamp's disk or sphere as seen."""
        half = 0.5 * self.angle
        plateau = np.arccos(np.clip(np.cos(half) + self.blend * self._opening, -1.0, 1.0))
        if self.round_from_world is not None:
            # Anywhere between the narrowest plateau and the widest edge; where it finds none, the result is
            # the same.
            narrow, half = self.half_angles
            plateau = 0.0 if self.blend > 0.0 else narrow
        off_axis = np.arccos(np.clip(-(toward @ np.asarray(self.direction)), -1.0, 1.0))
        spread = np.arctan2(self.radius, distance)
        if not self.soft_falloff:
            spread = np.arcsin(np.minimum(self.radius / np.maximum(distance, np.finfo(float).tiny), 1.0))
        crosses: npt.NDArray[np.bool_] = (off_axis + spread > plateau) & (off_axis - spread < half)
        return crosses & (spread > 0.0)


def disk_rays(
    toward: Float64Array,
    distance: Float64Array,
    radius: float | Float64Array,
    normals: Float64Array,
    u: Samples,
) -> Rays:
    """Sample disks across `toward` by area, of one `radius` or (n, 1, 1); weights per intensity."""
    on_disk = radius * concentric_disk(u.astype(np.float64))
    depth = np.broadcast_to(distance[:, None, None], (*on_disk.shape[:-1], 1))
    directions, distances = directions_to(to_world(np.concatenate([on_disk, depth], axis=-1), toward))
    cosine = row_cosines(directions, normals)
    facing = np.einsum("ikj,ij->ik", directions, toward)
    # The disk's radiance times its area is the intensity.
    return directions, distances, ray_geometry_term(cosine, facing, distances)


def smoothstep(step: Float64Array) -> Float64Array:
    """Return how a spot's edge fades, by the way across it from 0 to 1."""
    return step * step * (3.0 - 2.0 * step)
