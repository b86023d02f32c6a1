"""Texels that many small triangles share: whose they are, and where they are lit."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.images.seams import find_seams
from radiosity_addon.lightmap.texels import TexelGeometry, rasterize, texel_areas
from radiosity_addon.lightmap.texels.shared_texels import collapsed_pieces, is_collapsed
from radiosity_addon.rays import Hits
from radiosity_addon.scene import Scene

SIZE = 8


def gray(triangles: np.ndarray) -> Scene:
    return Scene(triangles, np.full((len(triangles), 3), 0.5), np.zeros((len(triangles), 3)))


def triangle(at: tuple[float, float, float], legs: float) -> np.ndarray:
    return np.asarray(at) + legs * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)


def point(column: int, row: int) -> np.ndarray:
    return np.full((3, 2), ((column + 0.5) / SIZE, (row + 0.5) / SIZE), dtype=np.float32)


def geometry_of(triangles: np.ndarray, uv: np.ndarray, size: int = SIZE) -> TexelGeometry:
    scene = gray(triangles)
    texels = rasterize(uv, size, surface=scene.areas)
    pages = np.zeros(len(uv), dtype=np.int32)
    return TexelGeometry(scene, uv, pages, [texels], [np.arange(len(uv))])


@pytest.fixture
def group() -> TexelGeometry:
    """Two small triangles, one of four times the other's area, in one texel; a third in another."""
    triangles = np.stack([triangle((0, 0, 0), 0.1), triangle((1, 0, 0), 0.2), triangle((5, 0, 0), 0.1)])
    return geometry_of(triangles, np.stack([point(2, 3), point(2, 3), point(6, 1)]))


def test_a_shared_texel_belongs_to_the_largest(group: TexelGeometry) -> None:
    assert group.triangle.tolist() == [2, 1]
    assert (group.row.tolist(), group.column.tolist()) == ([1, 3], [6, 2])
    assert group.center_inside.all()
    assert not group.whole.any()
    np.testing.assert_allclose(group.position[1], [1 + 0.2 / 3, 0.2 / 3, 0], atol=1e-6)


def test_a_texel_is_as_large_as_all_that_share_it(group: TexelGeometry) -> None:
    np.testing.assert_allclose(group.texel_area, [0.025, 0.025, 0.005])


def test_points_are_spread_over_all_that_share_it_by_area(group: TexelGeometry) -> None:
    u = np.random.default_rng(0).random((1, 4096, 2))
    points = group.sample(np.array([1]), u)[0]
    first = points[:, 0] < 0.5
    assert first.mean() == pytest.approx(0.2, abs=0.02)
    for own, corner, legs in ((first, 0.0, 0.1), (~first, 1.0, 0.2)):
        local = (points[own, :2] - (corner, 0.0)) / legs
        assert (local >= 0).all()
        assert (local.sum(axis=1) <= 1).all()
        np.testing.assert_allclose(local.mean(axis=0), 1 / 3, atol=0.03)


def test_hits_on_all_of_them_find_it(group: TexelGeometry) -> None:
    hits = Hits(
        np.array([0, 1, 2], dtype=np.int32),
        np.full((3, 2), 0.3),
        np.ones(3, dtype=bool),
        np.ones(3),
    )
    assert group.texel_at(hits).tolist() == [1, 1, 0]


def strip(length: float, width: float) -> np.ndarray:
    corners = np.array([(0, 0, 0), (length, 0, 0), (length, width, 0), (0, width, 0)], dtype=float)
    return corners[[[0, 1, 2], [0, 2, 3]]]


@pytest.mark.parametrize("upright", [False, True])
def test_a_line_is_cut_at_the_borders_of_texels(upright: bool) -> None:
    triangles = strip(4.0, 0.1)
    along = (1.5 + triangles[..., 0]) / SIZE
    uv = np.stack((along, np.full_like(along, 2.5 / SIZE)), axis=-1).astype(np.float32)
    geometry = geometry_of(triangles, uv[..., ::-1].copy() if upright else uv)
    at = geometry.row if upright else geometry.column
    np.testing.assert_array_equal(np.sort(at), [1, 2, 3, 4, 5])
    assert geometry.shared is not None
    np.testing.assert_allclose(geometry.shared.area, [0.05, 0.1, 0.1, 0.1, 0.05], rtol=1e-5)
    points = geometry.sample(np.arange(5), np.random.default_rng(1).random((5, 256, 2)))
    for texel in range(5):
        x = points[texel, :, 0] + 1.5
        assert (np.floor(x) == at[texel]).all()
        assert x.mean() == pytest.approx((1.75, 2.5, 3.5, 4.5, 5.25)[texel], abs=0.05)


@pytest.mark.parametrize("upright", [False, True])
@pytest.mark.parametrize("size", [8, 12, 36, 100, 300, 1300])
def test_seams_of_lines_read_their_own_rows_only(size: int, upright: bool) -> None:
    """Far surfaces lie next to the lines, and most sizes round the centers of texels."""
    near = np.concatenate([strip(4.0, 0.1), np.add(strip(4.0, 0.1), (0, 0.1, 0))])
    far = np.concatenate([np.add(strip(4.0, 0.1), (0, 0, 100.0 * step)) for step in range(1, 5)])
    lines = (size - 6.5, size - 3.5)
    along = size - 6.5 + near[..., 0]
    across = np.broadcast_to(np.repeat(lines, 2)[:, None], along.shape)
    corners = [(0.1, line + side) for line in lines for side in (-1.4, 0.6)]
    others = np.concatenate([np.add(strip(size - 0.2, 0.8)[..., :2], corner) for corner in corners])
    uv = (np.concatenate([np.stack((along, across), axis=-1), others]) / size).astype(np.float32)
    triangles = np.concatenate([near, far])
    geometry = geometry_of(triangles, uv[..., ::-1].copy() if upright else uv, size)
    seams = find_seams(gray(triangles), geometry)
    assert seams.length.sum() == pytest.approx(4.0, abs=size * 2.0**-23)
    row, column = np.divmod(seams.texel, size)
    assert set(np.floor(lines)) == set(np.unique(column if upright else row))
    np.testing.assert_allclose(seams.weight.sum(axis=2), 1.0)


def test_pieces_of_a_triangle_are_all_of_it() -> None:
    rng = np.random.default_rng(2)
    uv = np.repeat(rng.random((50, 1, 2)), 3, axis=1)
    uv[..., 0] = rng.random((50, 3))
    pieces = collapsed_pieces(uv.astype(np.float32), 32)
    np.testing.assert_allclose(np.bincount(pieces.triangle, pieces.share, 50), 1.0, rtol=1e-9)


def test_what_covers_a_texel_keeps_it() -> None:
    large = np.array([[0, 0], [1, 0], [0, 1]], dtype=np.float32)
    uv = np.stack([large, point(1, 1)])
    texels = rasterize(uv, SIZE, surface=np.array([1e-6, 1.0]))
    assert (texels.triangle == 0).all()


def test_only_points_and_upright_or_level_lines_are_collapsed() -> None:
    diagonal = np.array([[0, 0], [0.5, 0.5], [1, 1]], dtype=np.float32)
    level = np.array([[0, 0.5], [0.5, 0.5], [1, 0.5]], dtype=np.float32)
    assert is_collapsed(np.stack([diagonal, level, level[:, ::-1], point(1, 1)])).tolist() == [
        False,
        True,
        True,
        True,
    ]


def test_texels_of_triangles_with_area_are_theirs_alone() -> None:
    uv = np.array([[[0, 0], [0.5, 0], [0, 0.5]]], dtype=np.float32)
    np.testing.assert_allclose(texel_areas(uv, np.array([2.0]), SIZE), 2.0 / 8.0)


def test_curved_groups_are_lit_along_their_mean_normal() -> None:
    tilted = triangle((0, 0, 0), 0.1)
    tilted[:, 2] = tilted[:, 0]
    geometry = geometry_of(np.stack([triangle((0, 0, 0), 0.1), tilted]), np.stack([point(2, 3)] * 2))
    expected = np.array([0, 0, 0.005]) + np.array([-0.005, 0, 0.005])
    np.testing.assert_allclose(geometry.surface_normal[0], expected / np.linalg.norm(expected), atol=1e-6)
