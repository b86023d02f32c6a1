"""Where texels lie in the world, and which texel a ray hit."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.texels.texel_geometry import NO_TEXEL, TexelGeometry
from radiosity_addon.rays.caster import NO_HIT, Hits
from radiosity_addon.solver import Scene
from tests.rooms import gray_scene, rectangle
from tests.unit.texel_scenes import QUAD_UV, in_cell, texel_geometry

SIZE = 16


def scene_of(*parts: np.ndarray, normals: np.ndarray | None = None) -> Scene:
    triangles = np.concatenate(parts)
    return gray_scene(triangles, normals=normals)


def slanted(at: float = 0.0) -> np.ndarray:
    return rectangle((at, -at, at), (2, 0, 1), (0, 3, 0))


def test_a_rectangle_over_the_whole_page() -> None:
    """Each texel's center where bilinear interpolation of the corners puts it, row 0 at v = 0."""
    geometry = texel_geometry(scene_of(slanted()), QUAD_UV, SIZE)
    assert len(geometry) == SIZE * SIZE
    u, v = (geometry.column + 0.5) / SIZE, (geometry.row + 0.5) / SIZE
    expected = u[:, None] * [2, 0, 1] + v[:, None] * [0, 3, 0]
    whole = np.abs(geometry.row - geometry.column) > 0  # the diagonal's texels show one half only
    np.testing.assert_allclose(geometry.position[whole], expected[whole], atol=1e-6)
    normal = np.cross([2, 0, 1], [0, 3, 0]) / np.linalg.norm(np.cross([2, 0, 1], [0, 3, 0]))
    np.testing.assert_allclose(geometry.normal, np.tile(normal, (len(geometry), 1)), atol=1e-12)
    np.testing.assert_array_equal(geometry.index[0][geometry.row, geometry.column], np.arange(len(geometry)))


@pytest.mark.parametrize("far", [0.0, 1e6])
def test_texels_lie_in_their_plane_however_far_out(far: float) -> None:
    geometry = texel_geometry(scene_of(slanted(far)), QUAD_UV, SIZE)
    base = slanted(far)[0, 0]
    off_plane = np.einsum("nk,nk->n", geometry.position - base, geometry.surface_normal)
    assert np.abs(off_plane).max() < 1e-9 * max(far, 1.0)
    rows = np.arange(len(geometry))
    samples = geometry.sample(rows, np.random.default_rng(0).uniform(size=(len(rows), 8, 2)))
    off_plane = np.einsum("nsk,nk->ns", samples - base, geometry.surface_normal)
    assert np.abs(off_plane).max() < 1e-9 * max(far, 1.0)


def test_samples_stay_in_their_texel_and_average_to_its_center() -> None:
    geometry = texel_geometry(scene_of(slanted()), QUAD_UV, SIZE)
    rows = np.arange(len(geometry))[::-1]
    grid = (np.stack(np.meshgrid(np.arange(16), np.arange(16)), axis=-1).reshape(1, -1, 2) + 0.5) / 16
    samples = geometry.sample(rows, np.broadcast_to(grid, (len(rows), 256, 2)))
    u, v = samples[..., 0] / 2, samples[..., 1] / 3
    assert (np.abs(u * SIZE - geometry.column[rows][:, None] - 0.5) <= 0.5 + 1e-5).all()
    assert (np.abs(v * SIZE - geometry.row[rows][:, None] - 0.5) <= 0.5 + 1e-5).all()
    whole = geometry.row[rows] != geometry.column[rows]
    np.testing.assert_allclose(samples.mean(axis=1)[whole], geometry.position[rows][whole], atol=1e-5)


def test_shading_normals_are_interpolated_unless_they_say_nothing() -> None:
    """Unit length everywhere; one that vanishes or turns behind the surface gives way to the surface's."""
    triangles = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    normals = np.repeat(np.array([[[0.6, 0, 0.8]], [[0, 0, -1.0]]]), 3, axis=1)
    normals[0, 1] = [-0.6, 0, 0.8]
    geometry = texel_geometry(scene_of(triangles, normals=normals), QUAD_UV, SIZE)
    np.testing.assert_allclose(np.linalg.norm(geometry.normal, axis=1), 1.0, rtol=1e-9)
    front = geometry.triangle == 0
    assert (geometry.normal[~front] == [0, 0, 1]).all()
    weight = geometry.barycentric[front, 0].astype(float)
    expected = np.stack([0.6 * (1 - 2 * weight), 0 * weight, 0.8 + 0 * weight], axis=1)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(geometry.normal[front], expected, atol=1e-6)


def two_pages() -> TexelGeometry:
    """Three rectangles: two share page 0, one has none, the last fills page 1."""
    scene = scene_of(slanted(), slanted(5), slanted(10), slanted(15))
    uv = np.concatenate([in_cell((0, 0), (0.4, 1)), in_cell((0.6, 0), (1, 1)), QUAD_UV, QUAD_UV])
    return texel_geometry(scene, uv, SIZE, pages=np.array([0, 0, 0, 0, -1, -1, 1, 1]))


def test_texels_are_numbered_page_by_page() -> None:
    geometry = two_pages()
    assert (np.diff(geometry.page) >= 0).all()
    assert set(geometry.triangle.tolist()) == {0, 1, 2, 3, 6, 7}
    for page in (0, 1):
        mine = np.flatnonzero(geometry.page == page)
        assert mine[0] == geometry.page_start[page]
        np.testing.assert_array_equal(geometry.index[page][geometry.row[mine], geometry.column[mine]], mine)
        assert (geometry.index[page] != NO_TEXEL).sum() == len(mine)
    # Positions of the second page are those of its rectangle.
    assert geometry.position[geometry.page == 1][:, 0].min() >= 15


def test_a_hit_finds_the_texel_under_it() -> None:
    geometry = two_pages()
    numbers = np.arange(len(geometry))
    hits = Hits(geometry.triangle, geometry.barycentric, np.ones(len(numbers), bool), np.ones(len(numbers)))
    np.testing.assert_array_equal(geometry.texel_at(hits), numbers)
    np.testing.assert_allclose(geometry.positions_of(hits), geometry.position, atol=1e-6)
    backs = Hits(hits.triangle, hits.barycentric, ~hits.front, hits.distance)
    assert (geometry.texel_at(backs) == NO_TEXEL).all()


def test_misses_and_surfaces_without_a_lightmap_have_no_texel() -> None:
    geometry = two_pages()
    triangle = np.array([NO_HIT, 4, 5, 0])
    weights = np.full((4, 2), 0.3, dtype=np.float32)
    found = geometry.texel_at(Hits(triangle, weights, np.ones(4, bool), np.ones(4)))
    assert (found[:3] == NO_TEXEL).all()
    assert geometry.triangle[found[3]] == 0


def test_neighborhood_grows_by_one_texel_and_stays_on_its_page() -> None:
    geometry = two_pages()
    chosen = np.zeros(len(geometry), dtype=bool)
    picked = geometry.index[0][8, 3]
    chosen[picked] = True
    grown = geometry.neighborhood(chosen)
    rows, columns = geometry.row[grown], geometry.column[grown]
    assert (geometry.page[grown] == 0).all()
    assert set(zip(rows.tolist(), columns.tolist(), strict=True)) == {
        (r, c) for r in (7, 8, 9) for c in (2, 3, 4)
    }
    corner = np.zeros(len(geometry), dtype=bool)
    corner[geometry.index[1][0, 0]] = True
    assert geometry.neighborhood(corner).sum() == 4
    assert not geometry.neighborhood(np.zeros(len(geometry), dtype=bool)).any()


def test_whole_texels_are_sampled_over_the_middle_half_of_their_squares() -> None:
    geometry = two_pages()
    rows = np.flatnonzero(geometry.whole)
    assert 0 < len(rows) < len(geometry)
    u = np.random.default_rng(4).random((len(rows), 5, 2))
    triangle = geometry.triangle[rows]
    edges = geometry.triangles[triangle, 1:] - geometry.triangles[triangle, :1]
    offset = geometry.sample(rows, u) - geometry.triangles[triangle, :1]
    weights = offset @ np.linalg.pinv(edges)
    np.testing.assert_allclose(weights @ edges, offset, atol=1e-6 * np.abs(edges).max())
    size = np.array([len(numbers) for numbers in geometry.index])[geometry.page[rows]]
    corners = geometry.uv[triangle].astype(np.float64) * size[:, None, None]
    spots = corners[:, :1] + weights @ (corners[:, 1:] - corners[:, :1])
    lower_left = np.stack([geometry.column[rows], geometry.row[rows]], axis=1)[:, None]
    np.testing.assert_allclose(spots, lower_left + 0.5 + 0.5 * (u - 0.5), atol=1e-4)


def test_a_large_triangle_that_is_a_point_of_the_page_has_its_area_in_one_texel() -> None:
    scene = scene_of(1e5 * slanted())
    with np.errstate(all="raise"):
        geometry = texel_geometry(scene, np.zeros_like(QUAD_UV), SIZE)
        np.testing.assert_allclose(geometry.texel_area, scene.areas.sum())
