"""Interpolating between gather points: what it reproduces, and what it never reaches across."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from radiosity_addon.lightmap.points.interpolation import (
    BESIDE,
    GatherPoints,
    Interpolation,
    fit,
    linear_weights,
)
from radiosity_addon.lightmap.texels.texel_geometry import TexelGeometry
from radiosity_addon.rays.embree import EmbreeCaster
from tests.rooms import gray_scene, rectangle, sphere
from tests.unit.texel_scenes import QUAD_UV, in_cell, texel_geometry

SIZE = 24


def caster_of(geometry: TexelGeometry) -> EmbreeCaster:
    return EmbreeCaster(geometry.triangles)


def geometry_of(*parts: np.ndarray, uv: np.ndarray | None = None) -> TexelGeometry:
    triangles = np.concatenate(parts)
    scene = gray_scene(triangles)
    return texel_geometry(scene, QUAD_UV if uv is None else uv, SIZE)


def points_of(geometry: TexelGeometry, *strides: int, closeness: float = 0.2) -> GatherPoints:
    """Gather points on lattices, each level where the earlier ones do not reach."""
    points = GatherPoints(geometry, caster_of(geometry), np.zeros(len(geometry), dtype=bool))
    for stride in strides:
        chosen = np.flatnonzero((geometry.row % stride == 0) & (geometry.column % stride == 0))
        if len(points):
            chosen = np.setdiff1d(chosen, points.texel)
            chosen = chosen[points.support(chosen) < 1.0]
        points.add(stride, chosen.astype(np.int32), np.full(len(chosen), closeness))
    return points


def weights_of(spread: Interpolation, points: GatherPoints, texels: int) -> np.ndarray:
    """Return the (n, g) operator."""
    matrix = np.zeros((texels, len(points)))
    ends = np.append(spread.first[1:], len(spread.point))
    for texel, (start, end) in enumerate(zip(spread.first, ends, strict=True)):
        np.add.at(matrix[texel], spread.point[start:end], spread.weight[start:end])
    return matrix


PLANE = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0.5))


@pytest.mark.parametrize("strides", [(4, 1), (4, 2, 1), (1,)])
def test_constants_are_reproduced_and_every_texel_has_a_row(strides: tuple[int, ...]) -> None:
    geometry = geometry_of(PLANE)
    points = points_of(geometry, *strides)
    spread = fit(points, geometry)
    assert len(spread.first) == len(geometry)
    assert (np.diff(np.append(spread.first, len(spread.point))) >= 1).all()
    constant = spread(np.full((len(points), 3), 7.0))
    np.testing.assert_allclose(constant, 7.0, rtol=1e-5)
    matrix = weights_of(spread, points, len(geometry))
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, atol=1e-5)
    values = np.random.default_rng(0).normal(size=(len(points), 2))
    np.testing.assert_allclose(spread(values), matrix @ values, atol=1e-5)


def test_linear_fields_are_nearly_reproduced() -> None:
    """Damped slopes: within a twelfth of what the field changes between two gather points."""
    geometry = geometry_of(PLANE)
    points = points_of(geometry, 4, 1)
    field = geometry.position @ np.array([[1.0], [-2.0], [0.5]])
    got = fit(points, geometry)(field[points.texel])
    step = (
        np.abs(field[geometry.index[0][0, 4]] - field[geometry.index[0][0, 0]]).item()
        + np.abs(field[geometry.index[0][4, 0]] - field[geometry.index[0][0, 0]]).item()
    )
    inside = (geometry.row < SIZE - 4) & (geometry.column < SIZE - 4)
    assert np.abs(got - field)[inside].max() < step / 12
    # At the border, where all points lie on one line, there is no slope across it to go on with.
    assert np.abs(got - field).max() < 0.5 * step


def test_a_texel_that_is_a_point_of_a_dense_lattice_keeps_nearly_its_value() -> None:
    geometry = geometry_of(PLANE)
    points = points_of(geometry, 1, closeness=50.0)  # so close to something that no neighbor counts
    matrix = weights_of(fit(points, geometry), points, len(geometry))
    np.testing.assert_allclose(matrix[points.texel, np.arange(len(points))], 1.0, atol=1e-6)


def test_nothing_is_carried_around_an_edge() -> None:
    """Floor and wall side by side on the page: their normals turn by a right angle."""
    floor = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    wall = rectangle((1, 0, 0), (0, 0, 1), (0, 1, 0))
    uv = np.concatenate([in_cell((0, 0), (0.5, 1)), in_cell((0.5, 0), (1, 1))])
    geometry = geometry_of(floor, wall, uv=uv)
    points = points_of(geometry, 4, 2)
    matrix = weights_of(fit(points, geometry), points, len(geometry))
    on_floor = geometry.triangle < 2
    across = matrix[np.ix_(on_floor, ~on_floor[points.texel])]
    assert (on_floor[points.texel].any(), (~on_floor)[points.texel].any()) == (True, True)
    assert not across.any()
    assert not matrix[np.ix_(~on_floor, on_floor[points.texel])].any()


@pytest.mark.parametrize("closeness", [0.0, 0.3])
def test_nothing_is_carried_through_a_wall(closeness: float) -> None:
    """However far a point in the open may speak, it does not for what it cannot see."""
    wall = rectangle((0.4, -1, -0.5), (0, 3, 0), (0, 0, 1))
    triangles = np.concatenate([rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), wall])
    scene = gray_scene(triangles)
    uv = np.concatenate([QUAD_UV, np.zeros_like(QUAD_UV)])
    geometry = texel_geometry(scene, uv, SIZE, pages=np.array([0, 0, -1, -1]))
    points = points_of(geometry, 8, 4, closeness=closeness)
    left = geometry.position[:, 0] < 0.4
    got = fit(points, geometry)(left[points.texel, None].astype(float))
    np.testing.assert_allclose(got[:, 0], left, atol=1e-5)


def test_over_a_dome_neighbors_see_each_other() -> None:
    """A bulge between two points is no wall: seen whole, or the eye sees facets."""
    dome = sphere(4)[:, [0, 2, 1]]
    cell = np.stack(np.divmod(np.arange(len(dome)), 46), axis=1)[:, None] / 46
    uv = np.zeros((len(dome), 3, 2))
    uv[:, 1, 0] = uv[:, 2, 1] = 0.99 / 46
    scene = gray_scene(dome, normals=dome)
    geometry = texel_geometry(scene, (uv + cell).astype(np.float32), 46)
    assert len(geometry) == len(dome)
    points = GatherPoints(geometry, caster_of(geometry), np.zeros(len(geometry), dtype=bool))
    points.add(1, np.arange(len(geometry), dtype=np.int32), np.zeros(len(geometry)))
    some = np.arange(0, len(geometry), 50)
    away = np.linalg.norm(geometry.position[:, None] - geometry.position[some], axis=2)
    near = np.argsort(away, axis=0)[1:9].T.astype(np.int32)
    turn = np.einsum("nck,nk->nc", geometry.normal[near], geometry.normal[some])
    reached = np.sqrt(1 - turn) < 0.3
    assert reached.mean() > 0.9
    weight = points.kernel(np.repeat(some, near.shape[1]), near.ravel())
    assert (weight.reshape(near.shape)[reached] > 0).all()


def test_charts_next_to_each_other_on_the_page_and_far_apart_in_the_world_do_not_mix() -> None:
    here, there = PLANE, PLANE + np.array([50.0, 0, 0])
    uv = np.concatenate([in_cell((0, 0), (0.5, 1)), in_cell((0.5, 0), (1, 1))])
    geometry = geometry_of(here, there, uv=uv)
    points = points_of(geometry, 4, 2)
    got = fit(points, geometry)((geometry.triangle[points.texel, None] < 2).astype(float))
    np.testing.assert_allclose(got[:, 0], geometry.triangle < 2, atol=1e-5)


def test_pages_do_not_mix() -> None:
    triangles = np.concatenate([PLANE, PLANE + np.array([0, 0, 0.01])])
    scene = gray_scene(triangles)
    uv = np.concatenate([QUAD_UV, QUAD_UV])
    geometry = texel_geometry(scene, uv, SIZE, pages=np.array([0, 0, 1, 1]))
    points = points_of(geometry, 4, 1)
    got = fit(points, geometry)((geometry.page[points.texel, None] == 0).astype(float))
    np.testing.assert_allclose(got[:, 0], geometry.page == 0, atol=1e-5)


def test_support_falls_with_distance_and_closeness() -> None:
    geometry = geometry_of(PLANE)
    at = geometry.index[0][12, 8:17]
    supports = []
    for closeness in (0.2, 1.0, 5.0):
        points = GatherPoints(geometry, caster_of(geometry), np.zeros(len(geometry), dtype=bool))
        points.add(4, np.array([at[0]], dtype=np.int32), np.array([closeness]))
        support = points.support(at)
        assert support[0] == pytest.approx(1.0, abs=1e-6)
        assert (np.diff(support) <= 0).all()
        supports.append(support)
    assert (supports[0] >= supports[1]).all()
    assert (supports[1] >= supports[2]).all()
    assert supports[0][3] > supports[1][3] > supports[2][3]


@pytest.mark.parametrize("away", [1, 2, 3])
def test_one_row_of_points_supports_what_lies_beside_it_less(away: int) -> None:
    """Between two rows all weights count, beside one of them a part by its distance in texels."""
    geometry = geometry_of(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)))
    texel = geometry.index[0][12:13, 4]
    for rows, part in (([12 - away, 12 + away], 1.0), ([12 + away], 1 / (1 + (away / BESIDE) ** 2))):
        points = GatherPoints(geometry, caster_of(geometry), np.zeros(len(geometry), dtype=bool))
        chosen = geometry.index[0][rows, 4]
        points.add(4, chosen, np.full(len(chosen), 0.2))
        _, _, weight = points.weighed(texel)
        np.testing.assert_allclose(points.support(texel), part * weight.sum(), rtol=1e-5)


def test_a_point_near_something_listens_no_farther_than_it_speaks() -> None:
    """What stands close to a point takes part of its view; points in the open do not know."""
    geometry = geometry_of(PLANE)
    points = points_of(geometry, 4, 1)
    near = np.setdiff1d(geometry.index[0], points.texel)[:1].astype(np.int32)
    assert points.support(near)[0] > 0.5
    points.add(1, near, np.array([20.0]))
    matrix = weights_of(fit(points, geometry), points, len(geometry))
    np.testing.assert_allclose(matrix[near[0]], points.texel == near, atol=1e-6)
    # So weighed whatever was known before it became a point.
    fresh = GatherPoints(geometry, caster_of(geometry), np.zeros(len(geometry), dtype=bool))
    fresh.add(4, points.texel, points.closeness)
    again = weights_of(fit(fresh, geometry), fresh, len(geometry))
    np.testing.assert_allclose(again[near[0]], matrix[near[0]], atol=1e-6)


def test_a_point_does_not_speak_for_texels_whose_neighbors_see_things_near() -> None:
    """What a point sees at d meters, a texel s away from it sees at d + s, or nearer: a point in the open
    is no longer heard there."""
    geometry = geometry_of(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)))

    def support(near: float) -> np.ndarray:
        """Points on a lattice: the first column sees things `near`, all others see far."""
        points = GatherPoints(geometry, caster_of(geometry), np.zeros(len(geometry), dtype=bool))
        chosen = np.flatnonzero((geometry.row % 4 == 0) & (geometry.column % 4 == 0)).astype(np.int32)
        points.add(4, chosen, np.where(geometry.column[chosen] == 0, 1.0 / near, 0.2))
        return points.support(np.arange(len(geometry)))

    beside, away = (geometry.column == 1) & (geometry.row % 4 != 0), geometry.column == 16
    alone, together = support(5.0), support(0.01)
    assert alone[beside].min() > 0.0
    # A texel is 1 / 24 wide. In the next column the reach is 0.35 (0.01 + 1 / 24): no point is so near.
    assert together[beside].max() == 0.0
    np.testing.assert_allclose(together[away], alone[away])


def test_a_texel_that_nothing_reaches_is_an_error() -> None:
    geometry = geometry_of(PLANE)
    with pytest.raises(ValueError, match="no gather point"):
        fit(points_of(geometry, 4, closeness=100.0), geometry)


def test_coplanar_surfaces_on_different_pages_share_their_points() -> None:
    """One chart goes on where the other ends: at the seam both take from both."""
    other = PLANE + np.array([1.0, 0, 0])
    scene = gray_scene(np.concatenate([PLANE, other]), 0.5)
    geometry = texel_geometry(scene, np.concatenate([QUAD_UV, QUAD_UV]), SIZE, pages=np.array([0, 0, 1, 1]))
    points = points_of(geometry, 4, 1)
    share = fit(points, geometry)((geometry.page[points.texel, None] == 0).astype(float))[:, 0]
    at_seam = np.abs(geometry.position[:, 0] - 1.0) < 1.0 / SIZE
    assert ((share > 0.1) & (share < 0.9))[at_seam].all()
    far = np.abs(geometry.position[:, 0] - 1.0) > 0.5
    np.testing.assert_allclose(share[far], geometry.page[far] == 0, atol=1e-5)


def test_a_tight_bunch_of_points_far_away_cannot_make_light():
    """Points within 1 mm of each other, 1 m off: their slope is not followed for a meter."""
    along = np.array([[1.0, 0, 0], [1.001, 0, 0], [1.0, 0.001, 0]])
    weights = linear_weights(along, np.array([0.2, 0.5, 0.3]), np.array([3]))
    assert weights.sum() == pytest.approx(1.0, rel=1e-5)
    assert np.abs(weights).sum() <= 3.0 + 1e-5


def test_earlier_weights_are_kept_and_not_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """The weights of a bake that asked for support are those of one that never did."""
    geometry = geometry_of(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0.5)))
    asked = points_of(geometry, 4, 2, 1, closeness=2.0)
    fresh = GatherPoints(geometry, caster_of(geometry), np.zeros(len(geometry), dtype=bool))
    for level, stride in enumerate((4, 2, 1)):
        added = asked.level == level
        fresh.add(stride, asked.texel[added], asked.closeness[added])
    weighed, kernel = Counter[int](), GatherPoints.kernel

    def counted(points: GatherPoints, texels: np.ndarray, near: np.ndarray) -> np.ndarray:
        weighed[id(points)] += len(texels)
        return kernel(points, texels, near)

    monkeypatch.setattr(GatherPoints, "kernel", counted)
    count = len(geometry)
    again = weights_of(fit(fresh, geometry), fresh, count)
    np.testing.assert_allclose(weights_of(fit(asked, geometry), asked, count), again, atol=2e-6)
    assert 0 < weighed[id(asked)] < weighed[id(fresh)]


def test_the_threads_change_no_texel() -> None:
    geometry = geometry_of(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0.5)))
    spread = fit(points_of(geometry, 4, 1), geometry)
    values = np.random.default_rng(3).random((int(spread.point.max()) + 1, 3))
    for threads in (2, 3):
        np.testing.assert_array_equal(spread(values, threads), spread(values, 1))


def test_texels_of_different_widths_find_their_own_points() -> None:
    """A board next to a ground whose texels are 16 times as wide, and most of all."""
    width = 1.0 / 24.0
    board = rectangle((0, 0, 1), (1, 0, 0), (0, 1, 0))
    ground = rectangle((0, 0, 0), (36 * 16 * width, 0, 0), (0, 60 * 16 * width, 0))
    on_page = in_cell((0, 0), (24 / 64, 24 / 64))
    both = np.concatenate([on_page, in_cell((28 / 64, 4 / 64), (1, 1))])
    alone = texel_geometry(gray_scene(board), on_page, 64)
    together = texel_geometry(gray_scene(np.concatenate([board, ground])), both, 64)
    assert together.texel_size == pytest.approx(16 * width, rel=1e-3)
    chosen = [points_of(geometry, 4, 2, 1).texel for geometry in (alone, together)]
    of_board = chosen[1][together.triangle[chosen[1]] < 2]
    assert len(chosen[0]) < 0.6 * len(alone)
    np.testing.assert_array_equal(alone.row[chosen[0]], together.row[of_board])
    np.testing.assert_array_equal(alone.column[chosen[0]], together.column[of_board])


def test_what_is_close_to_a_hidden_wall_is_not_close_to_the_board_before_it() -> None:
    """A wall 3 cm behind a board sees the board's back; the board looks into the open."""
    board = rectangle((0, 0, 0.03), (1, 0, 0), (0, 1, 0))
    wall = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    uv = np.concatenate([in_cell((0, 0), (0.5, 1)), in_cell((0.5, 0), (1, 1))])
    supports = []
    for of_wall in (0.5, 1.0 / 0.02):
        geometry = geometry_of(board, wall, uv=uv)
        points = GatherPoints(geometry, caster_of(geometry), np.zeros(len(geometry), dtype=bool))
        chosen = np.flatnonzero((geometry.row % 4 == 0) & (geometry.column % 4 == 0)).astype(np.int32)
        points.add(4, chosen, np.where(geometry.triangle[chosen] < 2, 0.5, of_wall))
        of_board = np.setdiff1d(np.flatnonzero(geometry.triangle < 2), chosen)
        supports.append(points.support(of_board))
    assert supports[0].min() > 0
    np.testing.assert_array_equal(*supports)
