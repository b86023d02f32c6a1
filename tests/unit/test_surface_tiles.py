"""Tiles of textured triangles: nothing overlaps, nothing is lost, look-ups keep to themselves."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.images.surface_tiles import SurfaceTiles, lay_out_again, lay_out_surfaces
from radiosity_addon.scene.textures import SurfaceImages

SIDE = 128


def _tiles(count: int = 200, groups: int = 2) -> SurfaceTiles:
    rng = np.random.default_rng(5)
    area = 10.0 ** rng.uniform(-4, 0, count)
    area[::17] = 0.0
    return lay_out_surfaces(area, rng.integers(0, groups, count), SIDE)


def test_no_texel_belongs_to_two_triangles() -> None:
    tiles = _tiles()
    triangle, row, column, *_ = tiles.texels()
    assert len(np.unique(row * tiles.width + column)) == len(row)
    assert row.min() >= 0
    assert row.max() < tiles.height
    assert column.min() >= 0
    assert column.max() < tiles.width == SIDE
    leg = tiles.leg.astype(int)
    np.testing.assert_array_equal(np.bincount(triangle), leg * (leg + 1) // 2)


@pytest.mark.parametrize("chosen", [[0], [3, 17, 34], range(1, 200, 3)])
def test_some_triangles_laid_out_again_have_the_same_texels(chosen: list[int]) -> None:
    tiles, some = _tiles(), np.array(chosen)
    again = lay_out_again(tiles, some)
    np.testing.assert_array_equal(again.leg, tiles.leg[some])
    triangle, row, column, second, third = again.texels()
    assert len(np.unique(row * again.width + column)) == len(row)
    assert column.max() < again.width
    assert row.max() < again.height
    assert again.width * again.height < 4 * (0.5 * (again.leg + 1.0) * (again.leg + 2)).sum() + 16
    of_all, _, _, all_second, all_third = tiles.texels()
    same = np.isin(of_all, some)
    np.testing.assert_array_equal(some[triangle], of_all[same])
    np.testing.assert_array_equal(second, all_second[same])
    np.testing.assert_array_equal(third, all_third[same])


def test_the_image_is_as_large_as_it_may_be_and_larger_triangles_have_more() -> None:
    area = np.repeat([1.0, 4.0, 16.0], 30)
    tiles = lay_out_surfaces(area, np.zeros(90, dtype=int), SIDE)
    assert 0.6 < tiles.height / SIDE < 1.3
    legs = [tiles.leg[area == size].mean() for size in (1, 4, 16)]
    assert legs[0] < legs[1] < legs[2]
    assert legs[2] == pytest.approx(2 * legs[1], rel=0.3)


def test_two_triangles_of_one_wall_take_the_whole_image() -> None:
    tiles = lay_out_surfaces(np.ones(2), np.zeros(2, dtype=int), SIDE)
    assert (tiles.leg >= 0.9 * SIDE).all()
    assert tiles.height < 1.1 * SIDE


def test_samples_lie_inside_and_balance_at_the_centroid() -> None:
    tiles = _tiles()
    triangle, _, _, second, third = tiles.texels()
    assert second.min() > 0
    assert third.min() > 0
    assert (second + third).max() < 1
    count = np.bincount(triangle)
    for weight in (second, third):
        np.testing.assert_allclose(np.bincount(triangle, weight) / count, 1 / 3, rtol=1e-12)


def test_drawn_triangles_cover_their_own_samples_and_give_their_weights() -> None:
    tiles = _tiles(60)
    corners, weights = tiles.drawn_triangles()
    corners = corners * (tiles.width, tiles.height)
    triangle, row, column, second, third = tiles.texels()
    owners = np.zeros((tiles.height, tiles.width), dtype=int)
    centers = np.stack([column + 0.5, row + 0.5], axis=1)
    for number in range(len(tiles.leg)):
        edges = (corners[number, 1:] - corners[number, 0]).T
        at = np.linalg.solve(edges, (centers - corners[number, 0]).T).T
        inside = (at > 1e-9).all(axis=1) & (at.sum(axis=1) < 1 - 1e-9)
        assert inside[triangle == number].all()
        assert not inside[triangle != number].any()
        owners[row[inside], column[inside]] += 1
        own = triangle == number
        found = weights[number, 0] + at[own] @ (weights[number, 1:] - weights[number, 0])
        np.testing.assert_allclose(found, np.stack([second, third], axis=1)[own], atol=1e-9)


def test_look_ups_read_only_their_own_triangle_s_texels() -> None:
    """Every triangle is of one color: bilinear look-ups anywhere on it, its edges too, give that."""
    tiles = _tiles(120)
    triangle, row, column, *_ = tiles.texels()
    shade = np.random.default_rng(6).uniform(0.1, 0.9, len(tiles.leg))
    values = np.zeros((tiles.height, tiles.width, 7), dtype=np.float32)
    values[row, column, :3] = shade[triangle, None]
    values[row, column, 6] = 1.0
    tiles.fill_diagonals(values)
    images = SurfaceImages(values, tiles.coordinates(), np.ones(len(shade), dtype=bool))
    weights = np.random.default_rng(7).dirichlet((0.3, 0.3, 0.3), 300)[:, 1:]
    weights[:3] = (0, 0), (1, 0), (0, 1)
    for number in range(len(shade)):
        found = images.at(np.full(len(weights), number), weights)
        np.testing.assert_allclose(found[:, 0], shade[number], atol=1e-5)
        np.testing.assert_allclose(found[:, 6], 1.0, atol=1e-5)


def test_an_opaque_group_next_to_a_cut_out_one_stays_opaque() -> None:
    group = np.repeat([0, 1], 40)
    tiles = lay_out_surfaces(np.linspace(0.1, 1, 80), group, SIDE)
    triangle, row, column, *_ = tiles.texels()
    values = np.zeros((tiles.height, tiles.width, 7), dtype=np.float32)
    values[..., 6] = 1.0
    values[row[group[triangle] == 1], column[group[triangle] == 1], 6] = 0.0
    images = SurfaceImages(values, tiles.coordinates(), np.ones(80, dtype=bool))
    np.testing.assert_array_equal(images.cut_out, group == 1)
