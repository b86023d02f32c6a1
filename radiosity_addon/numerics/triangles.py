"""Triangles cut in four, and the whole of one in barycentric weights."""

from __future__ import annotations

import numpy as np

from .arrays import Array

WHOLE_TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
"""A triangle's corners as weights of its second and third."""


def split_in_four(corners: Array) -> Array:
    """Join the midpoints of the edges of (n, 3, d) triangles.

    Returns
    -------
    children : (n, 4, 3, d)
        At corner 0, 1, 2, and the middle one; all oriented like their parent, of equal area.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    children = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab)]
    return np.stack([np.stack(child, axis=1) for child in children], axis=1)


def split_in_sixteen(corners: Array) -> Array:
    """Return (n, 16, 3, 3) the grandchildren of (n, 3, 3) triangles."""
    return split_in_four(split_in_four(corners).reshape(-1, 3, 3)).reshape(-1, 16, 3, 3)
