"""Meshes as plain arrays: polygons with a material each, moved, turned and joined."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np


@dataclass(frozen=True)
class Shape:
    """Polygons; counter-clockwise seen from the front.

    Parameters
    ----------
    vertices : (n, 3) float
    faces : list of tuples of vertex numbers
    paint : list of str
        The material of each face.
    """

    vertices: np.ndarray
    faces: list[tuple[int, ...]]
    paint: list[str]

    def at(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Shape:
        return Shape(self.vertices + np.array((x, y, z)), self.faces, self.paint)

    def turned(self, degrees: float, axis: int = 2) -> Shape:
        """Turn about an axis through the origin."""
        cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        vertices = self.vertices.copy()
        vertices[:, i] = cosine * self.vertices[:, i] - sine * self.vertices[:, j]
        vertices[:, j] = sine * self.vertices[:, i] + cosine * self.vertices[:, j]
        return Shape(vertices, self.faces, self.paint)

    @property
    def triangles(self) -> int:
        return sum(len(face) - 2 for face in self.faces)


def join(shapes: Iterable[Shape]) -> Shape:
    """Put shapes into one."""
    parts = list(shapes)
    firsts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [
        tuple(int(first) + v for v in face)
        for first, part in zip(firsts[:-1], parts, strict=True)
        for face in part.faces
    ]
    return Shape(
        np.concatenate([part.vertices for part in parts]),
        faces,
        [name for part in parts for name in part.paint],
    )


def polygon(paint: str, *corners: Sequence[float]) -> Shape:
    """Return one face."""
    return Shape(np.array(corners, dtype=float), [tuple(range(len(corners)))], [paint])


def box(paint: str, size: Sequence[float], bottom: bool = True) -> Shape:
    """Return a box that stands on z = 0, centered in x and y; one on other things needs no bottom."""
    x, y, z = size[0] / 2, size[1] / 2, size[2]
    vertices = np.array(
        [(i * x, j * y, k * z) for k in (0, 1) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    )
    faces = [(4, 5, 6, 7), *((i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4))]
    if bottom:
        faces.append((3, 2, 1, 0))
    return Shape(vertices, faces, [paint] * len(faces))


def grid(paint: str, points: np.ndarray, closed: tuple[bool, bool] = (False, False)) -> Shape:
    """Return quadrilaterals between (m, n, 3) points; the front is where ∂/∂m × ∂/∂n points.

    A closed direction joins the last row to the first. Quadrilaterals with two corners at one place, as at
    the ends of a lathe, become triangles.
    """
    rows, columns, _ = points.shape
    number = np.arange(rows * columns).reshape(rows, columns)
    faces = []
    for i in range(rows if closed[0] else rows - 1):
        for j in range(columns if closed[1] else columns - 1):
            k, m = (i + 1) % rows, (j + 1) % columns
            face = [int(number[at]) for at in ((i, j), (k, j), (k, m), (i, m))]
            places = points.reshape(-1, 3)[face]
            kept = [v for v, place, last in zip(face, places, np.roll(places, 1, axis=0), strict=True) if
                    np.abs(place - last).max() > 1e-9]  # fmt: skip
            if len(kept) > 2:
                faces.append(tuple(kept))
    return Shape(points.reshape(-1, 3), faces, [paint] * len(faces))


def lathe(paint: str, profile: Sequence[tuple[float, float]], around: int) -> Shape:
    """Turn (radius, z) pairs about the z axis; listed upwards the front is outside."""
    angle = 2 * np.pi * np.arange(around) / around
    radius, z = np.array(profile, dtype=float).T
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate(
        [ring[:, None, :] * radius[None, :, None], np.broadcast_to(z[None, :, None], (around, len(z), 1))],
        axis=2,
    )
    return grid(paint, points, (True, False))


def cylinder(paint: str, radius: float, height: float, around: int, bottom: bool = False) -> Shape:
    """Return an upright cylinder on z = 0 with a top."""
    profile = [(radius, 0.0), (radius, height), (0.0, height)]
    return lathe(paint, [(0.0, 0.0), *profile] if bottom else profile, around)


def rod(paint: str, start: Sequence[float], end: Sequence[float], radius: float, around: int) -> Shape:
    """Return a cylinder between two points."""
    start, end = np.array(start, dtype=float), np.array(end, dtype=float)
    along = end - start
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    shape = cylinder(paint, radius, length, around, bottom=True)
    return Shape(shape.vertices @ np.array([x, np.cross(z, x), z]) + start, shape.faces, shape.paint)


def ball(paint: str, radius: float, around: int) -> Shape:
    """Return a sphere about the origin."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, around // 2 + 1)
    profile = [(radius * max(np.cos(a), 0.0), radius * np.sin(a)) for a in angle]
    profile[0], profile[-1] = (0.0, -radius), (0.0, radius)
    return lathe(paint, profile, around)


def cushion(paint: str, size: Sequence[float], around: int, roundness: float = 0.35) -> Shape:
    """Return a rounded box (a superellipsoid) about the origin."""
    u = np.linspace(-np.pi, np.pi, around, endpoint=False)
    v = np.linspace(-np.pi / 2, np.pi / 2, around // 2 + 1)

    def power(value: np.ndarray) -> np.ndarray:
        return np.sign(value) * np.abs(np.where(np.abs(value) < 1e-9, 0.0, value)) ** roundness

    points = 0.5 * np.stack(
        [
            size[0] * power(np.cos(v))[None] * power(np.cos(u))[:, None],
            size[1] * power(np.cos(v))[None] * power(np.sin(u))[:, None],
            size[2] * np.broadcast_to(power(np.sin(v))[None], (len(u), len(v))),
        ],
        axis=2,
    )
    return grid(paint, points, (True, False))


def wall_with_holes(
    paint: str, width: float, height: float, holes: Sequence[tuple[float, float, float, float]]
) -> Shape:
    """Return a wall in the plane y = 0 that faces +y, from the origin; holes are (x₀, z₀, x₁, z₁).

    It is cut all the way along the holes' sides, so that all vertices lie on corners.
    """
    xs = sorted({0.0, width, *(hole[i] for hole in holes for i in (0, 2))})
    zs = sorted({0.0, height, *(hole[i] for hole in holes for i in (1, 3))})
    number = {(x, z): row for row, (x, z) in enumerate((x, z) for x in xs for z in zs)}
    faces = []
    for x_0, x_1 in pairwise(xs):
        for z_0, z_1 in pairwise(zs):
            middle = (x_0 + x_1) / 2, (z_0 + z_1) / 2
            if any(h[0] < middle[0] < h[2] and h[1] < middle[1] < h[3] for h in holes):
                continue
            corners = ((x_0, z_0), (x_0, z_1), (x_1, z_1), (x_1, z_0))
            faces.append(tuple(number[corner] for corner in corners))
    vertices = np.array([(x, 0.0, z) for x, z in number])
    return Shape(vertices, faces, [paint] * len(faces))


def reveal(paint: str, window: tuple[float, float, float, float], depth: float) -> Shape:
    """Return the four inner sides of a hole in the wall y = 0, `depth` deep toward -y."""
    x_0, z_0, x_1, z_1 = window
    d = -depth
    return join(
        [
            polygon(paint, (x_0, d, z_0), (x_1, d, z_0), (x_1, 0, z_0), (x_0, 0, z_0)),
            polygon(paint, (x_0, 0, z_1), (x_1, 0, z_1), (x_1, d, z_1), (x_0, d, z_1)),
            polygon(paint, (x_0, 0, z_0), (x_0, 0, z_1), (x_0, d, z_1), (x_0, d, z_0)),
            polygon(paint, (x_1, d, z_0), (x_1, d, z_1), (x_1, 0, z_1), (x_1, 0, z_0)),
        ]
    )
