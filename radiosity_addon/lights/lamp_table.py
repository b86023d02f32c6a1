"""Many lamps as arrays: about what each gives a point, and rays to chosen ones.

Lamps of Blender's common kinds are evaluated for all points and lamps at once: bulbs (point and spot lamps)
by their closed form, flat lamps as disks. Where that is not exact, because a lamp is near, the horizon cuts
it or the edge of a cone does, a pair of point and lamp is *near*: the lamp's own method answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from ..form_factors import ray_geometry_term, throughput
from ..numerics import along_curve, concentric_disk, intensity_of_flux, radiance_of_flux, run_starts
from .area import AreaLight
from .light import Emitter, Float64Array, Rays, Samples, directions_to, row_cosines
from .point import PointLight, SpotLight, disk_rays, smoothstep

Float32Array = npt.NDArray[np.float32]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
Afar = tuple[Float32Array, BoolArray]
"""(n, k) gains, and which pairs are near."""

FAR = 10.0
"""A flat lamp that is farther than this many of its radii sends like a disk of its area: to less than 1 %."""

ROUNDED = 1e-5
"""Heights of single precision are right to this part of the scene's extent."""

TINY = np.float32(1e-30)
"""Divisors are no smaller."""

BEAM_SLACK = 1e-6
"""Cosines of single precision are right to this."""


class LampTable:
    """m lamps: bulbs first, then flat lamps, then all others; each kind along a curve that fills space.

    members (m,): As sorted; `order` (m,) int holds their numbers before.
    """

    def __init__(self, lamps: Sequence[Emitter]) -> None:
        kind = np.array([_kind(lamp) for lamp in lamps])
        places = np.array([_place(lamp) for lamp in lamps], dtype=np.float64).reshape(-1, 3)
        self.order: IntArray = np.lexsort((along_curve(places), kind))
        self.members = tuple(lamps[number] for number in self.order)
        self.bulbs, self.ends = int((kind == 0).sum()), int((kind <= 1).sum())
        self.places: Float64Array = places[self.order]
        # Single precision is too coarse for places far from the origin.
        self._origin: Float64Array = places.mean(axis=0)
        bulbs = [lamp for lamp in self.members[: self.bulbs] if isinstance(lamp, PointLight | SpotLight)]
        flat = [lamp for lamp in self.members[self.bulbs : self.ends] if isinstance(lamp, AreaLight)]
        self._disk = np.array([lamp.radius for lamp in bulbs])
        self._is_ball = np.array([not lamp.soft_falloff and lamp.radius > 0.0 for lamp in bulbs], dtype=bool)
        spots = [lamp for lamp in bulbs if isinstance(lamp, SpotLight)]
        self._beams = np.flatnonzero([isinstance(lamp, SpotLight) for lamp in bulbs])
        self._axis = np.array([lamp.direction for lamp in spots], dtype=np.float64).reshape(-1, 3)
        self._edge = np.array([np.cos(0.5 * lamp.angle) for lamp in spots])
        self._fade = np.array([lamp.blend * 2.0 * np.sin(0.25 * lamp.angle) ** 2 for lamp in spots])
        self._beam_of = np.full(self.bulbs, -1)
        self._beam_of[self._beams] = np.arange(len(spots))
        halves = np.array([lamp.half_axes for lamp in flat], dtype=np.float64).reshape(-1, 3, 3)
        self._halves: Float64Array = halves[:, 1:]
        self._area = np.array([lamp.area for lamp in flat])
        self._is_round = np.array([lamp.shape == "ellipse" for lamp in flat], dtype=bool)
        facing = np.cross(self._halves[:, 0], self._halves[:, 1])
        self._facing: Float64Array = facing / np.linalg.norm(facing, axis=1, keepdims=True)
        diagonals = np.stack([self._halves.sum(axis=1), self._halves[:, 0] - self._halves[:, 1]], axis=1)
        # What is evaluated in single precision, a row a coordinate.
        self._single = (self.places - self._origin).T.astype(np.float32)
        self._turned = self._facing.T.astype(np.float32)
        self._radius = np.linalg.norm(diagonals, axis=2).max(axis=1, initial=0.0).astype(np.float32)
        self._size, self._bulb = self._area.astype(np.float32), self._disk.astype(np.float32)

    def __len__(self) -> int:
        return len(self.members)

    def afar(self, points: Float64Array, normals: Float64Array) -> Afar:
        """Return (n, m) float32 about what each lamp gives each point per unit of strength, and what is near.

        Near pairs have more than 0 wherever they may get any light.
        """
        apart = (points - self._origin).astype(np.float32)
        up = normals.astype(np.float32)
        gain = np.empty((len(points), len(self)), dtype=np.float32)
        near = np.zeros(gain.shape, dtype=bool)
        slack = np.float32(ROUNDED * np.abs(apart).max(initial=0.0))
        first, last = self.bulbs, self.ends
        if first:
            gain[:, :first], near[:, :first] = self._bulbs_afar(apart, up, slack)
        if last > first:
            gain[:, first:last], near[:, first:last] = self._flat_afar(apart, up, slack)
        for number in range(last, len(self)):
            gain[:, number] = self.members[number].unit_irradiance(points, normals)
            near[:, number] = gain[:, number] > 0.0
        return gain, near

    def _bulbs_afar(self, apart: Float32Array, up: Float32Array, slack: np.float32) -> Afar:
        along, rise, square = self._seen(apart, up, slice(0, self.bulbs))
        radius = self._bulb
        # The horizon may cut the lamp's disk.
        near = (np.abs(rise) < radius + slack) & (radius > 0)
        distance = np.sqrt(square)
        square += np.where(self._is_ball, np.float32(0.0), radius * radius)
        np.maximum(square, np.maximum(radius * radius, TINY), out=square)
        height = np.maximum(rise, 0.0, out=rise)
        row, lamp = np.nonzero(near)
        height[row, lamp] = np.maximum(height[row, lamp], radius[lamp])
        square *= np.maximum(distance, TINY)
        height *= np.float32(intensity_of_flux(1.0))
        gain = np.divide(height, square, out=height)
        if len(self._beams):
            shares, crosses = self._beam_shares(
                [way[:, self._beams] for way in along], distance[:, self._beams]
            )
            gain[:, self._beams] *= shares
            near[:, self._beams] |= crosses
        return gain, near

    def _beam_shares(self, along: list[Float32Array], distance: Float32Array) -> Afar:
        """Return (n, k) what spots send toward points, of their intensity, and where their edges cross."""
        axis, radius = self._axis.T.astype(np.float32), self._bulb[self._beams]
        away = np.maximum(distance, TINY)
        ahead = -(along[0] * axis[0] + along[1] * axis[1] + along[2] * axis[2]) / away
        above = ahead - self._edge.astype(np.float32)
        reach = radius / np.maximum(away, radius) + np.float32(BEAM_SLACK)
        crosses = (above > -reach) & (above < self._fade.astype(np.float32) + reach) & (radius > 0)
        share = smoothstep(np.clip(above / np.maximum(self._fade, TINY).astype(np.float32), 0.0, 1.0))
        # A cone's edge that crosses the disk lights points beyond it, too.
        return np.where(crosses, np.maximum(share, np.float32(0.5)), share), crosses

    def _flat_afar(self, apart: Float32Array, up: Float32Array, slack: np.float32) -> Afar:
        (x, y, z), rise, square = self._seen(apart, up, slice(self.bulbs, self.ends))
        radius, facing = self._radius, self._turned
        x *= facing[0]
        y *= facing[1]
        z *= facing[2]
        x += y
        x += z
        ahead = np.negative(x, out=x)
        above = rise > radius + slack
        far = (square > (FAR * radius) ** 2) & above & (ahead > slack)
        near = (rise > -(radius + slack)) & (ahead > -slack) & ~far
        row, lamp = np.nonzero(near)
        least = np.float32(0.5) * radius[lamp]
        bound = np.maximum(rise[row, lamp], least) * np.maximum(ahead[row, lamp], least)
        beyond = square[row, lamp] + least * least
        rise *= ahead
        divisor = np.multiply(square, np.float32(np.pi), out=y)
        divisor += self._size
        divisor *= square
        np.maximum(divisor, TINY, out=divisor)
        rise /= divisor
        gain = np.multiply(rise, far, out=rise)
        gain[row, lamp] = bound / (beyond * (np.float32(np.pi) * beyond + self._size[lamp]))
        return gain, near

    def _seen(
        self, apart: Float32Array, up: Float32Array, columns: slice
    ) -> tuple[list[Float32Array], Float32Array, Float32Array]:
        """Return the way from points to lamps, (n, k) for each coordinate, its height and its square."""
        along = [self._single[axis, columns] - apart[:, axis, None] for axis in range(3)]
        x, y, z = along
        rise, square, product = x * up[:, :1], x * x, y * up[:, 1:2]
        rise += product
        rise += np.multiply(z, up[:, 2:], out=product)
        square += np.multiply(y, y, out=product)
        square += np.multiply(z, z, out=product)
        return along, rise, square

    def exactly(self, lamp: IntArray, points: Float64Array, normals: Float64Array) -> Float64Array:
        """Return (p,) the exact unoccluded irradiance per unit of strength of lamps (p,) at a point each."""
        gain = np.empty(len(lamp))
        for number, rows in _each_lamp(lamp):
            gain[rows] = self.members[number].unit_irradiance(points[rows], normals[rows])
        return gain

    def rays(self, lamp: IntArray, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return a ray each from (p, 3) points to lamps (p,) by (p, 2) numbers (see `Lamp.shadow_rays`).

        Weights are those of one ray alone: in the mean the unoccluded irradiance.
        """
        found = np.empty((len(lamp), 3)), np.empty(len(lamp)), np.empty(len(lamp))
        disk = np.append(~self._is_ball, np.zeros(len(self) - self.bulbs, dtype=bool))[lamp]
        flat = (lamp >= self.bulbs) & (lamp < self.ends)
        ways: list[tuple[IntArray, Callable[..., Rays]]] = [
            (np.flatnonzero(disk), self._rays_to_disks),
            (np.flatnonzero(flat), self._rays_to_flat),
        ]
        for rows, way in ways:
            own = way(lamp[rows], points[rows], normals[rows], u[rows])
            for into, values in zip(found, own, strict=True):
                into[rows] = values
        rest = np.flatnonzero(~disk & ~flat)
        for number, which in _each_lamp(lamp[rest]):
            rows = rest[which]
            own = self.members[number].shadow_rays(points[rows], normals[rows], u[rows, None])
            for into, values in zip(found, own, strict=True):
                into[rows] = values[:, 0]
        return found

    def _rays_to_disks(self, lamp: IntArray, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        toward, distance = directions_to(self.places[lamp] - points)
        radius = self._disk[lamp, None, None]
        directions, distances, weights = disk_rays(toward, distance, radius, normals, u[:, None])
        directions, weights = directions[:, 0], weights[:, 0] * intensity_of_flux(1.0)
        beam = self._beam_of[lamp]
        rows = np.flatnonzero(beam >= 0)
        if len(rows):
            beam = beam[rows]
            above = -np.einsum("pk,pk->p", directions[rows], self._axis[beam]) - self._edge[beam]
            fade = self._fade[beam]
            share = smoothstep(np.clip(above / np.where(fade > 0.0, fade, 1.0), 0.0, 1.0))
            weights[rows] *= np.where(fade > 0.0, share, above > 0.0)
        return directions, distances[:, 0], weights

    def _rays_to_flat(self, lamp: IntArray, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        number, square = lamp - self.bulbs, np.asarray(u, dtype=np.float64)
        across = np.where(self._is_round[number, None], concentric_disk(square), 2.0 * square - 1.0)
        samples = self.places[lamp] + np.einsum("pa,pak->pk", across, self._halves[number])
        directions, distances = directions_to(samples - points)
        facing = -np.einsum("pk,pk->p", directions, self._facing[number])
        cosine = row_cosines(directions[:, None], normals)[:, 0]
        area = self._area[number]
        thrown = throughput(ray_geometry_term(cosine, facing, distances), 1.0, area)
        return directions, distances, radiance_of_flux(1.0, area) * thrown


def _kind(lamp: Emitter) -> int:
    """Return 0 for bulbs, 1 for flat lamps without a soft-box, 2 for all others."""
    if isinstance(lamp, PointLight) or (isinstance(lamp, SpotLight) and lamp.round_from_world is None):
        return 0
    return 1 if isinstance(lamp, AreaLight) and lamp.is_open else 2


def _place(lamp: Emitter) -> npt.ArrayLike:
    return np.asarray(getattr(lamp, "position", (0.0, 0.0, 0.0)))


def _each_lamp(lamp: IntArray) -> Iterator[tuple[int, IntArray]]:
    """Yield every lamp of a list (p,), and where it is in the list."""
    order = np.argsort(lamp, kind="stable")
    numbers, count = np.unique(lamp, return_counts=True)
    for number, first, length in zip(numbers, run_starts(count), count, strict=True):
        yield int(number), order[first : first + length]
