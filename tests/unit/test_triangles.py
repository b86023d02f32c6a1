"""Areas and barycentric weights of triangles: identities that hold for all of them."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.numerics import (
    double_area_vectors,
    plane_weights_at,
    points_at,
    signed_double_areas,
    split_in_four,
    triangle_areas,
    weights_at,
)


@pytest.fixture
def triangles() -> np.ndarray:
    return np.random.default_rng(1).normal(size=(500, 3, 3))


def test_areas_are_herons(triangles: np.ndarray) -> None:
    a, b, c = np.linalg.norm(np.roll(triangles, 1, axis=1) - triangles, axis=2).T
    half = 0.5 * (a + b + c)
    heron = np.sqrt(half * (half - a) * (half - b) * (half - c))
    np.testing.assert_allclose(triangle_areas(triangles), heron, rtol=1e-6)


def test_area_vectors_are_at_right_angles_to_the_edges_and_close_a_solid(triangles: np.ndarray) -> None:
    vectors = double_area_vectors(triangles)
    edges = np.roll(triangles, 1, axis=1) - triangles
    np.testing.assert_allclose(np.einsum("nd,ncd->nc", vectors, edges), 0.0, atol=1e-12)
    tip = np.random.default_rng(2).normal(size=(len(triangles), 3))
    sides = [np.stack([triangles[:, k], tip, triangles[:, (k + 1) % 3]], axis=1) for k in range(3)]
    np.testing.assert_allclose(vectors + sum(double_area_vectors(side) for side in sides), 0.0, atol=1e-12)


def test_signed_areas_are_heights_of_area_vectors(triangles: np.ndarray) -> None:
    flat = triangles.copy()
    flat[..., 2] = 0.0
    signed = signed_double_areas(triangles[..., :2])
    np.testing.assert_allclose(signed, double_area_vectors(flat)[:, 2], rtol=0, atol=1e-13)
    np.testing.assert_allclose(signed_double_areas(triangles[:, ::-1, :2]), -signed, rtol=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_weights_and_points_are_inverse(triangles: np.ndarray, size: float) -> None:
    corners = size * triangles
    weights = np.random.default_rng(3).uniform(-1, 2, (len(corners), 4, 3))
    weights[..., 0] = 1.0 - weights[..., 1] - weights[..., 2]
    points = weights @ corners
    normal = double_area_vectors(corners)[:, None]
    found = weights_at(corners, points + 0.3 * normal / size)  # what is above counts like what is below
    np.testing.assert_allclose(found, weights, atol=1e-9)
    np.testing.assert_allclose(found.sum(axis=2), 1.0, rtol=1e-12)
    back = points_at(corners, found[:, 0, 1:])
    np.testing.assert_allclose(back, points[:, 0], atol=1e-9 * size)
    flat = plane_weights_at(corners[..., :2], points[..., :2])
    np.testing.assert_allclose(flat @ corners[..., :2], points[..., :2], atol=1e-9 * size)


def test_weights_are_1_at_their_corner_and_shares_of_the_area_inside(triangles: np.ndarray) -> None:
    np.testing.assert_allclose(
        weights_at(triangles, triangles), np.broadcast_to(np.eye(3), (500, 3, 3)), atol=1e-9
    )
    inside = np.random.default_rng(4).dirichlet((1, 1, 1), len(triangles))
    point = np.einsum("nc,ncd->nd", inside, triangles)
    for corner in range(3):
        opposite = triangles.copy()
        opposite[:, corner] = point
        share = triangle_areas(opposite) / triangle_areas(triangles)
        np.testing.assert_allclose(weights_at(triangles, point[:, None])[:, 0, corner], share, atol=1e-9)


def test_without_an_area_weights_are_finite() -> None:
    corners = np.array([[[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 2.0, 0.0]], [[1.0, 2.0, 3.0]] * 3])
    points = np.ones((2, 1, 3))
    assert np.isfinite(weights_at(corners, points)).all()
    assert np.isfinite(plane_weights_at(corners[..., :2], points[..., :2])).all()


def test_points_lie_in_the_plane_whatever_the_weights_are_rounded_to(triangles: np.ndarray) -> None:
    far = triangles + np.array([1e6, -1e6, 1e6])
    far[..., 2] = 1e6
    weights = np.random.default_rng(5).dirichlet((1, 1, 1), len(far)).astype(np.float32)[:, 1:]
    assert (points_at(far, weights)[:, 2] == 1e6).all()


def test_four_parts_are_alike_and_fill_the_whole(triangles: np.ndarray) -> None:
    parts = double_area_vectors(split_in_four(triangles).reshape(-1, 3, 3)).reshape(-1, 4, 3)
    whole = double_area_vectors(triangles)
    np.testing.assert_allclose(parts, np.broadcast_to(whole[:, None] / 4.0, parts.shape), atol=1e-12)
