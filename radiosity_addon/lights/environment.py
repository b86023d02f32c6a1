"""Skies that differ by direction: an even part that rays meet, and bright patches that are lamps.

A latitude-longitude image holds radiance; row 0 looks down, and column and azimuth are those of an
equirectangular picture: u = ½ − atan2(y, x)/2π, v = ½ + asin(z)/π. Small bright parts, a sun above
all, would be met by few rays and give noise. What of them lies above a limit is split off into
`SkyPatch`es, which are sampled like any lamp; the rest is coarse enough to be a table of cells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..numerics import irradiance_under_sky, numbered, pick_in_runs, running_sums
from .light import Float64Array, Lamp, Light, Rays, Samples, row_cosines
from .sun_and_sky import EnvironmentLight

SKY_CELLS = (64, 128)
"""Rows and columns of the even part: cells of 2.8°."""

BRIGHT = 4.0
"""Pixels above this many times the sphere's mean belong to patches."""

PATCH_RADIUS = np.radians(15.0)
"""A patch reaches this far around its brightest pixel: its light comes from about one direction and
has about one color."""

MAX_PATCHES = 12
"""The maximum number of patches; further bright pixels stay in the uniform part."""

_CHUNK = 1 << 20
"""Points times pixels evaluated at once; bounds the temporaries to 8 MB."""

_ROUNDING = 1e-12
"""Of sines of angles."""

Bounds = tuple[float, float, float, float]
"""Of a window of the sky [rad]: lowest and highest latitude, lowest and highest azimuth."""

WHOLE_SPHERE: Bounds = (-0.5 * np.pi, 0.5 * np.pi, -np.pi, np.pi)


@dataclass(frozen=True, eq=False)
class EnvironmentImage(EnvironmentLight):
    """A sky of one color whose brightness differs by direction; a colored one is three of them.

    radiance float or (3,) float [W/m²/sr]: Where the image is 1.
    image (h, w): Relative radiance, latitudes by longitudes (see the module).
    Raises SceneError if a value is negative, NaN or infinite.
    """

    image: npt.ArrayLike

    def __post_init__(self) -> None:
        super().__post_init__()
        image = np.asarray(self.image, dtype=np.float64)
        if image.ndim != 2 or not (np.isfinite(image).all() and (image >= 0.0).all()):
            raise self._fail("its image has negative, NaN or infinite pixels", "fix its node tree")
        self._store("image", image)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of its cells."""
        height, width = np.asarray(self.image).shape
        return height, width

    def relative(self, directions: Float64Array) -> Float64Array:
        """Return (...) radiance by directions (..., 3), relative to `radiance`."""
        return np.asarray(self.image).ravel()[cell_of(directions, self.shape)]


@dataclass(frozen=True, eq=False)
class SkyPatch(Lamp):
    """A bright part of the sky, at infinity.

    irradiance float or (3,) float [W/m²]: The sum over its pixels of radiance times solid angle.
    bounds (m, 4) [rad]: Of each pixel.
    share (m,): Of the irradiance, by pixel.
    Raises SceneError if the irradiance is negative, NaN or infinite.
    """

    irradiance: npt.ArrayLike
    bounds: npt.ArrayLike
    share: npt.ArrayLike

    def __post_init__(self) -> None:
        self._set_rgb("irradiance")
        self._store("bounds", np.asarray(self.bounds, dtype=np.float64).reshape(-1, 4))
        share = np.asarray(self.share, dtype=np.float64)
        self._store("share", share / share.sum())

    @property
    def strength(self) -> Float64Array:
        """(3,) RGB irradiance [W/m²]."""
        return np.asarray(self.irradiance, dtype=np.float64)

    @property
    def direction(self) -> Float64Array:
        """(3,) the way its light travels, in the mean, of length 1."""
        return -self._mean / np.linalg.norm(self._mean)

    @property
    def half_angle(self) -> float:
        """Angle between its farthest corner and `direction` [rad]."""
        low, high, left, right = np.asarray(self.bounds).T
        corners = np.concatenate(
            [_directions(np.sin(up), azimuth) for up in (low, high) for azimuth in (left, right)]
        )
        return float(np.arccos(np.clip(corners @ -self.direction, -1.0, 1.0)).max())

    @property
    def is_distant(self) -> bool:
        """True: a point's normal alone decides what arrives."""
        return True

    def unit_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:  # noqa: ARG002
        """Return the sum over the pixels of share × cosθ (see `Lamp.unit_irradiance`).

        Where all pixels are above the horizon, this is n · mean direction; only normals whose horizon cuts
        the patch are evaluated pixel by pixel, each distinct one once.
        """
        rise = -(normals @ self.direction)
        total = np.where(rise > 0.0, normals @ self._mean, 0.0)
        cut = np.flatnonzero(np.abs(rise) < self._sine)
        if len(cut):
            # Neighbors on a flat surface have one normal: few are left to sort.
            asked = normals[cut]
            begins = np.append(True, (asked[1:] != asked[:-1]).any(axis=1))
            runs = asked[begins]
            number = numbered(runs)
            distinct = np.empty((int(number.max()) + 1, 3))
            distinct[number] = runs
            total[cut] = self._cut_by_horizon(distinct)[number][np.cumsum(begins) - 1]
        return total

    def _cut_by_horizon(self, normals: Float64Array) -> Float64Array:
        """Return (n,) the sum of share × cosθ over the pixels above each normal's horizon."""
        toward, share = self._toward.T, np.asarray(self.share)
        total = np.empty(len(normals))
        step = max(_CHUNK // len(share), 1)
        for first in range(0, len(normals), step):
            rows = slice(first, first + step)
            total[rows] = np.maximum(normals[rows] @ toward, 0.0) @ share
        return total

    def shadow_rays(self, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:  # noqa: ARG002
        """Return rays to the pixels in proportion to their shares (see `Lamp.shadow_rays`)."""
        pixel, within = pick_in_runs(running_sums(np.asarray(self.share)), u[..., 0])
        low, high, left, right = np.moveaxis(np.asarray(self.bounds)[pixel], -1, 0)
        sine = np.sin(low) + u[..., 1] * (np.sin(high) - np.sin(low))
        directions = _directions(sine, left + within * (right - left))
        endless = np.full(directions.shape[:2], np.inf)
        return directions, endless, row_cosines(directions, normals) / directions.shape[1]

    @cached_property
    def _toward(self) -> Float64Array:
        """(m, 3) the directions of the pixels' middles."""
        low, high, left, right = np.asarray(self.bounds).T
        return _directions(0.5 * (np.sin(low) + np.sin(high)), 0.5 * (left + right))

    @cached_property
    def _mean(self) -> Float64Array:
        """(3,) the mean of `_toward` by shares."""
        return np.asarray(self.share) @ self._toward

    @cached_property
    def _sine(self) -> float:
        """Sine of the largest angle between a pixel's middle and the mean; 2 if it is 90° or more."""
        cosine = float((self._toward @ -self.direction).min())
        return np.sqrt(max(1.0 - cosine * cosine, 0.0)) + _ROUNDING if cosine > 0.0 else 2.0


def cell_of(directions: Float64Array, shape: tuple[int, int]) -> npt.NDArray[np.int64]:
    """Return (...) which cell of a (h, w) image, row by row, directions (..., 3) point at."""
    height, width = shape
    latitude = np.arcsin(np.clip(directions[..., 2], -1.0, 1.0))
    azimuth = np.arctan2(directions[..., 1], directions[..., 0])
    row = np.clip(((0.5 + latitude / np.pi) * height).astype(np.int64), 0, height - 1)
    column = np.clip(((0.5 - azimuth / (2.0 * np.pi)) * width).astype(np.int64), 0, width - 1)
    return row * width + column


def cell_directions(shape: tuple[int, int]) -> Float64Array:
    """Return (h w, 3) the directions of the cells' middles."""
    low, high, left, right = pixel_bounds(shape).T
    return _directions(0.5 * (np.sin(low) + np.sin(high)), 0.5 * (left + right))


def pixel_bounds(shape: tuple[int, int], window: Bounds = WHOLE_SPHERE) -> Float64Array:
    """Return (h w, 4) the bounds of a picture's pixels; azimuths fall from left to right."""
    (height, width), (low, high, left, right) = shape, window
    latitude = np.linspace(low, high, height + 1)
    azimuth = np.linspace(right, left, width + 1)
    rows, columns = (index.ravel() for index in np.indices(shape))
    return np.stack([latitude[rows], latitude[rows + 1], azimuth[columns + 1], azimuth[columns]], axis=1)


def solid_angles(bounds: Float64Array) -> Float64Array:
    """Return (m,) [sr] of pixels' bounds."""
    low, high, left, right = bounds.T
    return (np.sin(high) - np.sin(low)) * (right - left)


def bright_patches(pixels: Float64Array) -> tuple[Float64Array, list[npt.NDArray[np.int64]]]:
    """Split off pixels that are far brighter than the mean.

    pixels (h, w, 3): Radiance of the whole sphere.
    Returns excess (h w, 3): What of each pixel's radiance is a patch's.
    Returns patches list of (m,) int: The pixels of each.
    """
    flat = pixels.reshape(-1, 3)
    shape = pixels.shape[0], pixels.shape[1]
    angle = solid_angles(pixel_bounds(shape))
    brightness = flat.mean(axis=1)
    limit = BRIGHT * float(brightness @ angle) / float(angle.sum())
    excess = flat * np.maximum(1.0 - limit / np.maximum(brightness, 1e-300), 0.0)[:, None]
    left = excess.any(axis=1)
    toward = cell_directions(shape)
    patches: list[npt.NDArray[np.int64]] = []
    while left.any() and len(patches) < MAX_PATCHES:
        brightest = int(np.argmax(np.where(left, brightness, -1.0)))
        near = left & (toward @ toward[brightest] > np.cos(PATCH_RADIUS))
        patches.append(np.flatnonzero(near))
        left &= ~near
    excess[left] = 0.0
    return excess, patches


def even_part(pixels: Float64Array, name: str = "") -> list[EnvironmentLight]:
    """Return a sky as lights: one if it has no color or is the same all around, else one a channel.

    pixels (h, w, 3): Radiance; h and w are multiples of `SKY_CELLS`, or smaller and taken as they are.
    """
    height, width = pixels.shape[:2]
    rows, columns = min(SKY_CELLS[0], height), min(SKY_CELLS[1], width)
    angle = solid_angles(pixel_bounds((height, width))).reshape(height, width, 1)
    blocks = (rows, height // rows, columns, width // columns)
    power = (pixels * angle).reshape(*blocks, 3).sum(axis=(1, 3))
    covered = angle.reshape(*blocks, 1).sum(axis=(1, 3))
    cells = power / covered
    mean = power.sum(axis=(0, 1)) / covered.sum()
    if not mean.any():
        return []
    scaled = cells / np.where(mean > 0.0, mean, 1.0)
    lit = [channel for channel in range(3) if mean[channel] > 0.0]
    if np.ptp(scaled[..., lit]) < 1e-4:
        return [EnvironmentLight(mean, name=name)]
    if np.ptp(scaled[..., lit], axis=2).max() < 1e-4:
        return [EnvironmentImage(mean, scaled[..., lit[0]], name=name)]
    return [
        EnvironmentImage(np.eye(3)[channel] * mean[channel], scaled[..., channel], name=name)
        for channel in lit
    ]


class SkyTable:
    """The light that rays leaving the scene meet, by cell.

    strengths (l, 3) or None [W/m²/sr]: What the lights have instead of their own strengths.
    """

    def __init__(self, lights: Sequence[Light], strengths: Float64Array | None = None) -> None:
        given = [light.strength for light in lights] if strengths is None else strengths
        skies = [
            (light, strength)
            for light, strength in zip(lights, given, strict=True)
            if isinstance(light, EnvironmentLight)
        ]
        images = [light for light, _ in skies if isinstance(light, EnvironmentImage)]
        self.shape = max((light.shape for light in images), default=(1, 1))
        toward = cell_directions(self.shape)
        total = np.zeros((len(toward), 3))
        for light, strength in skies:
            total += light.relative(toward)[:, None] * strength
        self.radiosity: Float64Array = irradiance_under_sky(total)
        """(cells, 3) float64: the radiosity equivalent πL [W/m²]."""

    def cells(self, directions: Float64Array) -> npt.NDArray[np.int64]:
        """Return (n,) the cells that directions (n, 3) point at."""
        if self.shape == (1, 1):
            return np.zeros(len(directions), dtype=np.int64)
        return cell_of(directions, self.shape)


def _directions(sine: Float64Array, azimuth: Float64Array) -> Float64Array:
    """Return (..., 3) unit directions by the sine of their latitudes, and their azimuths."""
    across = np.sqrt(np.maximum(1.0 - sine * sine, 0.0))
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), sine], axis=-1)
