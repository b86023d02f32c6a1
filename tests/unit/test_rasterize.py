"""Texel coverage: exact, each texel one triangle's, samples inside the footprint."""

import numpy as np
import pytest

from radiosity_addon.lightmap.texels import rasterization as module
from radiosity_addon.lightmap.texels.clip import (
    area_in_unit_square,
    clip_to_unit_square,
    polygon_area_centroid,
)
from radiosity_addon.lightmap.texels.rasterization import (
    CENTER,
    FOOTPRINT,
    coverage_sum,
    rasterize,
    sample_footprints,
)

SQUARE = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], dtype=np.float32)


def inside(triangle: np.ndarray, points: np.ndarray) -> np.ndarray:
    following = np.roll(triangle, -1, axis=0)
    edge = following - triangle
    offset = points[:, None] - triangle
    side = edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0]
    return (side >= 0).all(axis=1) | (side <= 0).all(axis=1)


def supersampled(triangle: np.ndarray, resolution: int, factor: int) -> np.ndarray:
    """(resolution, resolution) share of each texel that a triangle covers, by counting points."""
    ticks = (np.arange(resolution * factor) + 0.5) / factor
    x, y = np.meshgrid(ticks, ticks)
    hits = inside(triangle * resolution, np.stack((x.ravel(), y.ravel()), axis=-1))
    return hits.reshape(resolution, factor, resolution, factor).mean(axis=(1, 3))


def random_triangles(seed: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0, 1, (count, 3, 2)).astype(np.float32)


@pytest.mark.parametrize("seed", range(6))
def test_overlap_of_one_triangle_is_what_supersampling_counts(seed):
    uv = random_triangles(seed, 1)
    texels = rasterize(uv, 11)
    counted = supersampled(uv[0].astype(float), 11, 64)
    area = np.zeros((11, 11))
    area[texels.row, texels.column] = texels.area
    # Counting errs by about the length of the outline within the texel over the grid's spacing.
    assert np.abs(area - counted).max() < 0.02
    assert ((counted > 0) <= texels.coverage()).all()


@pytest.mark.parametrize("seed", range(4))
def test_footprints_of_one_triangle_add_up_to_its_area(seed):
    uv = random_triangles(10 + seed, 1)
    texels = rasterize(uv, 64)
    edge_1, edge_2 = (uv[0, k].astype(float) - uv[0, 0] for k in (1, 2))
    area = 0.5 * abs(edge_1[0] * edge_2[1] - edge_1[1] * edge_2[0]) * 64**2
    assert texels.area.sum(dtype=float) == pytest.approx(area, rel=1e-4)
    assert coverage_sum(uv, 64).sum() == pytest.approx(area, rel=1e-4)


def test_centroids_average_to_the_triangles_centroid():
    uv = random_triangles(3, 1)
    texels = rasterize(uv, 50)
    weight = texels.area.astype(float)
    mean = (texels.centroid * weight[:, None]).sum(axis=0) / weight.sum()
    np.testing.assert_allclose(mean, 1 / 3, atol=1e-4)


@pytest.mark.parametrize("resolution", [1, 3, 16, 31])
def test_two_triangles_of_a_square_cover_every_texel_once(resolution):
    texels = rasterize(SQUARE, resolution)
    assert texels.coverage().all()
    assert len(texels) == resolution**2
    np.testing.assert_allclose(coverage_sum(SQUARE, resolution), 1, atol=1e-6)
    # Below the diagonal the first triangle, above the second. On it centers are above, as in Blender.
    assert (texels.triangle == (texels.row >= texels.column)).all()


def test_the_triangle_over_the_center_wins_over_a_larger_overlap():
    # One texel: the first triangle covers 58 % around but not the center, the second the center.
    uv = np.array(
        [[[0, 0], [1, 0], [1, 0.45]], [[0.45, 0.45], [0.6, 0.45], [0.5, 0.6]]],
        dtype=np.float32,
    )
    texels = rasterize(uv, 1)
    assert texels.triangle.tolist() == [1]
    assert texels.center_inside.tolist() == [True]


def test_without_a_center_the_larger_overlap_wins():
    uv = np.array([[[0, 0], [0.3, 0], [0, 0.3]], [[0.5, 0], [1, 0], [1, 0.5]]], dtype=np.float32)
    texels = rasterize(uv[:, :, :], 1)
    assert texels.triangle.tolist() == [1]
    assert texels.area[0] == pytest.approx(0.125)
    assert not texels.center_inside[0]


def test_owner_is_the_centers_triangle_wherever_there_is_one():
    rng = np.random.default_rng(5)
    uv = (rng.uniform(0, 0.9, (60, 1, 2)) + rng.uniform(0, 0.1, (60, 3, 2))).astype(np.float32)
    texels = rasterize(uv, 40)
    centers = np.stack((texels.column, texels.row), axis=-1) + CENTER
    hit = np.stack([inside(uv[t].astype(float) * 40, centers) for t in range(len(uv))])
    np.testing.assert_array_equal(hit.any(axis=0), texels.center_inside)
    owned = hit[texels.triangle, np.arange(len(texels))]
    np.testing.assert_array_equal(owned, texels.center_inside)


def test_orientation_changes_nothing():
    uv = random_triangles(8, 3)
    one, other = rasterize(uv, 33), rasterize(uv[:, ::-1], 33)
    np.testing.assert_array_equal(one.triangle, other.triangle)
    np.testing.assert_allclose(one.area, other.area, atol=1e-6)
    np.testing.assert_allclose(one.centroid, other.centroid[:, ::-1], atol=1e-4)


def test_chunks_do_not_show(monkeypatch):
    uv = random_triangles(9, 20)
    whole = rasterize(uv, 48)
    monkeypatch.setattr(module, "CHUNK", 37)
    cut = rasterize(uv, 48)
    for name in ("row", "column", "triangle", "area", "centroid", "center_inside"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(cut, name))


def test_samples_lie_in_triangle_and_texel_and_are_uniform():
    rng = np.random.default_rng(2)
    uv = random_triangles(21, 2)
    texels = rasterize(uv, 9)
    u = np.stack(np.meshgrid((np.arange(24) + 0.5) / 24, (np.arange(24) + 0.5) / 24), axis=-1).reshape(-1, 2)
    weights = sample_footprints(texels, np.broadcast_to(u, (len(texels), *u.shape)), 1.0).astype(float)
    assert (weights >= 0).all()
    np.testing.assert_allclose(weights.sum(axis=2), 1, atol=1e-6)
    points = np.einsum("tkc,tcx->tkx", weights, uv[texels.triangle].astype(float) * 9)
    low = np.stack((texels.column, texels.row), axis=-1)[:, None]
    assert (points >= low - 1e-4).all()
    assert (points <= low + 1 + 1e-4).all()
    # Area-uniform: the samples' mean is the centroid.
    np.testing.assert_allclose(weights.mean(axis=1), texels.centroid, atol=5e-3)
    # ... and so are their second moments, against random points of the texel within the triangle.
    row = int(np.argmin(np.abs(texels.area - 0.5)))
    trial = low[row] + rng.uniform(0, 1, (200_000, 2))
    trial = trial[inside(uv[texels.triangle[row]].astype(float) * 9, trial)]
    np.testing.assert_allclose(np.cov(points[row].T), np.cov(trial.T), atol=2e-3)


def test_samples_keep_to_the_middle_where_the_center_is_covered():
    uv = random_triangles(21, 2)
    texels = rasterize(uv, 9)
    u = np.random.default_rng(1).uniform(size=(len(texels), 64, 2))
    weights = sample_footprints(texels, u).astype(float)
    points = np.einsum("tkc,tcx->tkx", weights, uv[texels.triangle].astype(float) * 9)
    away = np.abs(points - np.stack((texels.column, texels.row), axis=-1)[:, None] - 0.5).max(axis=(1, 2))
    assert away[texels.center_inside].max() <= FOOTPRINT / 2 + 1e-4
    assert away[~texels.center_inside].max() <= 0.5 + 1e-4
    # They use the room they have: whole texels to the middle's corners, others past it.
    assert away[texels.area == 1].min() > 0.95 * FOOTPRINT / 2
    assert away[~texels.center_inside].max() > FOOTPRINT / 2


def test_whole_texels_take_the_sample_as_it_is():
    texels = rasterize(SQUARE, 4)
    corner = texels.take((texels.row == 0) & (texels.column == 3))
    weights = sample_footprints(corner, np.array([[[0.25, 0.75]]]), 1.0)
    np.testing.assert_allclose(weights[0, 0] @ SQUARE[0] * 4, (3.25, 0.75), atol=1e-6)


def test_footprint_polygons_have_the_stated_area_and_centroid():
    uv = random_triangles(13, 4)
    texels = rasterize(uv, 13)
    corners = np.einsum(
        "tkc,tcx->tkx", texels.footprints().astype(float), uv[texels.triangle].astype(float) * 13
    )
    area, centroid = polygon_area_centroid(corners)
    np.testing.assert_allclose(area, texels.area, atol=2e-4)
    expected = np.einsum("tc,tcx->tx", texels.centroid.astype(float), uv[texels.triangle].astype(float) * 13)
    np.testing.assert_allclose(centroid[area > 0.01], expected[area > 0.01], atol=2e-3)


def test_what_lies_outside_the_page_is_cut_off():
    uv = np.array([[[-2, -2], [3, -2], [-2, 3]]], dtype=np.float32)
    texels = rasterize(uv, 8)
    assert texels.coverage()[np.add.outer(np.arange(8), np.arange(8)) < 7].all()
    assert texels.row.min() >= 0
    assert texels.row.max() < 8


@pytest.mark.parametrize(
    "uv",
    [
        [[0.1, 0.1], [0.1, 0.1], [0.1, 0.1]],
        [[0.1, 0.1], [0.5, 0.5], [0.9, 0.9]],
        [[np.nan, 0.1], [0.5, 0.5], [0.9, 0.1]],
    ],
)
def test_triangles_without_area_cover_nothing(uv):
    assert len(rasterize(np.array([uv], dtype=np.float32), 8)) == 0


def test_a_tiny_triangle_still_gets_its_texel():
    uv = (np.array([[[0, 0], [1e-4, 0], [0, 1e-4]]]) + 0.3).astype(np.float32)
    texels = rasterize(uv, 16)
    assert (texels.row.tolist(), texels.column.tolist()) == ([4], [4])


def test_a_long_thin_diagonal_covers_only_its_own_texels():
    uv = np.array([[[0, 0], [1, 0.999], [1, 1]]], dtype=np.float32)
    texels = rasterize(uv, 2048)
    assert len(texels) < 5 * 2048
    assert texels.area.sum(dtype=float) == pytest.approx(0.5 * 0.001 * 2048**2, rel=5e-3)


def test_clipping_a_triangle_to_the_square_can_give_seven_corners():
    triangle = np.array([[[-0.2, 0.3], [0.7, -0.4], [1.05, 1.3]]])
    polygon = clip_to_unit_square(triangle)
    assert len(np.unique(polygon[0].round(12), axis=0)) >= 6
    rng = np.random.default_rng(0)
    counted = inside(triangle[0], rng.uniform(0, 1, (400_000, 2))).mean()
    assert polygon_area_centroid(polygon)[0][0] == pytest.approx(counted, abs=3e-3)


def test_the_area_in_the_square_is_that_of_the_clipped_polygon():
    rng = np.random.default_rng(7)
    centers = rng.uniform(-0.7, 1.7, (3000, 1, 2))
    triangles = centers + rng.uniform(-1, 1, (3000, 3, 2)) * np.geomspace(0.01, 30, 3000)[:, None, None]
    # Corners and sides on the square's own are what grids give.
    on_lattice = rng.integers(-2, 5, (3000, 3, 2)) / 2
    for shapes in (triangles, on_lattice):
        expected, _ = polygon_area_centroid(clip_to_unit_square(shapes))
        assert (expected > 0).sum() > 500
        np.testing.assert_allclose(area_in_unit_square(shapes), expected, atol=1e-13)
