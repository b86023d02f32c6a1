"""Scenes for the solver's tests, as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from radiosity_addon.solver import PointLight, Scene

FLOOR, CEILING, WALLS = 0, 1, 2


def rectangle(corner: Any, edge_u: Any, edge_v: Any, n: int = 1) -> np.ndarray:
    """Return (2 n², 3, 3) triangles of a grid; the front is where edge_u × edge_v points."""
    corner, edge_u, edge_v = (np.asarray(v, dtype=float) for v in (corner, edge_u, edge_v))
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")

    def at(di: int, dj: int) -> np.ndarray:
        return np.asarray(
            corner + (i + di)[..., None] * edge_u / n + (j + dj)[..., None] * edge_v / n
        ).reshape(-1, 3)

    a, b, c, d = at(0, 0), at(1, 0), at(1, 1), at(0, 1)
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def box_room(size: Any = (1, 1, 1), n: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return the inward triangles of a closed box from the origin, and their surface.

    The surface is FLOOR, CEILING, or WALLS and up: x = 0, x = size, y = 0, y = size.
    """
    x, y, z = np.diag(np.asarray(size, dtype=float))
    parts = [
        rectangle((0, 0, 0), x, y, n),
        rectangle(z, y, x, n),
        rectangle((0, 0, 0), y, z, n),
        rectangle(x, z, y, n),
        rectangle((0, 0, 0), z, x, n),
        rectangle(y, x, z, n),
    ]
    return np.concatenate(parts), np.repeat(np.arange(6), 2 * n * n)


def solid_box(lower: Any, upper: Any) -> np.ndarray:
    """Return the (12, 3, 3) outward triangles of a closed box."""
    lower, upper = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
    inward, _ = box_room(upper - lower)
    return np.ascontiguousarray(lower + inward[:, [0, 2, 1]])


def sphere(subdivisions: int) -> np.ndarray:
    """Return the inward triangles of an octahedron subdivided onto the unit sphere."""
    x, y, z = np.eye(3)
    triangles = np.array(
        [
            [sx * x, sy * y, sz * z] if sx * sy * sz < 0 else [sy * y, sx * x, sz * z]
            for sx in (-1, 1)
            for sy in (-1, 1)
            for sz in (-1, 1)
        ]
    )
    for _ in range(subdivisions):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        ab, bc, ca = a + b, b + c, c + a
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
        triangles /= np.linalg.norm(triangles, axis=2, keepdims=True)
    return triangles


def gray(count: int, value: float) -> np.ndarray:
    """Return (count, 3) rows of one value."""
    return np.full((count, 3), float(value))


def gray_scene(triangles: np.ndarray, reflectance: float = 0.5, emission: Any = 0.0, **more: Any) -> Scene:
    """Return a scene of one reflectance, and of one emission or the (t, 3) emission given."""
    count = len(triangles)
    emission = gray(count, emission) if np.ndim(emission) == 0 else emission
    return Scene(triangles, gray(count, reflectance), emission, **more)


def area_mean(values: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Return the (3,) area-weighted mean of (t, 3) values."""
    return np.asarray(areas @ values / areas.sum())


def colored_room() -> Scene:
    """A closed room with a box in it, a lamp, and walls of three colors, one of them black."""
    room, surface = box_room((3, 2, 2))
    triangles = np.concatenate([room, solid_box((0.5, 0.5, 0.3), (1.2, 1.2, 1.0))])
    reflectance = gray(len(triangles), 0.6)
    reflectance[:12][surface == 2] = (0.9, 0.1, 0.0)
    reflectance[:12][surface == 3] = 0.0
    lamp = PointLight((2.5, 1.5, 1.5), 50.0)
    return Scene(triangles, reflectance, gray(len(triangles), 0.0), lights=[lamp])
