"""Clipping by lines that run along edges, where rounding decides which corners are outside."""

from __future__ import annotations

import numpy as np

from radiosity_addon.numerics.polygons import areas, clip_half_plane, edge_distances


def test_both_sides_of_a_line_through_corners_make_the_whole() -> None:
    generator = np.random.default_rng(1)
    count = 20_000
    # Corners on the sides of triangles, some of them twice: convex but for rounding.
    corners = generator.uniform(-1, 1, (count, 3, 2))
    corners[areas(corners) == 0] = corners[areas(corners) == 0][:, ::-1]
    along = np.sort(generator.uniform(0, 1, (count, 3, 3)), axis=2)
    along[:, :, 0], along[:, 1, 2] = 0.0, along[:, 1, 1]
    sides = np.roll(corners, -1, axis=1) - corners
    polygons = (corners[:, :, None] + along[..., None] * sides[:, :, None]).reshape(count, 9, 2)
    whole = areas(polygons)
    assert (whole > 0).all()
    for edge in range(9):
        distance = edge_distances(polygons, polygons, edge)
        # A side without length has no line, and everything is on it.
        distance[~distance.any(axis=1)] = 1.0
        inside, outside = (clip_half_plane(polygons, sign * distance) for sign in (1, -1))
        np.testing.assert_allclose(areas(inside) + areas(outside), whole, rtol=0, atol=1e-12)
        assert areas(outside).max() < 1e-9  # the line of a short side is no better known
