"""Triangles: their areas, barycentric weights, and parts. Corners are counter-clockwise from the front."""

from __future__ import annotations

import numpy as np

from .arrays import Array

WHOLE_TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
"""A triangle's corners as weights of its second and third."""


def double_area_vectors(corners: Array) -> Array:
    """Return (n, 3) normals of (n, 3, 3) triangles, as long as twice their areas."""
    return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def triangle_areas(corners: Array) -> Array:
    """Return (n,) the areas of (n, 3, 3) triangles."""
    return np.asarray(0.5 * np.linalg.norm(double_area_vectors(corners), axis=1))


def signed_double_areas(corners: Array) -> Array:
    """Return (n,) twice the areas of plane triangles (n, 3, 2), negative for clockwise ones."""
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(edge_1[:, 0] * edge_2[:, 1] - edge_1[:, 1] * edge_2[:, 0])


def weights_at(corners: Array, points: Array) -> Array:
    """Return (n, k, 3) the weights of (n, 3, 3) triangles' corners at points (n, k, 3); their sum is 1.

    What lies off a triangle's plane counts where it is above it. Weights of a triangle without area
    mean nothing.
    """
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(edge_1, edge_2)
    square = np.maximum(np.einsum("nd,nd->n", normal, normal), 1e-300)[:, None]
    apart = points - corners[:, :1]
    # Each weight is an area; the cross products with the normal turn edges inward.
    second = np.einsum("nkd,nd->nk", apart, np.cross(edge_2, normal)) / square
    third = np.einsum("nkd,nd->nk", apart, np.cross(normal, edge_1)) / square
    return np.stack([1.0 - second - third, second, third], axis=-1)


def plane_weights_at(corners: Array, points: Array) -> Array:
    """Do the same for points (n, k, 2) and plane triangles (n, 3, 2)."""
    edge_1, edge_2 = corners[:, None, 1] - corners[:, None, 0], corners[:, None, 2] - corners[:, None, 0]
    apart = points - corners[:, None, 0]
    whole = edge_1[..., 0] * edge_2[..., 1] - edge_1[..., 1] * edge_2[..., 0]
    whole = np.where(whole == 0.0, 1.0, whole)
    second = (apart[..., 0] * edge_2[..., 1] - apart[..., 1] * edge_2[..., 0]) / whole
    third = (edge_1[..., 0] * apart[..., 1] - edge_1[..., 1] * apart[..., 0]) / whole
    return np.stack([1.0 - second - third, second, third], axis=-1)


def points_at(corners: Array, weights: Array) -> Array:
    """Return (n, d) points of (n, 3, d) triangles at weights (n, 2) of the second and third corners.

    Along the edges from the first corner: the rounding of the weights lifts no point off its plane.
    """
    along = np.einsum("nc,ncd->nd", np.asarray(weights, dtype=np.float64), corners[:, 1:] - corners[:, :1])
    return np.asarray(corners[:, 0] + along)


def split_in_four(corners: Array) -> Array:
    """Join the midpoints of the edges of (n, 3, d) triangles.

    Returns children (n, 4, 3, d): At corner 0, 1, 2, and the middle one; all oriented like their parent, of
        equal area.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    children = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab)]
    return np.stack([np.stack(child, axis=1) for child in children], axis=1)


def split_in_sixteen(corners: Array) -> Array:
    """Return (n, 16, 3, 3) the grandchildren of (n, 3, 3) triangles."""
    return split_in_four(split_in_four(corners).reshape(-1, 3, 3)).reshape(-1, 16, 3, 3)
