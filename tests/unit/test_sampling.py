"""Samples: stratified, uniform, the same whatever the chunks, and maps that keep them so."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.form_factors import point_to_polygon
from radiosity_addon.numerics import (
    directions_to_triangles,
    point_on_each_triangle,
    points_on_triangles,
    sampling,
)


@pytest.mark.parametrize("first", [0, 16, 65536 - 16, 65536, 1 << 20])
@pytest.mark.parametrize("boxes", [(16, 1), (8, 2), (4, 4), (2, 8), (1, 16)])
def test_an_aligned_run_has_one_point_in_every_elementary_box(first: int, boxes: tuple[int, int]) -> None:
    u = sampling.stratified_square(np.arange(50), 16, seed=3, first=first)
    cell = (u * np.array(boxes)).astype(int) @ np.array([1, boxes[0]])
    assert (np.sort(cell, axis=1) == np.arange(16)).all()


def test_points_do_not_depend_on_the_rows_and_runs_they_are_evaluated_in() -> None:
    keys = np.array([0, 7, 1 << 20, (1 << 40) + 3])
    whole = sampling.stratified_square(keys, 24, seed=5)
    by_row = np.concatenate([sampling.stratified_square(keys[i : i + 1], 24, seed=5) for i in range(4)])
    by_run = np.concatenate(
        [sampling.stratified_square(keys, 5, seed=5), sampling.stratified_square(keys, 19, seed=5, first=5)],
        axis=1,
    )
    assert np.array_equal(whole, by_row)
    assert np.array_equal(whole, by_run)


def test_seeds_keys_and_high_key_words_give_different_points() -> None:
    keys = np.array([1, 2, 1 + (1 << 32), 1 + (1 << 33)])
    bits = np.stack([sampling.hash_keys(keys, seed) for seed in (0, 1, 1 << 32)])
    assert len(np.unique(bits)) == bits.size


def test_each_point_alone_is_uniform() -> None:
    u = sampling.stratified_square(np.arange(40000), 1)[:, 0].astype(float)
    assert (u >= 0).all()
    assert (u < 1).all()
    moments = [(u**power).mean(axis=0) for power in (1, 2, 3)]
    np.testing.assert_allclose(moments, [[1 / 2] * 2, [1 / 3] * 2, [1 / 4] * 2], atol=0.006)
    assert abs(np.corrcoef(u.T)[0, 1]) < 0.02


def test_squares_of_two_seeds_join_to_four_dimensions() -> None:
    """In lockstep, the mean of a function of all four coordinates would be far off."""
    one_row = np.zeros(1, dtype=int)
    u = sampling.stratified_square(one_row, 4096, seed=1)[0].astype(float)
    v = sampling.stratified_square(one_row, 4096, seed=2)[0].astype(float)
    assert ((u[:, 0] > 0.5) & (v[:, 0] > 0.5) & (u[:, 1] > 0.5) & (v[:, 1] > 0.5)).mean() == pytest.approx(
        1 / 16, abs=0.01
    )
    assert np.abs(np.corrcoef(np.hstack([u, v]).T)[:2, 2:]).max() < 0.05


def test_stratification_converges_faster_than_chance() -> None:
    """The root mean square error of a smooth integral falls about as 1/k, not as 1/√k."""

    def error(k: int) -> float:
        u = sampling.stratified_square(np.arange(2000), k, seed=9).astype(float)
        estimate = np.exp(u[..., 0] * u[..., 1]).mean(axis=1)
        return float(np.sqrt(((estimate - 1.3179021514544038) ** 2).mean()))

    assert np.log2(error(4) / error(64)) / 4 > 0.9


def test_points_on_triangles_are_uniform_and_inside() -> None:
    triangle = np.array([[[1.0, 0.0, 2.0], [4.0, 1.0, 0.0], [0.0, 3.0, 1.0]]])
    u = sampling.stratified_square(np.zeros(1, int), 1 << 14).astype(float)
    points = sampling.points_on_triangles(triangle, u)[0]
    weights = np.linalg.solve(triangle[0].T, points.T).T
    assert weights.min() >= -1e-12
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    # Uniform barycentric coordinates: mean 1/3, mean square 1/6, mean product 1/12.
    np.testing.assert_allclose(weights.T @ weights / len(weights), np.eye(3) / 12 + 1 / 12, atol=1e-4)


def test_the_concentric_map_keeps_area_and_reaches_the_rim() -> None:
    grid = (np.arange(512) + 0.5) / 512
    points = sampling.concentric_disk(np.stack(np.meshgrid(grid, grid), axis=-1))
    radius = np.hypot(points[..., 0], points[..., 1])
    for inner in (0.25, 0.5, 0.9):
        assert (radius < inner).mean() == pytest.approx(inner**2, abs=0.005)
    assert sampling.concentric_disk(np.array([[0.5, 0.5], [1.0, 0.5]])) == pytest.approx(
        np.array([[0.0, 0.0], [1.0, 0.0]])
    )


def test_cosine_hemisphere_has_the_cosine_density() -> None:
    u = sampling.stratified_square(np.zeros(1, int), 1 << 14)[0].astype(float)
    directions = sampling.cosine_hemisphere(u)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    assert directions[:, 2].min() >= 0
    # ∫ cosθ · cosθ/π dω = 2/3, ∫ cos²θ · cosθ/π dω = 1/2
    assert directions[:, 2].mean() == pytest.approx(2 / 3, abs=1e-4)
    assert (directions[:, 2] ** 2).mean() == pytest.approx(1 / 2, abs=1e-4)


@pytest.mark.parametrize("drop", [1e-8, 0.3, 1.0, 2.0])
def test_uniform_cone_is_uniform_in_solid_angle(drop: float) -> None:
    u = sampling.stratified_square(np.zeros(1, int), 1 << 12)[0].astype(float)
    directions = sampling.uniform_cone(u, drop)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    assert (1 - directions[:, 2]).mean() == pytest.approx(drop / 2, rel=1e-3, abs=1e-12)
    np.testing.assert_allclose(directions[:, :2].mean(axis=0), 0.0, atol=2e-3)


def test_the_basis_is_right_handed_also_at_the_poles() -> None:
    rng = np.random.default_rng(0)
    normals = np.concatenate([rng.normal(size=(1000, 3)), np.eye(3), -np.eye(3), [[0.0, 0.0, -1.0 + 1e-9]]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    tangent, bitangent = sampling.orthonormal_basis(normals)
    frame = np.stack([tangent, bitangent, normals], axis=1)
    unity = np.broadcast_to(np.eye(3), frame.shape)
    np.testing.assert_allclose(frame @ frame.transpose(0, 2, 1), unity, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(frame), 1.0, atol=1e-12)
    local = rng.normal(size=(len(normals), 4, 3))
    world = sampling.to_world(local, normals)
    np.testing.assert_allclose(np.einsum("ikj,ij->ik", world, normals), local[..., 2], atol=1e-12)


def test_a_point_on_each_triangle_is_the_first_of_many_there() -> None:
    generator = np.random.default_rng(8)
    triangles, u = generator.random((6, 4, 3, 3)), generator.random((6, 4, 2))
    expected = [points_on_triangles(triangles[row], u[row][:, None])[:, 0] for row in range(6)]
    np.testing.assert_array_equal(point_on_each_triangle(triangles, u), expected)
    np.testing.assert_array_equal(point_on_each_triangle(triangles[:, 0], u[:, 0]), np.array(expected)[:, 0])
    assert point_on_each_triangle(triangles[:0], u[:0]).shape == (0, 4, 3)


def test_directions_to_triangles_fill_them_evenly() -> None:
    """All meet the triangle; their mean cosine is its form factor, π of it over the solid angle."""
    rng = np.random.default_rng(1)
    unit = sampling.stratified_square(np.arange(1), 1 << 14)[0]
    for _ in range(20):
        corners = rng.normal(size=(3, 3)) * [1.0, 1.0, 0.2] + [0.0, 0.0, 0.6]
        directions, solid_angle = directions_to_triangles(np.broadcast_to(corners, (len(unit), 3, 3)), unit)
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
        assert (np.linalg.solve(corners.T, directions.T) >= -1e-9).all()
        a, b, c = corners / np.linalg.norm(corners, axis=1, keepdims=True)
        # Van Oosterom and Strackee, The solid angle of a plane triangle (1983).
        expected = 2.0 * np.arctan2(abs(np.dot(a, np.cross(b, c))), 1.0 + a @ b + b @ c + a @ c)
        np.testing.assert_allclose(solid_angle, expected, rtol=1e-9)
        factor = point_to_polygon(np.zeros((2, 3)), [[0, 0, 1]] * 2, [corners, corners[[0, 2, 1]]]).max()
        assert np.maximum(directions[:, 2], 0.0).mean() * expected / np.pi == pytest.approx(factor, rel=3e-3)
