"""What groups of faces send each way, for groups that face many ways: a bulb is one lamp from afar.

A group's light at a point, Σ w max(n · ω, 0) cos θ / π d², is expanded around the group's center to first
order in its size: the area that shows along a direction, and how the places of its faces change distance and
cosines. Tables hold both over the octahedral map of directions (Meyer et al., On floating-point normal
vectors, 2010). What is left out is of second order: 3 (r / d)² for two plates back to back.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array

STEPS = 24
"""Of the table along a side: a step is 7°."""


class DirectionTable:
    """Tables of k groups of faces.

    centroid (m, 3) [m], normals (m, 3), weight (m,) [m²]: Of faces.
    center (k, 3) [m], begin, end (k,) int: The groups, runs of faces.
    """

    def __init__(
        self, centroid: Array, normals: Array, weight: Array, center: Array, begin: Array, end: Array
    ) -> None:
        steps = np.linspace(-1.0, 1.0, STEPS + 1)
        places_on_map = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
        directions = _unfolded(places_on_map)
        self._rows = np.empty((len(begin), len(directions), 5), dtype=np.float32)
        if len(begin) == 0:
            return
        origin = centroid.mean(axis=0)
        places, center = centroid - origin, center - origin
        rises = np.einsum("mk,mk->m", normals, places)
        for number, along in enumerate(directions):
            shown = np.maximum(normals @ along, 0.0) * weight
            there = np.where(shown > 0.0, weight, 0.0)
            columns = (shown, *(shown[:, None] * places).T, there * rises, *(there[:, None] * normals).T)
            sums = np.zeros((len(columns), len(weight) + 1))
            np.cumsum(columns, axis=1, out=sums[:, 1:])
            area, x, y, z, rise, *facing = sums[:, end] - sums[:, begin]
            moment = np.stack([x, y, z], axis=1) - area[:, None] * center
            rise -= np.einsum("ck,kc->k", np.array(facing), center)
            self._rows[:, number, 0] = area
            self._rows[:, number, 1] = 4.0 * (moment @ along) - rise
            self._rows[:, number, 2:] = moment

    def area(self, table: Array, along: Array) -> Array:
        """Return (p,) the areas that show along unit directions (p, 3) [m²]."""
        return np.asarray(self._at(table, along)[:, 0])

    def factors(self, table: Array, along: Array, normals: Array, rise: Array, distance: Array) -> Array:
        """Return (p,) what points get from groups per unit of strength.

        along, normals (p, 3): From the groups' centers to the points; the points' normals.
        rise, distance (p,): Of the centers above the points' horizons, and to them [m].
        """
        area, change, x, y, z = self._at(table, along / distance[:, None]).T
        # Not summed in an order that depends on how many ask.
        inclined = x * normals[:, 0] + y * normals[:, 1] + z * normals[:, 2]
        found = rise * (area + change / distance) + inclined
        return np.asarray(np.maximum(found, 0.0) / (np.pi * distance**3))

    def _at(self, table: Array, along: Array) -> Array:
        """Return (p, 5) the tables' rows along unit directions (p, 3), interpolated."""
        place = (_folded(along) + 1.0) * (0.5 * STEPS)
        cell = np.minimum(place.astype(np.int64), STEPS - 1)
        (x, y), first = (place - cell).T, cell[:, 0] * (STEPS + 1) + cell[:, 1]
        found = np.zeros((len(table), 5))
        shares = ((1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y)
        for step, share in zip((0, 1, STEPS + 1, STEPS + 2), shares, strict=True):
            found += share[:, None] * self._rows[table, first + step]
        return found


def _folded(directions: Array) -> Array:
    """Return (n, 2) in [−1, 1]: unit directions (n, 3) on the octahedral map."""
    flat = directions[:, :2] / np.abs(directions).sum(axis=1, keepdims=True)
    return np.where(directions[:, 2:] < 0.0, _over_the_rim(flat), flat)


def _unfolded(places: Array) -> Array:
    """Return (n, 3) the unit directions of places (n, 2) on the octahedral map."""
    height = 1.0 - np.abs(places).sum(axis=1, keepdims=True)
    flat = np.where(height < 0.0, _over_the_rim(places), places)
    directions = np.concatenate([flat, height], axis=1)
    return np.asarray(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def _over_the_rim(flat: Array) -> Array:
    return np.asarray((1.0 - np.abs(flat[:, ::-1])) * np.where(flat < 0.0, -1.0, 1.0))
