"""What points get of each light apart, per unit of its strength: kept, it relights them without rays.

Of many lights it is kept in half precision.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...numerics import Array, Scratch, marked, row_numbers, tiles

SPARSE = 0.5
"""A light that reaches less than this part of the points is kept as the rows it reaches: 8 bytes each; else
as 4 bytes a point."""

HALF_BITS = 14
"""Half precision holds numbers below 2^16, and no finer parts than 2^-24: gains are kept from here down."""


def by_channel(gain: Array) -> Array:
    """Return (n, 3) gains, of (n,) that are the same of all channels."""
    return gain if gain.ndim == 2 else np.repeat(gain[:, None], 3, axis=1)


def alike(one: Array, other: Array) -> tuple[Array, Array]:
    """Return two gains, (n,) or (n, 3), both by channel if either is."""
    return (one, other) if one.ndim == other.ndim else (by_channel(one), by_channel(other))


class LightGains:
    """Of n points and the lights put in: unoccluded irradiance per unit of strength times visibility.

    count: n.
    scratch: Makes the arrays; None keeps them in memory.
    gain_of dict of int to (rows or None, gain): Of each light: (k,) float32 at the rows that it reaches, (k,)
        int32; None for all rows. (k, 3) by channel where its light passes glass.
    """

    STORED: tuple[str, ...] = ("count", "gain_of")

    _scratch: Scratch | None = None

    def __init__(self, count: int, scratch: Scratch | None = None) -> None:
        self.count = count
        self._scratch = scratch
        self.gain_of: dict[int, tuple[Array | None, Array]] = {}

    def __len__(self) -> int:
        return self.count

    @property
    def nbytes(self) -> int:
        """What they take in memory."""
        return sum(gain.nbytes + (0 if rows is None else rows.nbytes) for rows, gain in self.gain_of.values())

    def put(self, light: int, gain: Array) -> None:
        """Keep the gain of a light, which has this number, at all points: (n,), or (n, 3) by channel."""
        scratch = self._scratch or Scratch()
        if gain.ndim == 2 and not marked(self.count, lambda tile: np.ptp(gain[tile], axis=1) > 0).any():
            gain = gain[:, 0]
        lit = gain if gain.ndim == 1 else marked(self.count, lambda tile: gain[tile].any(axis=1))
        width = 1 if gain.ndim == 1 else 3
        if np.count_nonzero(lit) < SPARSE * self.count:
            rows, kept = row_numbers(lit), scratch.rows(width, np.float32)
            for tile in tiles(len(rows)):
                kept.extend(gain[rows[tile]].astype(np.float32))
            self.gain_of[light] = rows, kept.all() if width > 1 else kept.all()[:, 0]
        else:
            single = scratch.empty(gain.shape, np.float32)
            for tile in tiles(self.count):
                single[tile] = gain[tile]
            self.gain_of[light] = None, single

    def of(self, light: int) -> Array:
        """Return (n,) or (n, 3) float32: the gain of a light; 0 of one that was not put in."""
        rows, gain = self.gain_of.get(light, (np.zeros(0, np.int32), np.zeros(0, np.float32)))
        if rows is None:
            return gain.copy()
        everywhere = np.zeros((self.count, *gain.shape[1:]), dtype=np.float32)
        everywhere[rows] = gain
        return everywhere

    def take(self, points: Array) -> LightGains:
        """Return those of some points, row numbers or a mask."""
        result = LightGains(len(np.arange(self.count)[points]))
        for light in self.gain_of:
            result.put(light, self.of(light)[points])
        return result

    @staticmethod
    def joined(parts: Sequence[LightGains]) -> LightGains:
        """Put the points of several one after the other."""
        result = LightGains(sum(len(part) for part in parts))
        for light in sorted({light for part in parts for light in part.gain_of}):
            gains = [part.of(light) for part in parts]
            if any(gain.ndim == 2 for gain in gains):
                gains = [by_channel(gain) for gain in gains]
            result.put(light, np.concatenate(gains))
        return result

    def irradiance(self, strengths: Array) -> Array:
        """Return (n, 3) float64 what arrives [W/m²] from lights of (k, 3) strengths, visibility included."""
        total = (self._scratch or Scratch()).zeros((self.count, 3))
        for light, (rows, gain) in self.gain_of.items():
            if not strengths[light].any():
                continue
            for tile in tiles(len(gain)):
                own = gain[tile].astype(np.float64)
                arriving = (own if own.ndim == 2 else own[:, None]) * strengths[light]
                total[tile if rows is None else rows[tile]] += arriving
        return total


class CompactGains(LightGains):
    """Of many lights: half the precision.

    scale_of dict of int to float: What the gains of each light are kept in units of.
    """

    STORED = ("count", "gain_of", "scale_of")

    SPARSE = 1.0 / 3.0
    """As `SPARSE`, of gains of two bytes."""

    def __init__(self, count: int, scratch: Scratch | None = None) -> None:
        super().__init__(count, scratch)
        self.scale_of: dict[int, float] = {}

    def put(self, light: int, gain: Array) -> None:
        """Keep the gain of a light at all points: (n,), or (n, 3) by channel."""
        super().put(light, gain)
        rows, single = self.gain_of[light]
        if rows is not None and len(rows) >= self.SPARSE * self.count:
            rows, single = None, super().of(light)
        largest = float(single.max(initial=0.0))
        # A power of two, so that only what is far below the largest loses precision.
        scale = float(2.0 ** (np.floor(np.log2(largest)) - HALF_BITS)) if largest > 0.0 else 1.0
        half = (self._scratch or Scratch()).empty(single.shape, np.float16)
        for tile in tiles(len(single)):
            half[tile] = single[tile] / np.float32(scale)
        self.gain_of[light], self.scale_of[light] = (rows, half), scale

    def of(self, light: int) -> Array:
        """Return (n,) or (n, 3) float32: the gain of a light; 0 of one that was not put in."""
        return np.asarray(super().of(light).astype(np.float32) * np.float32(self.scale_of.get(light, 1.0)))

    def take(self, points: Array) -> LightGains:
        """Return those of some points, row numbers or a mask."""
        result = CompactGains(len(np.arange(self.count)[points]))
        for light in self.gain_of:
            result.put(light, self.of(light)[points])
        return result

    def irradiance(self, strengths: Array) -> Array:
        """Return (n, 3) float64 what arrives [W/m²] (see `LightGains.irradiance`)."""
        scaled = strengths.astype(np.float64, copy=True)
        for light, scale in self.scale_of.items():
            scaled[light] *= scale
        return super().irradiance(scaled)
