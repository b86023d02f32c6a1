"""The scenes of the figures, as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from radiosity_addon.solver import Scene

FLOOR, CEILING, WALLS = 0, 1, 2

METERS_PER_UNIT = 0.01
WHITE, GREEN, RED = (0.7386, 0.7354, 0.7507), (0.1184, 0.3831, 0.0235), (0.4508, 0.0358, 0.0117)
LAMP = np.pi * np.array([20.74, 10.86, 2.77])
"""Emission of the Cornell box's lamp [W/m²]."""

_HEIGHT = 548.8
_WALLS = [
    (WHITE, ((552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2))),
    (WHITE, ((556, _HEIGHT, 0), (556, _HEIGHT, 559.2), (0, _HEIGHT, 559.2), (0, _HEIGHT, 0))),
    (WHITE, ((549.6, 0, 559.2), (0, 0, 559.2), (0, _HEIGHT, 559.2), (556, _HEIGHT, 559.2))),
    (GREEN, ((0, 0, 559.2), (0, 0, 0), (0, _HEIGHT, 0), (0, _HEIGHT, 559.2))),
    (RED, ((552.8, 0, 0), (549.6, 0, 559.2), (556, _HEIGHT, 559.2), (556, _HEIGHT, 0))),
]
_BLOCKS = [
    (165.0, ((130, 65), (82, 225), (240, 272), (290, 114))),
    (330.0, ((423, 247), (265, 296), (314, 456), (472, 406))),
]
_LAMP = ((213, 548.7, 227), (343, 548.7, 227), (343, 548.7, 332), (213, 548.7, 332))


def quad(corners: Any) -> np.ndarray:
    """Return the (2, 3, 3) triangles of a quadrilateral."""
    a, b, c, d = np.asarray(corners, dtype=float)
    return np.array([[a, b, c], [a, c, d]])


def grid(corner: Any, edge_u: Any, edge_v: Any, n: int = 1) -> np.ndarray:
    """Return (2 n², 3, 3) triangles of a rectangle; the front is where edge_u × edge_v points."""
    corner, u, v = (np.asarray(vector, dtype=float) for vector in (corner, edge_u, edge_v))
    cells = [
        quad([corner + (i + di) * u / n + (j + dj) * v / n for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1))])
        for i in range(n)
        for j in range(n)
    ]
    return np.concatenate(cells)


def box(size: Any = (1, 1, 1), n: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return the inward triangles of a closed box from the origin, and each one's wall."""
    x, y, z = np.diag(np.asarray(size, dtype=float))
    parts = [
        grid((0, 0, 0), x, y, n),
        grid(z, y, x, n),
        grid((0, 0, 0), y, z, n),
        grid(x, z, y, n),
        grid((0, 0, 0), z, x, n),
        grid(y, x, z, n),
    ]
    return np.concatenate(parts), np.repeat(np.arange(6), 2 * n * n)


def cube(reflectance: float, n: int = 1, ceiling: float = 1.0) -> tuple[Scene, np.ndarray]:
    """Return a unit cube whose ceiling emits, and each triangle's wall."""
    triangles, wall = box(n=n)
    emission = np.zeros((len(triangles), 3))
    emission[wall == CEILING] = ceiling
    return Scene(triangles, np.full((len(triangles), 3), reflectance), emission), wall


def cornell_box(gain: float | None = None) -> Scene:
    """Return the Cornell box [m] with its lamp as an emitting rectangle.

    `gain` replaces all reflectances by one gray value.
    """
    parts, colors = [], []
    for color, corners in _WALLS:
        parts.append(quad(corners))
        colors += [color] * 2
    for height, footprint in _BLOCKS:
        block = _block(height, footprint)
        parts.append(block)
        colors += [WHITE] * len(block)
    parts.append(quad(_LAMP))
    colors += [(0.0, 0.0, 0.0)] * 2
    # Cornell's x points left and its y up; here x points right, y into the room and z up.
    triangles = np.concatenate(parts) * METERS_PER_UNIT
    triangles = np.stack([2.78 - triangles[..., 0], triangles[..., 2], triangles[..., 1]], axis=-1)
    reflectance = np.array(colors)
    if gain is not None:
        reflectance = np.where(reflectance.max(axis=1, keepdims=True) > 0, gain, 0.0) * np.ones(3)
    emission = np.zeros_like(reflectance)
    emission[-2:] = LAMP
    return Scene(triangles, reflectance, emission)


def _block(height: float, footprint: Any) -> np.ndarray:
    """Return the top and sides of a block, seen from outside."""
    below = [np.array([x, 0.0, z]) for x, z in footprint]
    above = [corner + np.array([0.0, height, 0.0]) for corner in below]
    sides = [quad([below[i - 1], below[i], above[i], above[i - 1]]) for i in range(4)]
    return np.concatenate([quad(above), *sides])
