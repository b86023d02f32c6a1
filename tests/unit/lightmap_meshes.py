"""Small meshes and UV helpers for the lightmap tests."""

from __future__ import annotations

import numpy as np

QUAD = np.array([[0, 1, 2], [0, 2, 3]])


def quads(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (2n, 3, 3) and polygons (2n,) of (n, 4, 3) quads."""
    corners = np.asarray(corners, dtype=float)
    return corners[:, QUAD].reshape(-1, 3, 3), np.repeat(np.arange(len(corners)), 2)


def box(
    size: tuple[float, float, float], at=(0.0, 0.0, 0.0), turn: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """A closed box of six quads, counter-clockwise from outside, turned about z."""
    low, high = -0.5 * np.asarray(size), 0.5 * np.asarray(size)
    (a, b, c), (d, e, f) = low, high
    sides = np.array(
        [
            [(a, b, c), (a, e, c), (d, e, c), (d, b, c)],
            [(a, b, f), (d, b, f), (d, e, f), (a, e, f)],
            [(a, b, c), (d, b, c), (d, b, f), (a, b, f)],
            [(d, b, c), (d, e, c), (d, e, f), (d, b, f)],
            [(d, e, c), (a, e, c), (a, e, f), (d, e, f)],
            [(a, e, c), (a, b, c), (a, b, f), (a, e, f)],
        ]
    )
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    return quads(sides @ rotation.T + np.asarray(at))


def cornell() -> list[tuple[np.ndarray, np.ndarray]]:
    """A room open to the front, two blocks and a lamp: 36 triangles in eight objects."""
    room, _ = box((2, 2, 2))
    walls = [(room[2 * k : 2 * k + 2, ::-1], np.zeros(2, int)) for k in (0, 1, 3, 4, 5)]
    lamp = quads([[(-0.25, -0.25, 0.99), (-0.25, 0.25, 0.99), (0.25, 0.25, 0.99), (0.25, -0.25, 0.99)]])
    return [
        *walls,
        box((0.6, 0.6, 0.6), (0.3, -0.3, -0.7), -0.3),
        box((0.6, 0.6, 1.2), (-0.3, 0.3, -0.4), 0.3),
        lamp,
    ]


def uv_sphere(rings: int, segments: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere of quads, with triangles at the poles."""
    polar = np.pi * np.arange(rings + 1) / rings
    around = 2 * np.pi * np.arange(segments) / segments
    points = np.stack(
        (
            np.sin(polar)[:, None] * np.cos(around),
            np.sin(polar)[:, None] * np.sin(around),
            np.cos(polar)[:, None] * np.ones(segments),
        ),
        axis=-1,
    )
    points[0], points[-1] = (0, 0, 1), (0, 0, -1)
    following = np.roll(points, -1, axis=1)
    corners = np.stack((points[:-1], points[1:], following[1:], following[:-1]), axis=2).reshape(-1, 4, 3)
    triangles, polygon = quads(corners)
    ring = polygon // segments
    first = np.arange(len(polygon)) % 2 == 0
    solid = ~((ring == 0) & ~first) & ~((ring == rings - 1) & first)
    return triangles[solid], polygon[solid]


def lumpy_ngons(seed: int, rings: int = 12, segments: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """A bumpy sphere whose triangles are joined at random into polygons of up to six triangles."""
    rng = np.random.default_rng(seed)
    triangles, _ = uv_sphere(rings, segments)
    corners, index = np.unique(np.round(triangles.reshape(-1, 3), 9), axis=0, return_inverse=True)
    corners = corners * (1 + 0.12 * rng.standard_normal((len(corners), 1)))
    faces = index.reshape(-1, 3)
    edges: dict[tuple[int, int], list[int]] = {}
    for face, row in enumerate(faces):
        for a, b in zip(row, np.roll(row, -1), strict=True):
            edges.setdefault((min(a, b), max(a, b)), []).append(face)
    pairs = [pair for pair in edges.values() if len(pair) == 2]
    polygon = np.arange(len(faces))
    for k in rng.permutation(len(pairs)):
        one, other = polygon[pairs[k]]
        joined = np.flatnonzero((polygon == one) | (polygon == other))
        # A polygon's outline must stay a single loop: n triangles, n + 2 corners.
        if one != other and len(joined) <= 6 and len(np.unique(faces[joined])) == len(joined) + 2:
            polygon[joined] = one
    return corners[faces], polygon


def area_3d(triangles: np.ndarray) -> np.ndarray:
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return 0.5 * np.linalg.norm(cross, axis=1)


def area_uv(uv: np.ndarray) -> np.ndarray:
    """Signed areas of (n, 3, 2) triangles."""
    uv = uv.astype(float)
    edge_1, edge_2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return 0.5 * (edge_1[:, 0] * edge_2[:, 1] - edge_1[:, 1] * edge_2[:, 0])


def islands(uv: np.ndarray) -> np.ndarray:
    """Number the (n,) triangles by the parts that hang together through shared UV corners."""
    corner = np.unique(uv.reshape(-1, 2), axis=0, return_inverse=True)[1].reshape(-1, 3)
    label = np.arange(corner.max() + 1)
    while True:
        lowest = label[corner].min(axis=1)
        new = label.copy()
        np.minimum.at(new, corner.reshape(-1), np.repeat(lowest, 3))
        if (new == label).all():
            return np.unique(lowest, return_inverse=True)[1].reshape(-1)
        label = new
