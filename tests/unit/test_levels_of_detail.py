"""Coarser levels of detail: nearest triangles, and lightmap coordinates that stay within a chart."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.unwrap import uvs_of_level
from radiosity_addon.lightmap.unwrap.level_uvs import charts
from radiosity_addon.numerics import TriangleTree, closest_weights


def grid(count: int) -> np.ndarray:
    """Triangles (2 count², 3, 3) of the unit square at z = 0."""
    rows, columns = np.divmod(np.arange(count**2), count)
    corners = [
        np.stack([columns + x, rows + y, 0 * rows], axis=1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))
    ]
    a, b, c, d = (each / count for each in corners)
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


@pytest.mark.parametrize("count", [1, 7, 8, 9, 500])
def test_the_nearest_triangle_is_that_of_all(count: int) -> None:
    rng = np.random.default_rng(count)
    triangles = rng.normal(size=(count, 1, 3)) + 0.3 * rng.normal(size=(count, 3, 3))
    points = 2.0 * rng.normal(size=(300, 3))
    triangle, weights, distance = TriangleTree(triangles).nearest(points)
    every = np.broadcast_to(triangles, (300, count, 3, 3)).reshape(-1, 3, 3)
    at = np.einsum("pc,pck->pk", closest_weights(np.repeat(points, count, axis=0), every), every)
    apart = np.linalg.norm(at.reshape(300, count, 3) - points[:, None], axis=2)
    np.testing.assert_allclose(distance, apart.min(axis=1), rtol=1e-12)
    np.testing.assert_allclose(apart[np.arange(300), triangle], distance, rtol=1e-12)
    assert weights.min() >= 0.0
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)


def test_the_closest_point_is_closer_than_all_others() -> None:
    rng = np.random.default_rng(3)
    triangles, points = rng.normal(size=(400, 3, 3)), 2.0 * rng.normal(size=(400, 3))
    triangles[:20, 2] = triangles[:20, 1]  # without area
    triangles[20:25] = triangles[20:25, :1]
    at = np.einsum("pc,pck->pk", closest_weights(points, triangles), triangles)
    distance = np.linalg.norm(at - points, axis=1)
    for _ in range(200):
        others = np.einsum("pc,pck->pk", rng.dirichlet((0.5, 0.5, 0.5), size=400), triangles)
        assert (np.linalg.norm(others - points, axis=1) >= distance - 1e-12).all()


def test_of_two_sides_the_one_that_faces_the_same_way_is_nearest() -> None:
    front = grid(3)
    both = np.concatenate([front, front[:, ::-1] - (0, 0, 0.001)])
    points = np.array([[0.3, 0.3, -0.0009], [0.7, 0.2, -0.0001]])
    up = np.broadcast_to([0.0, 0.0, 1.0], (2, 3))
    assert (TriangleTree(both).nearest(points, up, 0.05)[0] < len(front)).all()
    assert (TriangleTree(both).nearest(points, -up, 0.05)[0] >= len(front)).all()


def test_a_coarser_plane_has_the_same_coordinates() -> None:
    base, turn = grid(8), np.array([[0.28, 0.1], [-0.1, 0.28], [0.0, 0.0]])
    coarse = grid(2)
    found = uvs_of_level(coarse, np.arange(len(coarse)) % 4, base, (base @ turn + 0.3).astype(np.float32))
    np.testing.assert_allclose(found, coarse @ turn + 0.3, atol=1e-6)


def test_no_polygon_is_in_two_charts_and_no_corner_outside_of_its() -> None:
    """A bent strip of two charts, and a quad of two triangles over the bend."""
    base = grid(4)
    base = np.concatenate([base, base[..., [2, 1, 0]] * (1, 1, -1) + (1, 0, 0)])
    uv = base[..., :2].copy()
    uv[:32] *= 0.4
    uv[32:] = np.stack([0.55 - 0.4 * base[32:, :, 2], 0.4 * base[32:, :, 1]], axis=-1)
    chart = charts(base, uv.astype(np.float32))
    assert len(np.unique(chart)) == 2
    level = np.array(
        [[[0.4, 0, 0.1], [1.1, 0, -0.3], [1.1, 1, -0.3]], [[0.4, 0, 0.1], [1.1, 1, -0.3], [0.4, 1, 0.1]]]
    )
    found = uvs_of_level(level, np.zeros(2, dtype=int), base, uv.astype(np.float32))
    within = []
    for part in (uv[:32], uv[32:]):
        low, high = part.reshape(-1, 2).min(axis=0) - 1e-6, part.reshape(-1, 2).max(axis=0) + 1e-6
        within.append(bool(((found >= low) & (found <= high)).all()))
    assert sorted(within) == [False, True]
    np.testing.assert_array_equal(found[0, 0], found[1, 0])
