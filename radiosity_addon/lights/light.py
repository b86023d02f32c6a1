"""The interface of all lights, and checks of their values."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base import SceneError

Float64Array = npt.NDArray[np.float64]
Rays = tuple[Float64Array, Float64Array, Float64Array]
"""Rays as `Lamp.shadow_rays` or `Emitter.emit` give them."""

Samples = npt.NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Light:
    """A light other than the scene's surfaces; `name` is for messages only."""

    name: str = ""

    @property
    def strength(self) -> Float64Array:
        """(3,) RGB: a lamp's power [W], a sun's irradiance [W/m²], a sky's radiance [W/m²/sr]."""
        raise NotImplementedError

    def _fail(self, what: str, fix: str) -> SceneError:
        kind = type(self).__name__.removesuffix("Light").lower()
        return SceneError(f"{kind} light{f' {self.name!r}' if self.name else ''}: {what}; {fix}")

    def _set_rgb(self, field: str) -> None:
        """Replace the field, a number or RGB triple, by a read-only (3,) float64."""
        value = np.asarray(getattr(self, field), dtype=np.float64)
        if value.shape not in ((), (3,)):
            raise self._fail(f"{field} has shape {value.shape}", "give a number or an RGB triple")
        if not (np.isfinite(value).all() and (value >= 0.0).all()):
            raise self._fail(f"{field} {value.tolist()} is negative, NaN or infinite", "set it to 0 or more")
        self._store(field, np.broadcast_to(value, (3,)))

    def _set_vector(self, field: str, unit: bool = False) -> None:
        """Replace the field by a read-only (3,) float64, normalized if `unit`."""
        value = np.asarray(getattr(self, field), dtype=np.float64)
        if value.shape != (3,) or not np.isfinite(value).all():
            raise self._fail(f"{field} {value.tolist()} is not finite and (3,)", "reset its transform")
        if unit:
            length = np.linalg.norm(value)
            if length == 0.0:
                raise self._fail(f"{field} has no length", "set its scale to something other than 0")
            value = value / length
        self._store(field, value)

    def _set_number(self, field: str, low: float, high: float, above: bool = False) -> None:
        """Replace the field by a float, refusing values outside [low, high], or (low, high] if `above`."""
        value = float(getattr(self, field))
        if not (np.isfinite(value) and low <= value <= high and not (above and value == low)):
            allowed = f"{'above' if above else 'from'} {low:g}" + (f" to {high:g}" if high < 1e300 else "")
            raise self._fail(f"{field} {value} is out of range", f"set it {allowed}")
        object.__setattr__(self, field, value)

    def _store(self, field: str, value: Float64Array) -> None:
        value = value.copy()
        value.flags.writeable = False
        object.__setattr__(self, field, value)


@dataclass(frozen=True, eq=False, kw_only=True)
class Lamp(Light, ABC):
    """A light with a place or direction of its own: all but the environment.

    casts_shadow: Whether what stands between it and a surface takes its light away.
    """

    casts_shadow: bool = True

    @property
    def is_distant(self) -> bool:
        """Whether unoccluded irradiance depends on a receiver's normal alone, not on its place."""
        return False

    @abstractmethod
    def unit_irradiance(self, points: Float64Array, normals: Float64Array) -> Float64Array:
        """Return the unoccluded irradiance per unit of strength, clipped to the receivers' horizons.

        points (n, 3).
        normals (n, 3), unit.
        Returns irradiance (n,).
        """

    @abstractmethod
    def shadow_rays(self, points: Float64Array, normals: Float64Array, u: Samples) -> Rays:
        """Return rays to k samples of the lamp as each point sees it.

        points (n, 3).
        normals (n, 3), unit.
        u (n, k, 2) float in [0, 1): Points in the unit square, stratified in each row.
        Returns directions (n, k, 3), unit.
        Returns distances (n, k): To the sample [m]; infinite for the sun.
        Returns weights (n, k): Share of the irradiance each ray stands for, 0 where it adds none; their sum
            over a row estimates `unit_irradiance`, and Σ w v / Σ w the visibility.
        """


class Emitter(Lamp):
    """A lamp in the scene: it sends out a finite power."""

    @property
    @abstractmethod
    def flux(self) -> Float64Array:
        """(3,) RGB power it sends out [W]."""

    @abstractmethod
    def emit(self, place: Samples, way: Samples) -> Rays:
        """Return rays that carry the lamp's light away.

        place, way (n, 2) float in [0, 1): Choose where on the lamp a ray starts, and its direction.
        Returns origins, directions (n, 3).
        Returns shares (n,): Proportional to the power each ray stands for.
        """


def directions_to(offsets: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return unit directions (..., 3) and lengths (...) of vectors; a zero vector stays zero."""
    lengths = np.sqrt(np.einsum("...j,...j->...", offsets, offsets))
    return offsets / np.where(lengths > 0.0, lengths, 1.0)[..., None], lengths


def row_cosines(directions: Float64Array, normals: Float64Array) -> Float64Array:
    """Return (n, k) cosines above the horizon of (n, k, 3) directions about (n, 3) normals, else 0."""
    return np.maximum(np.einsum("ikj,ij->ik", directions, normals), 0.0)
