"""Cells of divided texels: which one a hit asks, and what it answers."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.texels.cells import ALONG, CELLS_PER_TEXEL, OWN, TexelCells
from radiosity_addon.lightmap.texels.occlusion import find_crossings
from radiosity_addon.lightmap.texels.texel_geometry import TexelGeometry
from radiosity_addon.rays.caster import Hits
from radiosity_addon.solver import PointLight, SolverSettings, solve
from radiosity_addon.solver.gather.direct_light import DirectLight
from radiosity_addon.solver.gather.hit_numbers import NOTHING
from tests.rooms import gray_scene, rectangle, solid_box
from tests.unit.texel_scenes import QUAD_UV, texel_geometry

SIZE = 8
FLOOR = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
LAMP = PointLight((0.2, 0.5, 1.0), 10.0)


def cells_of(*others: np.ndarray) -> tuple[TexelCells, TexelGeometry]:
    """The cells of all crossed texels of a floor of 8 × 8 over the unit square, with other things on it."""
    triangles = np.concatenate([FLOOR, *others])
    scene = gray_scene(triangles, lights=[LAMP])
    uv = np.zeros((len(triangles), 3, 2), dtype=np.float32)
    uv[:2] = QUAD_UV
    pages = np.full(len(triangles), -1)
    pages[:2] = 0
    geometry = texel_geometry(scene, uv, SIZE, pages)
    local = solve(scene, SolverSettings(error=1e-2)).local_pass
    crossings = find_crossings(geometry, local.caster)
    return TexelCells(local.elements, geometry, crossings, np.zeros(len(geometry), bool)), geometry


def on_floor(x: np.ndarray, y: np.ndarray) -> Hits:
    """Hits at points of the unit square."""
    upper = y > x  # FLOOR is (a, b, c), then (a, c, d)
    weights = np.where(upper[:, None], np.stack([x, y - x], axis=1), np.stack([x - y, y], axis=1))
    return Hits(upper.astype(np.int32), weights, np.ones(len(x), dtype=bool), np.ones(len(x)))


def wall(at: float) -> np.ndarray:
    """A single plane across the floor at x = at / SIZE, from below it upwards."""
    return rectangle((at / SIZE, -1, -0.5), (0, 3, 0), (0, 0, 2))


@pytest.mark.parametrize("side", [-1, 1])
def test_a_hit_asks_the_nearest_cell_on_its_own_side(side: int) -> None:
    at = 5.4
    cells, geometry = cells_of(wall(at))
    rng = np.random.default_rng(1)
    x = at + side * rng.uniform(0.01, 0.39, 500)
    y = rng.uniform(0.05, SIZE - 0.05, 500)
    hits = on_floor(x / SIZE, y / SIZE)
    texel = geometry.texel_at(hits)
    np.testing.assert_array_equal(geometry.column[texel], 5)
    cell = cells.at(texel, hits)
    assert (cell != NOTHING).all()
    np.testing.assert_array_equal(cells.texel_of(cell), texel)
    anchor = cells.footprints(cell).points
    assert (side * (anchor[:, 0] * SIZE - at) > 0).all()
    # Where the texel is on one triangle whole, its cells are squares: none nearer on this side.
    inner = geometry.whole[texel]
    distance = np.abs(anchor[:, :2] * SIZE - np.stack([x, y], axis=1)).max(axis=1)
    assert distance[inner].max() < 1.0 / ALONG


def test_samples_of_a_cell_stay_on_its_anchors_side() -> None:
    at = 5.4
    cells, _ = cells_of(wall(at))
    every = np.arange(len(cells))
    at_cells = cells.footprints(every)
    u = np.random.default_rng(2).uniform(size=(len(every), 16, 2))
    points = at_cells.sampler(every, u)
    side = np.sign(at_cells.points[:, 0] * SIZE - at)
    assert (side[:, None] * (points[..., 0] * SIZE - at) > 0).all()


@pytest.mark.parametrize("first", [0, OWN], ids=["own", "of the pixel"])
def test_cells_of_a_texel_tile_it(first: int) -> None:
    """Without the wall's shade their samples have the texel's mean, and each its own sixteenth."""
    cells, geometry = cells_of(wall(5.4))
    whole = np.flatnonzero(geometry.whole[cells.texel])[0]
    mine = CELLS_PER_TEXEL * whole + first + np.arange(OWN)
    texel = cells.texel[whole]
    anchors = cells.footprints(mine).points[:, :2] * SIZE
    place = anchors - np.stack([geometry.column[texel], geometry.row[texel]])
    assert len(np.unique(np.floor(place * ALONG), axis=0)) == OWN
    assert (np.floor(place * ALONG) >= 0).all()
    assert (np.floor(place * ALONG) < ALONG).all()


def test_cells_of_the_pixel_answer_hits_beyond_the_texels_triangle() -> None:
    """A pixel on the floor's diagonal shows one of its two triangles; hits on the other one have squares."""
    at = 5.4
    cells, geometry = cells_of(wall(at))
    rng = np.random.default_rng(3)
    x, y = rng.uniform(5.01, 5.99, (2, 400))
    hits = on_floor(x / SIZE, y / SIZE)
    texel = geometry.texel_at(hits)
    foreign = geometry.triangle[texel] != hits.triangle
    assert 100 < foreign.sum() < 300
    cell = cells.at(texel, hits)[foreign]
    assert (cell % CELLS_PER_TEXEL >= OWN).all()
    apart = cells.footprints(cell).points[:, :2] * SIZE - np.stack([x, y], axis=1)[foreign]
    assert np.abs(apart).max() < 1.0 / ALONG
    points = cells.footprints(cell).sampler(np.arange(len(cell)), rng.uniform(size=(len(cell), 8, 2)))
    apart = points[..., :2] * SIZE - cells.footprints(cell).points[:, None, :2] * SIZE
    assert np.abs(apart).max() < 1.0 / ALONG


def test_texels_at_the_rim_of_a_gap_answer_in_cells() -> None:
    """There light fades within a few heights of the gap; farther in, texels answer as a whole."""
    slab = rectangle((1 / SIZE, -1, 0.05 / SIZE), (0, 3, 0), (6 / SIZE, 0, 0))
    cells, geometry = cells_of(slab)
    row, column = geometry.row[cells.texel], geometry.column[cells.texel]
    assert not ((column > 2) & (column < 5) & (row > 0) & (row < SIZE - 1)).any()
    assert set(zip(row.tolist(), column.tolist(), strict=True)) >= {(0, 3), (0, 4), (7, 3), (7, 4)}
    x = np.linspace(1.02, 2.98, 40)
    hits = on_floor(x / SIZE, np.full(40, 5.3) / SIZE)
    texel = geometry.texel_at(hits)
    at_rim = np.isin(texel, cells.texel)
    assert at_rim.sum() >= 20
    cell = cells.at(texel[at_rim], hits.take(at_rim))
    assert (cell != NOTHING).all()
    assert np.abs(cells.footprints(cell).points[:, 0] * SIZE - x[at_rim]).max() < 1.0 / ALONG


def test_light_on_one_side_does_not_reach_the_other() -> None:
    """The lamp stands left of the wall: cells on the right get none of it, and their rays see no lit cell."""
    cells, _ = cells_of(wall(5.4), rectangle((0, -1, 2), (0, 3, 0), (1, 0, 0)))
    every = np.arange(len(cells))
    direct = DirectLight(cells.elements.state).at(cells.lit(every), 4)
    right = cells.footprints(every).points[:, 0] * SIZE > 5.4
    assert not direct[right].any()
    assert (direct[~right] > 0).all()
    points = cells.footprints(every).points[~right]
    exact = LAMP.unit_irradiance(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))
    np.testing.assert_allclose(direct[~right], exact[:, None] * LAMP.strength, rtol=1e-6)


def test_inside_a_box_narrower_than_a_texel_hits_find_a_cell_or_nothing() -> None:
    """Wide enough for an anchor, its inside has cells of its own; a narrower slot has none."""
    low, high = 5.3 / SIZE, 5.7 / SIZE
    cells, geometry = cells_of(solid_box((low, low, -0.1), (high, high, 0.5)))
    hits = on_floor(np.array([5.5, 5.1]) / SIZE, np.array([5.45, 5.45]) / SIZE)
    inside, outside = cells.at(geometry.texel_at(hits), hits)
    anchor = cells.footprints(np.array([inside, outside])).points[:, :2]
    assert ((anchor[0] > low) & (anchor[0] < high)).all()
    assert ((anchor[1] < low) | (anchor[1] > high)).any()
    low, high = 5.40 / SIZE, 5.42 / SIZE
    cells, geometry = cells_of(solid_box((low, low, -0.1), (high, high, 0.5)))
    hits = on_floor(np.array([5.41]) / SIZE, np.array([5.41]) / SIZE)
    assert cells.at(geometry.texel_at(hits), hits)[0] == NOTHING


def test_below_a_hood_only_what_is_below_it_answers() -> None:
    """Through the gap each side sees the other's anchors: the line of sight is free."""
    low, high = 3.55, 6.5
    slab = rectangle((low / SIZE, -1, 0.05 / SIZE), (0, 3, 0), ((high - low) / SIZE, 0, 0))
    cells, geometry = cells_of(slab)
    x = np.linspace(3.02, 3.98, 40)
    hits = on_floor(x / SIZE, np.full(40, 5.3) / SIZE)
    cell = cells.at(geometry.texel_at(hits), hits)
    assert (cell != NOTHING).all()
    anchor = cells.footprints(cell).points[:, 0] * SIZE
    np.testing.assert_array_equal(anchor > low, x > low)
    every = np.arange(len(cells))
    at_cells = cells.footprints(every)
    points = at_cells.sampler(every, np.random.default_rng(3).uniform(size=(len(every), 8, 2)))[..., 0] * SIZE
    below = (at_cells.points[:, 0] * SIZE > low) & (at_cells.points[:, 0] * SIZE < high)
    np.testing.assert_array_equal((points > low) & (points < high), np.repeat(below[:, None], 8, axis=1))


def test_a_cell_draws_the_same_rays_whichever_other_texels_are_divided() -> None:
    """Or rays of a kept bake could not be made again after something else moved onto the floor."""
    alone, _ = cells_of(wall(5.5))
    both, _ = cells_of(wall(2.5), wall(5.5))
    number = alone.renumbered(both)
    assert (number != np.arange(len(alone))).any()
    np.testing.assert_array_equal(both.footprints(number).keys, alone.footprints(np.arange(len(alone))).keys)
    assert len(np.unique(both.footprints(np.arange(len(both))).keys)) == len(both)
