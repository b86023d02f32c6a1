"""Texels on a quad's diagonal are whole where the plane goes on, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.continued import join_continued
from radiosity_addon.lightmap.texel_geometry import TexelGeometry
from radiosity_addon.solver import Scene
from radiosity_addon.solver.embree import EmbreeCaster
from tests.rooms import grey, rectangle
from tests.unit.texel_scenes import QUAD_UV, texel_geometry

SIZE = 12

CORNERS = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], dtype=float)


def quad(corners: np.ndarray = CORNERS, uv: np.ndarray = QUAD_UV) -> TexelGeometry:
    """Two triangles, over the page's whole square unless `uv` says otherwise."""
    return joined(corners[[[0, 1, 2], [0, 2, 3]]], uv)


def joined(triangles: np.ndarray, uv: np.ndarray, *others: np.ndarray) -> TexelGeometry:
    """Texels of triangles among others without a lightmap."""
    count, scene = len(triangles), np.concatenate([triangles, *others])
    pages = np.where(np.arange(len(scene)) < count, 0, -1)
    all_uv = np.concatenate([uv, np.zeros((len(scene) - count, 3, 2), dtype=np.float32)])
    geometry = texel_geometry(Scene(scene, grey(len(scene), 0.5), grey(len(scene), 0.0)), all_uv, SIZE, pages)
    join_continued(geometry, EmbreeCaster(scene))
    return geometry


def on_diagonal(geometry: TexelGeometry) -> np.ndarray:
    return np.asarray(geometry.row == geometry.column)


def spread(geometry: TexelGeometry) -> np.ndarray:
    """Return (n, 256, 3) points all over the middle of every texel."""
    grid = (np.stack(np.meshgrid(np.arange(16), np.arange(16)), axis=-1).reshape(1, -1, 2) + 0.5) / 16
    rows = np.arange(len(geometry))
    return geometry.sample(rows, np.broadcast_to(grid, (len(rows), 256, 2)))


def test_a_square_has_no_diagonal() -> None:
    """What lies on both triangles is sampled as what lies on one."""
    geometry = quad()
    assert geometry.whole.all()
    points = spread(geometry)
    np.testing.assert_allclose(points.mean(axis=1), geometry.position, atol=1e-5)
    alone = np.flatnonzero(~on_diagonal(geometry))[0]
    around = points - geometry.position[:, None]
    np.testing.assert_allclose(around, np.broadcast_to(around[alone], around.shape), atol=1e-5)


def bent() -> TexelGeometry:
    """A fold along the diagonal of a tenth of a millimetre in two metres."""
    return quad(np.add(CORNERS, [(0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 1e-4)]))


def laid_otherwise() -> TexelGeometry:
    """The second triangle is drawn out along the page."""
    uv = QUAD_UV.copy()
    uv[1] = [[0, 0], [1, 1], [0, 0.8]]
    return quad(uv=uv)


def back_to_back() -> TexelGeometry:
    """The second triangle is folded over onto the first, and looks down."""
    return quad(CORNERS[[0, 1, 2, 1]])


@pytest.mark.parametrize("folded", [bent, laid_otherwise, back_to_back])
def test_a_diagonal_is_an_edge_where_the_plane_does_not_go_on(folded) -> None:
    geometry = folded()
    diagonal = on_diagonal(geometry)
    assert not geometry.whole[diagonal].any()
    own = geometry.triangles[geometry.triangle[diagonal]]
    points = spread(geometry)[diagonal] - own[:, :1]
    edges = (own[:, 1:] - own[:, :1]).transpose(0, 2, 1)
    weights = np.linalg.pinv(edges)[:, None] @ points[..., None]
    assert (weights > -1e-6).all()
    assert (weights.sum(axis=2) < 1 + 1e-6).all()


def test_texels_at_a_chart_s_border_stay_cut() -> None:
    uv = (QUAD_UV * 0.8 + 0.05).astype(np.float32)
    geometry = quad(uv=uv)
    low, high = uv.min() * SIZE, uv.max() * SIZE
    texels = np.stack([geometry.row, geometry.column], axis=1)
    inside = ((texels >= low) & (texels + 1 <= high)).all(axis=1)
    np.testing.assert_array_equal(geometry.whole, inside)


def test_many_triangles_about_one_corner_cover_its_texel() -> None:
    """Eight triangles around the middle of a texel."""
    angle = np.arange(9) * np.pi / 4 + 0.1
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    flat = np.stack([np.zeros((8, 2)), rim[:-1], rim[1:]], axis=1)
    middle = 6.5 / SIZE
    uv = (middle + flat * 0.4).astype(np.float32)
    triangles = np.concatenate([flat, np.zeros((8, 3, 1))], axis=2)
    geometry = joined(triangles, uv)
    at = geometry.index[0][6, 6]
    assert geometry.whole[at]
    np.testing.assert_allclose(geometry.position[at], 0.0, atol=1e-5)
    np.testing.assert_allclose(spread(geometry)[at].mean(axis=0), 0.0, atol=1e-5)


def test_a_wall_on_the_diagonal_keeps_its_two_sides_apart() -> None:
    """Half of it: beyond its end the floor goes on."""
    wall = rectangle((0.5 / SIZE, 0.5 / SIZE, -0.5), (1, 1, 0), (0, 0, 1))
    geometry = joined(CORNERS[[[0, 1, 2], [0, 2, 3]]], QUAD_UV, wall)
    diagonal = np.flatnonzero(on_diagonal(geometry))
    np.testing.assert_array_equal(geometry.whole[diagonal], geometry.column[diagonal] > SIZE // 2)
    assert geometry.whole[~on_diagonal(geometry)].all()
