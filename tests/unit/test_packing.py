"""Packing: charts keep apart by their real shapes, concavities are filled, small ones share texels."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.charts import Charts
from radiosity_addon.lightmap.charts.join_coplanar import join_coplanar
from radiosity_addon.lightmap.texels import rasterize
from radiosity_addon.lightmap.unwrap.align import align
from radiosity_addon.lightmap.unwrap.atlas import AtlasInput, run_atlas
from radiosity_addon.lightmap.unwrap.chart_masks import chart_masks, mask_of
from radiosity_addon.lightmap.unwrap.collapse import ChartPlaces, collapse
from radiosity_addon.lightmap.unwrap.cut_empty import cut_empty_charts
from radiosity_addon.lightmap.unwrap.occupancy import place
from radiosity_addon.lightmap.unwrap.packing import SNAP, Limits, pack
from radiosity_addon.numerics import signed_double_areas, triangle_areas

from .lightmap_meshes import QUAD, area_uv, box, islands, quads


def frame(width: float, height: float, bar: float, at: float = 0.0) -> np.ndarray:
    """Return the four bars of a picture frame, mitred, as (8, 3, 2) triangles."""
    outer = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=float) + at
    inner = outer + bar * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    bars = [np.stack((outer[k], outer[(k + 1) % 4], inner[(k + 1) % 4], inner[k])) for k in range(4)]
    return np.stack(bars)[:, QUAD].reshape(-1, 3, 2)


def rectangles(sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles (2n, 3, 2) and charts (2n,) of n rectangles."""
    corner = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    return (corner * sizes[:, None])[:, QUAD].reshape(-1, 3, 2), np.repeat(np.arange(len(sizes)), 2)


def owners(uv: np.ndarray, chart: np.ndarray, resolution: int) -> np.ndarray:
    """Return the chart that each texel shows, −1 for none."""
    texels = rasterize(uv, resolution)
    page = np.full((resolution, resolution), -1)
    page[texels.row, texels.column] = chart[texels.triangle]
    return page


def assert_apart(page: np.ndarray, gap: int) -> None:
    for down in range(-gap, gap + 1):
        for right in range(-gap, gap + 1):
            moved = np.full_like(page, -1)
            size = len(page)
            to_row, to_column = (slice(max(s, 0), size + min(s, 0)) for s in (down, right))
            of_row, of_column = (slice(max(-s, 0), size - max(s, 0)) for s in (down, right))
            moved[to_row, to_column] = page[of_row, of_column]
            assert ((page < 0) | (moved < 0) | (page == moved)).all()


@pytest.mark.parametrize("padding", [2, 5])
def test_charts_of_all_shapes_keep_their_gap(padding: int) -> None:
    rng = np.random.default_rng(padding)
    parts = [rng.random((1, 3, 2)) * rng.uniform(0.5, 4) for _ in range(40)] + [frame(4, 6, 0.3)] * 4
    uv = np.concatenate(parts)
    uv[:40] = np.where(signed_double_areas(uv[:40])[:, None, None] > 0, uv[:40], uv[:40, ::-1])
    chart = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    packing = pack(uv, chart, 128, None, Limits(padding=padding))
    assert packing.uv.min() >= 0
    assert packing.uv.max() <= 1
    assert_apart(owners(packing.uv, chart, 128), padding)


def test_a_frame_holds_other_charts() -> None:
    """Its box is as large as the page: without its inside nothing else would fit."""
    uv, chart = rectangles(np.array([(1.0, 1.0)] * 25))
    uv, chart = np.concatenate((frame(8, 8, 0.2), uv)), np.concatenate((np.zeros(8, dtype=int), chart + 1))
    packing = pack(uv, chart, 256, None)
    low, high = packing.uv[:8].min(axis=(0, 1)), packing.uv[:8].max(axis=(0, 1))
    assert ((high - low) > 0.9).all()
    assert packing.uv[8:].min() > low.max()
    assert packing.uv[8:].max() < high.min()


@pytest.mark.parametrize("resolution", [256, 512])
def test_rectangles_fill_most_of_the_page(resolution: int) -> None:
    sizes = np.random.default_rng(0).uniform(0.3, 1.5, (300, 2))
    uv, chart = rectangles(sizes)
    packing = pack(uv, chart, resolution, None)
    # With the gaps between them, of two texels at 256 and 512.
    cells = (np.ceil(sizes * packing.density) + 2).prod(axis=1).sum()
    assert cells > 0.9 * resolution**2


def test_the_same_bytes_again() -> None:
    uv, chart = rectangles(np.random.default_rng(1).uniform(0.1, 2.0, (120, 2)))
    assert pack(uv, chart, 128, None).uv.tobytes() == pack(uv, chart, 128, None).uv.tobytes()


def test_masks_are_the_cells_that_triangles_reach() -> None:
    uv = np.array([[[0, 0], [4, 0], [0, 4]]], dtype=float)
    masks = chart_masks(uv, np.zeros(1, dtype=np.int64), np.array([[4.0, 4.0]]))
    assert masks.turned(0, 0).rows == (0b1111, 0b0111, 0b0011, 0b0001)
    assert masks.turned(0, 2).rows == (0b1000, 0b1100, 0b1110, 0b1111)
    assert masks.turned(0, 1).rows == (0b1111, 0b1110, 0b1100, 0b1000)
    assert not masks.boxy.any()


def test_a_run_of_cells_finds_the_lowest_gap() -> None:
    masks = chart_masks(
        *rectangles(np.array([(4, 4), (2, 4), (2, 2)], dtype=float)),
        np.array([(4, 4), (2, 4), (2, 2)], dtype=float),
    )
    placement, share = place((masks, masks), np.arange(3), 6, 8, 0)
    assert share == 1.0
    assert placement is not None
    assert placement.height == 6
    assert mask_of(3, (0b101,)).bands == ((0, 1, ((0, 1), (2, 1))),)
    assert place((masks, masks), np.arange(3), 6, 5, 0)[0] is None


def places(count: int, group: int = 0) -> ChartPlaces:
    spread = np.zeros((count, 3))
    return ChartPlaces(np.full(count, group), spread, np.tile((0.0, 0.0, 1.0), (count, 1)))


@pytest.mark.parametrize("gap", [0, 2])
def test_each_chart_is_put_at_the_lowest_then_leftmost_free_place(gap: int) -> None:
    """As if every place of a page were tried: most are found in the first few rows, some far above."""
    rng = np.random.default_rng(gap)
    boxes, chart = rectangles(rng.uniform(1, 20, (60, 2)))
    corners = rng.uniform(0, 20, (20, 1, 3, 2))
    bent = (corners - corners.min(axis=2, keepdims=True)).reshape(-1, 3, 2)
    uv, chart = np.concatenate((boxes, bent)), np.append(chart, 60 + np.arange(20))
    extent = np.stack([uv[chart == each].max(axis=(0, 1)) for each in range(80)])
    masks, order, size = chart_masks(uv, chart, extent), rng.permutation(80), (48, 480)
    placement, part = place((masks, masks), order, *size, gap)
    assert part == 1.0
    assert placement is not None
    taken = np.zeros((size[1], size[0]), dtype=bool)
    for each in order.tolist():
        whole = masks.covered[masks.start[each] : masks.start[each + 1]].reshape(-1, masks.width[each])
        turned = [np.rot90(whole, -turn) for turn in range(4)]
        windows = [np.lib.stride_tricks.sliding_window_view(taken, of.shape) for of in turned]
        free = [~(window & of).any(axis=(2, 3)) for window, of in zip(windows, turned, strict=True)]
        lowest = [int(of.any(axis=1).argmax()) for of in free]
        best = min(range(4), key=lambda turn: lowest[turn] + len(turned[turn]))
        y, x = lowest[best], int(free[best][lowest[best]].argmax())
        assert (placement.quarter[each], placement.x[each], placement.y[each]) == (best, x, y)
        for row, column in np.argwhere(turned[best]) + np.array((y, x)):
            taken[max(row - gap, 0) : row + gap + 1, max(column - gap, 0) : column + gap + 1] = True
    assert placement.height == 1 + np.flatnonzero(taken.any(axis=1)).max() - gap


def test_small_charts_of_one_neighborhood_share_a_texel_and_thin_ones_get_a_row() -> None:
    extent = np.array([(0.5, 0.5), (0.2, 0.9), (7.2, 0.3), (0.4, 3.0), (5.0, 5.0)])
    block = collapse(places(5), extent, 1.0, 16)
    assert block is not None
    assert block.is_in.tolist() == [True, True, True, True, False]
    assert block.length[2:4].tolist() == [9, 4]
    assert (block.column[0], block.row[0]) == (block.column[1], block.row[1])
    assert block.rows == 1


def test_groups_and_what_faces_elsewhere_share_nothing() -> None:
    extent = np.full((3, 2), 0.5)
    at = places(3)
    at.group[1] = 1
    at.normal[2] = (1, 0, 0)
    block = collapse(at, extent, 1.0, 16)
    assert block is not None
    assert len({(column, row) for column, row in zip(block.column, block.row, strict=True)}) == 3
    kept = collapse(places(3, -1), extent, 1.0, 16)
    assert kept is not None
    assert not kept.is_in.any()


def dust(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a wall of 4 m and many triangles of a millimeter before it."""
    rng = np.random.default_rng(3)
    wall, _ = quads([[(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)]])
    small = 1e-3 * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)]) + np.append(
        4 * rng.random((count, 1, 2)), np.ones((count, 1, 1)), axis=2
    )
    return np.concatenate((wall, small)), np.concatenate(([0, 0], 1 + np.arange(count)))


def test_dust_leaves_the_page_to_the_wall() -> None:
    pytest.importorskip("xatlas")
    triangles, polygon = dust(2000)
    atlas = run_atlas([AtlasInput("wall", triangles, polygon)], 64)
    uv = atlas.objects[0].uv
    assert area_uv(uv[:2]).sum() > 0.4
    assert not atlas.warnings
    texels = rasterize(uv, 64, surface=triangle_areas(triangles))
    column, row = (np.floor(uv[2:, 0] * 64)).astype(int).T
    shown = np.zeros((64, 64), dtype=bool)
    shown[texels.row, texels.column] = texels.triangle >= 2
    assert shown[row, column].all()
    np.testing.assert_allclose(uv[2:] * 64 % 1.0, 0.5, atol=1e-4)


def test_a_frame_becomes_four_bars_where_that_saves_texels() -> None:
    uv = frame(4, 6, 0.05)
    charts = Charts(uv, np.zeros(8, dtype=np.int64), 1)
    polygon, size = np.repeat(np.arange(4), 2), area_uv(uv)
    cut = cut_empty_charts(charts, polygon, size, 10.0, 2)
    assert cut.count == 4
    assert np.unique(np.stack((cut.chart, polygon)), axis=1).shape[1] == 4
    # A full chart stays as it is, and so does a frame of a single polygon.
    assert cut_empty_charts(charts, np.zeros(8, dtype=np.int64), size, 10.0, 2).count == 1
    full, chart = rectangles(np.array([(3.0, 2.0)]))
    assert cut_empty_charts(Charts(full, chart, 1), np.arange(2), area_uv(full), 10.0, 2).count == 1


def test_the_halves_of_a_quad_are_joined() -> None:
    triangles, _ = quads([[(0, 0, 1), (8, 0, 1), (8, 3, 1), (0, 3, 1)]])
    apart = triangles[..., :2] + np.array([0.0, 10.0])[:, None, None]
    uv, chart = join_coplanar(apart, triangles, np.array([0, 1]), np.zeros(2, dtype=np.int64))
    assert chart.tolist() == [0, 0]
    np.testing.assert_allclose(area_uv(uv), 12.0)
    extent = np.ptp(align(uv, chart, 1).reshape(-1, 2), axis=0)
    np.testing.assert_allclose(np.sort(extent), (3, 8), atol=1e-9)


def test_the_halves_of_two_objects_are_not_joined() -> None:
    triangles, _ = quads([[(0, 0, 1), (8, 0, 1), (8, 3, 1), (0, 3, 1)]])
    _, chart = join_coplanar(triangles[..., :2], triangles, np.array([0, 1]), np.array([0, 1]))
    np.testing.assert_array_equal(chart, [0, 1])


def test_what_is_folded_is_not_joined() -> None:
    triangles, _ = quads([[(0, 0, 0), (8, 0, 0), (8, 3, 0), (0, 3, 0.5)]])
    chart = np.array([0, 1])
    assert join_coplanar(triangles[..., :2], triangles, chart, np.zeros(2, dtype=np.int64))[1].tolist() == [
        0,
        1,
    ]


def test_no_texel_is_stretched_by_more_than_two() -> None:
    """Of triangles that keep their shape: singular values of the map from the world to texels."""
    pytest.importorskip("xatlas")
    meshes = [box((1, 2, 3), (k, 0, 0), 0.1 * k) for k in range(30)]
    objects = [AtlasInput(f"box {k}", *mesh) for k, mesh in enumerate(meshes)]
    atlas = run_atlas(objects, 256)
    for source, placed in zip(objects, atlas.objects, strict=True):
        edges = source.triangles[:, 1:] - source.triangles[:, :1]
        flat = (placed.uv[:, 1:] - placed.uv[:, :1]).astype(float) * 256
        across = np.linalg.qr(edges.transpose(0, 2, 1))[1]
        scales = np.linalg.svd(flat.transpose(0, 2, 1) @ np.linalg.inv(across), compute_uv=False)
        # Charts are shrunk to whole texels.
        density = atlas.pages[0].density
        assert (scales < (1 + 1e-3) * density).all()
        assert (scales > (1 - SNAP - 1e-3) * density).all()
    assert len(np.unique(islands(atlas.objects[0].uv))) <= 6


@pytest.mark.parametrize("count", [8, 72])
def test_triangles_lie_in_each_others_boxes(count: int) -> None:
    """A right triangle fills half of every box around it: with boxes apart no more than half is covered."""
    triangles = np.repeat([[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]], count, axis=0)
    assert area_uv(pack(triangles, np.arange(count), 256, None).uv).sum() > 0.5


def test_charts_are_shrunk_to_whole_texels_where_that_is_little() -> None:
    """Sides of 10.3 texels become 10, sides of 10.6 stay: they would shrink by more than a twentieth."""
    pytest.importorskip("xatlas")
    sides = np.repeat([(1.03, 2.0), (1.06, 1.5)], 40, axis=0)
    corners = np.zeros((len(sides), 4, 3))
    corners[:, [1, 2], 0], corners[:, 2:, 1] = sides[:, :1], sides[:, 1:]
    objects = [AtlasInput(f"board {k}", *quads(each[None])) for k, each in enumerate(corners)]
    atlas = run_atlas(objects, texel_density=10.0)
    size = atlas.pages[0].resolution
    found = np.array([np.sort(np.ptp(placed.uv.reshape(-1, 2), axis=0)) for placed in atlas.objects]) * size
    np.testing.assert_allclose(found[:40], [[10.0, 20.0]] * 40, atol=1e-3)
    np.testing.assert_allclose(found[40:], [[10.6, 15.0]] * 40, atol=1e-3)
