"""Random directions and rotations, and the normals and areas of triangles."""

from __future__ import annotations

import numpy as np


def areas_of(triangles: np.ndarray) -> np.ndarray:
    """Return the (t,) areas of (t, 3, 3) triangles."""
    return np.asarray(np.linalg.norm(_doubled(triangles), axis=1) / 2)


def normals_of(triangles: np.ndarray) -> np.ndarray:
    """Return their (t, 3) unit normals."""
    doubled = _doubled(triangles)
    return np.asarray(doubled / np.linalg.norm(doubled, axis=1, keepdims=True))


def _doubled(triangles: np.ndarray) -> np.ndarray:
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def unit_rows(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return (count, 3) random directions."""
    rows = rng.normal(size=(count, 3))
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """Return a random (3, 3) rotation."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.asarray(turn * np.sign(np.linalg.det(turn)))
