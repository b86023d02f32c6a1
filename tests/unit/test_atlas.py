"""Atlases: polygons stay whole, charts stay apart and to scale, pages hold what was asked."""

import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.base.progress import Progress
from radiosity_addon.lightmap.charts import cut_charts as charts_module
from radiosity_addon.lightmap.charts.cut_charts import unwrap
from radiosity_addon.lightmap.charts.flatten import project_polygons
from radiosity_addon.lightmap.charts.growers import grow_charts
from radiosity_addon.lightmap.images.dilate import dilate
from radiosity_addon.lightmap.texels.rasterization import coverage_sum, rasterize
from radiosity_addon.lightmap.unwrap.atlas import Atlas, AtlasInput, AtlasOptions, build_atlas, run_atlas
from radiosity_addon.lightmap.unwrap.packing import FEW_CHARTS, SNAP

from .lightmap_meshes import area_3d, area_uv, box, cornell, islands, lumpy_ngons, quads, uv_sphere

pytest.importorskip("xatlas")

MESHES = {
    "cube": box((1, 2, 3), turn=0.4),
    "sphere": uv_sphere(16, 24),
    "lumpy": lumpy_ngons(2),
}


def inputs(*meshes: tuple[np.ndarray, np.ndarray]) -> list[AtlasInput]:
    return [AtlasInput(f"object {k}", *mesh) for k, mesh in enumerate(meshes)]


def page_uv(atlas: Atlas, page: int = 0) -> np.ndarray:
    return np.concatenate([placed.uv for placed in atlas.objects if placed.page == page])


def corner_keys(triangles: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    corner = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1)
    return np.repeat(polygon, 3) * (corner.max() + 1) + corner


@pytest.fixture(scope="module", params=sorted(MESHES))
def unwrapped(request):
    triangles, polygon = MESHES[request.param]
    return triangles, polygon, run_atlas(inputs((triangles, polygon)), 256)


def test_a_corner_of_a_polygon_has_one_uv(unwrapped):
    triangles, polygon, atlas = unwrapped
    keys = corner_keys(triangles, polygon)
    uv = atlas.objects[0].uv.reshape(-1, 2)
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    np.testing.assert_array_equal(uv, uv[first][inverse.reshape(-1)])


def test_a_polygon_lies_in_one_chart(unwrapped):
    _, polygon, atlas = unwrapped
    chart = islands(atlas.objects[0].uv)
    for number in np.unique(polygon):
        assert len(np.unique(chart[polygon == number])) == 1


def test_nothing_overlaps_and_nothing_is_mirrored(unwrapped):
    _, _, atlas = unwrapped
    uv = atlas.objects[0].uv
    assert coverage_sum(uv, 512).max() < 1 + 1e-3
    assert (area_uv(uv) > 0).all()


def test_uvs_are_float32_within_the_page_and_off_its_border(unwrapped):
    _, _, atlas = unwrapped
    uv = atlas.objects[0].uv
    assert uv.dtype == np.float32
    assert uv.min() >= 1 / 256
    assert uv.max() <= 1 - 1 / 256


def test_charts_are_two_texels_apart(unwrapped):
    _, _, atlas = unwrapped
    assert_gap(atlas.objects[0].uv, 256, 2)


def assert_gap(uv: np.ndarray, resolution: int, gap: int) -> None:
    """Between texels of different charts lie at least `gap` free ones in every direction."""
    texels = rasterize(uv, resolution)
    chart = islands(uv)[texels.triangle]
    owner = np.full((resolution + 2 * gap,) * 2, -1)
    owner[texels.row + gap, texels.column + gap] = chart
    for row in range(-gap, gap + 1):
        for column in range(-gap, gap + 1):
            other = owner[texels.row + gap + row, texels.column + gap + column]
            assert ((other == -1) | (other == chart)).all()


def test_every_chart_has_its_surfaces_area(unwrapped):
    triangles, _, atlas = unwrapped
    uv, density = atlas.objects[0].uv, atlas.pages[0].density
    chart = islands(uv)
    flat = np.bincount(chart, area_uv(uv)) * 256**2
    ratio = flat / (np.bincount(chart, area_3d(triangles)) * density**2)
    if len(ratio) <= FEW_CHARTS:
        np.testing.assert_allclose(ratio, 1.0, rtol=1e-3)
    else:
        # Among many, charts are shrunk to whole texels.
        assert ratio.max() < 1.0 + 1e-3
        assert ratio.min() > (1.0 - SNAP) ** 2 - 1e-3


def test_planar_polygons_keep_the_area_of_every_triangle():
    mesh = box((1, 2, 3), (4, 5, 6), 0.4)
    atlas = run_atlas(inputs(mesh), 512)
    np.testing.assert_allclose(
        area_uv(atlas.objects[0].uv) * 512**2, area_3d(mesh[0]) * atlas.pages[0].density ** 2, rtol=1e-4
    )


def test_curved_charts_are_nearly_to_scale():
    triangles, polygon = uv_sphere(16, 24)
    atlas = run_atlas(inputs((triangles, polygon)), 512)
    ratio = area_uv(atlas.objects[0].uv) * 512**2 / area_3d(triangles) / atlas.pages[0].density ** 2
    assert ratio.min() > 0.6
    assert ratio.max() < 1.6


def test_bilinear_filtering_within_a_chart_meets_only_that_charts_light():
    triangles, polygon = lumpy_ngons(4)
    uv = run_atlas(inputs((triangles, polygon)), 256).objects[0].uv
    texels, chart = rasterize(uv, 256), islands(uv)
    pixels = np.full((256, 256, 1), np.nan, dtype=np.float32)
    pixels[texels.row, texels.column, 0] = chart[texels.triangle] + 1
    filled = dilate(pixels, texels.coverage())[..., 0]
    rng = np.random.default_rng(0)
    weights = rng.dirichlet((0.3, 0.3, 0.3), (len(uv), 200))
    weights[:, :3] = np.eye(3)
    points = np.einsum("tkc,tcx->tkx", weights, uv.astype(float)) * 256 - 0.5
    low = np.floor(points).astype(int)
    for right in (0, 1):
        for above in (0, 1):
            seen = filled[low[..., 1] + above, low[..., 0] + right]
            np.testing.assert_allclose(seen, np.broadcast_to(chart[:, None] + 1, seen.shape), rtol=1e-6)


def test_the_cornell_box_fills_its_page():
    atlas = run_atlas(inputs(*cornell()), 256)
    uv = page_uv(atlas)
    assert sum(len(mesh[0]) for mesh in cornell()) == 36
    assert len(rasterize(uv, 256)) > 51_000
    assert len(atlas.pages) == 1
    assert {placed.page for placed in atlas.objects} == {0}
    assert_gap(uv, 256, 2)
    assert atlas.pages[0].utilisation == pytest.approx(area_uv(uv).sum(), rel=1e-5)
    # Texels may be longer than wide, but by a quarter at most.
    triangles = np.concatenate([mesh[0] for mesh in cornell()])
    for k in (0, 1):
        side_3d = np.linalg.norm(triangles[:, k + 1] - triangles[:, k], axis=1)
        side_uv = np.linalg.norm(uv[:, k + 1] - uv[:, k], axis=1) * 256
        ratio = side_uv / side_3d / atlas.pages[0].density
        assert ratio.min() > 1.25**-0.5 - 1e-3
        assert ratio.max() < 1.25**0.5 + 1e-3


def test_the_same_input_gives_the_same_bytes():
    first, second = (run_atlas(inputs(*MESHES.values()), 256) for _ in range(2))
    for one, other in zip(first.objects, second.objects, strict=True):
        assert one.uv.tobytes() == other.uv.tobytes()


def test_objects_share_one_density_and_do_not_meet():
    atlas = run_atlas(inputs(box((1, 1, 1)), box((0.1, 0.1, 0.1)), uv_sphere(8, 12)), 256)
    uv = page_uv(atlas)
    assert coverage_sum(uv, 256).max() < 1 + 1e-3
    assert_gap(uv, 256, 2)
    for placed, mesh in zip(atlas.objects, (box((1, 1, 1)), box((0.1, 0.1, 0.1))), strict=False):
        total = area_uv(placed.uv).sum() * 256**2 / atlas.pages[0].density ** 2
        assert total == pytest.approx(area_3d(mesh[0]).sum(), rel=1e-3)


def test_each_object_on_its_own_page():
    atlas = run_atlas(inputs(box((1, 1, 1)), uv_sphere(8, 12)), 64, shared=False)
    assert [placed.page for placed in atlas.objects] == [0, 1]
    assert [page.resolution for page in atlas.pages] == [64, 64]
    assert all(page.utilisation > 0.5 for page in atlas.pages)


@pytest.mark.parametrize("density", [0.5, 10.0, 40.0])
def test_a_density_sets_the_page(density):
    meshes = [box((1, 1, 1)), box((2, 1, 0.5), turn=0.3)]
    atlas = run_atlas(inputs(*meshes), texel_density=density)
    (page,) = atlas.pages
    assert page.density == density
    assert page.resolution % 4 == 0
    surface = sum(area_3d(mesh[0]).sum() for mesh in meshes)
    covered = area_uv(page_uv(atlas)).sum() * page.resolution**2
    assert covered == pytest.approx(surface * density**2, rel=1e-4)
    # A page four texels smaller could not be full to the brim, unless it is all padding.
    if density >= 10:
        assert page.utilisation > 0.6


def test_a_density_beyond_the_largest_page_names_the_fix():
    with pytest.raises(BakeError, match="lower the density"):
        run_atlas(inputs(box((1, 1, 1))), texel_density=20_000)


@pytest.mark.parametrize("others", [0, 3])
def test_a_density_that_one_huge_object_exceeds_names_it(others: int) -> None:
    objects = inputs(*[box((1, 1, 1))] * others, box((9000, 9000, 1)))
    with pytest.raises(BakeError, match=objects[-1].name):
        run_atlas(objects, texel_density=10)


@pytest.mark.parametrize("resolution", [1, 2, 4, 8])
def test_tiny_pages_work_and_say_that_they_are_crowded(resolution):
    atlas = run_atlas(inputs(*cornell()), resolution)
    uv = page_uv(atlas)
    assert uv.min() >= 0
    assert uv.max() <= 1
    assert len(rasterize(uv, resolution)) >= 1
    assert (area_uv(uv) > 0).all()
    assert any("raise the resolution" in warning.message for warning in atlas.warnings)


def test_a_crowded_page_names_the_object_that_takes_it_all():
    """Not the resolution, which would have to be a thousand times as large."""
    small = [box((0.01, 0.01, 0.01)) for _ in range(40)]
    (warning,) = run_atlas(inputs(box((1000, 1000, 0.001)), *small), 16).warnings
    assert warning.name == "object 0"
    assert "99.9 %" in warning.message
    assert "texel scale" in warning.message
    assert "resolution" not in warning.message


def test_a_tiny_object_next_to_a_huge_one_gets_a_texel():
    atlas = run_atlas(inputs(box((100, 100, 100)), box((1e-3, 1e-3, 1e-3)), box((30, 1e-4, 1e-4))), 128)
    texels = rasterize(page_uv(atlas), 128)
    owner = np.repeat([0, 1, 2], 12)[texels.triangle]
    assert (np.bincount(owner, minlength=3) >= 1).all()
    assert (np.bincount(owner, minlength=3)[2]) >= 30  # the rod keeps its length


def test_triangles_without_area_get_harmless_uvs():
    triangles, polygon = box((1, 1, 1))
    flat = np.array([[[0, 0, 0], [1, 1, 1], [2, 2, 2]], [[3, 3, 3]] * 3], dtype=float)
    mesh = np.concatenate((triangles, flat)), np.concatenate((polygon, [6, 7]))
    nothing = flat, np.array([0, 1])
    for shared in (True, False):
        atlas = run_atlas(inputs(mesh, nothing), 64, shared=shared)
        for placed in atlas.objects:
            assert np.isfinite(placed.uv).all()
            assert placed.uv.min() >= 0
            assert placed.uv.max() <= 1
        assert (area_uv(atlas.objects[0].uv)[-2:] == 0).all()
        alone = run_atlas(inputs((triangles, polygon)), 64)
        assert atlas.pages[0].density == pytest.approx(alone.pages[0].density)


def test_a_polygon_with_a_collinear_corner_stays_whole():
    # A pentagon whose third corner lies on a side: one of its triangles has no area.
    a, b, c, d, e = np.array([(0, 0, 0), (1, 0, 0), (1, 0.5, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
    triangles = np.array([[b, c, d], [a, b, d], [a, d, e]])
    uv = run_atlas(inputs((triangles, np.zeros(3, int))), 64).objects[0].uv
    np.testing.assert_allclose(uv[0, 1], 0.5 * (uv[0, 0] + uv[0, 2]), atol=1e-6)
    np.testing.assert_array_equal(uv[0, 0], uv[1, 1])


def test_a_folded_polygon_does_not_overlap_itself():
    # A quad folded so far along its diagonal that its projection turns one half over.
    triangles = np.array(
        [[(0, 0, 0), (2, 0, 0), (1, 1, 0)], [(0, 0, 0), (1, 1, 0), (1.5, 0.2, 0.1)]], dtype=float
    )
    uv = project_polygons(triangles, np.zeros(2, dtype=np.int64))
    assert (area_uv(uv) > 0).all()
    uv = run_atlas(inputs((triangles, np.zeros(2, int))), 64).objects[0].uv
    assert (area_uv(uv) > 0).all()
    assert coverage_sum(uv, 64).max() < 1 + 1e-3


def test_without_a_chart_grower_every_polygon_is_a_chart():
    triangles, polygon = uv_sphere(6, 8)
    charts = unwrap(triangles, polygon, None)
    assert charts.count == 48
    np.testing.assert_array_equal(np.unique(charts.chart, return_inverse=True)[1], polygon)


def test_a_polygon_that_the_grower_cuts_gets_its_own_chart():
    triangles, polygon = box((1, 1, 1))

    def cutting(vertices, faces, mesh):
        uv, chart = grow_charts(vertices, faces, mesh)
        chart[0] = chart.max() + 1
        return uv, chart

    charts = unwrap(triangles, polygon, cutting)
    assert charts.count == 6
    assert charts.chart[0] == charts.chart[1]
    assert (charts.chart[2:] != charts.chart[0]).all()


def test_large_objects_go_through_in_pieces(monkeypatch):
    triangles, polygon = lumpy_ngons(7, rings=8, segments=12)
    monkeypatch.setattr(charts_module, "PIECE", 40)
    steps = []
    progress = Progress(lambda status: steps.append(status.fraction))
    atlas = build_atlas(inputs((triangles, polygon)), AtlasOptions(256), progress)
    assert len(steps) > len(triangles) / 40
    assert steps == sorted(steps)
    assert steps[0] >= 0
    assert steps[-1] <= 1
    uv = atlas.objects[0].uv
    assert (area_uv(uv) > 0).all()
    assert coverage_sum(uv, 256).max() < 1 + 1e-3


def test_nothing_to_lay_out_is_an_error():
    with pytest.raises(BakeError, match="no mesh"):
        run_atlas([], 64)


def square_uv(low: float, high: float) -> np.ndarray:
    corners = np.array([(low, low), (high, low), (high, high), (low, high)], dtype=np.float32)
    return corners[[[0, 1, 2], [0, 2, 3]]]


def kept(name: str, uv: np.ndarray, size: float = 1.0) -> AtlasInput:
    triangles, polygon = quads([[(0, 0, 0), (size, 0, 0), (size, size, 0), (0, size, 0)]])
    return AtlasInput(name, triangles, polygon, uv)


def test_kept_uvs_stay_bit_for_bit():
    one, other = square_uv(0.1, 0.3), square_uv(0.55, 0.9)
    for shared in (True, False):
        atlas = run_atlas([kept("one", one), kept("other", other)], 64, shared=shared)
        assert atlas.objects[0].uv.tobytes() == one.tobytes()
        assert atlas.objects[1].uv.tobytes() == other.tobytes()
        assert atlas.warnings == ()


def test_kept_uvs_that_lie_over_each_other_are_packed_as_they_are_shaped():
    full = square_uv(0, 1)
    atlas = run_atlas([kept("one", full), kept("two", full), kept("large", full, 2.0)], 256)
    uv = page_uv(atlas)
    assert coverage_sum(uv, 256).max() < 1 + 1e-3
    areas = area_uv(uv).reshape(3, 2).sum(axis=1)
    np.testing.assert_allclose(areas / areas[0], (1, 1, 4), rtol=1e-4)
    own = run_atlas([kept("one", full), kept("two", full)], 256, shared=False)
    assert all(placed.uv.tobytes() == full.tobytes() for placed in own.objects)


def test_kept_and_new_share_a_page():
    atlas = run_atlas([kept("old", square_uv(0, 1)), *inputs(box((1, 1, 1)))], 128)
    assert coverage_sum(page_uv(atlas), 128).max() < 1 + 1e-3


ON_A_LINE = np.linspace(0.1, 0.7, 6, dtype=np.float32).reshape(2, 3, 1) * np.array((1, 0.3), np.float32)
"""But for rounding: it has an area of 2e-9."""


@pytest.mark.parametrize(
    ("uv", "words"),
    [
        (square_uv(-0.2, 0.7), "unit square"),
        (np.concatenate((square_uv(0, 1)[:1], square_uv(0, 1)[:1])), "overlap"),
        (np.zeros((2, 3, 2), np.float32), "unwrapped again"),
        (np.full((2, 3, 2), np.nan, np.float32), "unwrapped again"),
        (ON_A_LINE, "unwrapped again"),
    ],
)
def test_useless_kept_uvs_are_named(uv, words):
    atlas = run_atlas([kept("wall", uv)], 64)
    assert [(w.name, words in w.message) for w in atlas.warnings] == [("wall", True)]
    assert np.isfinite(atlas.objects[0].uv).all()
    assert area_uv(atlas.objects[0].uv).sum() > 1e-3


def test_a_density_for_kept_uvs_sets_the_pages_size():
    atlas = run_atlas([kept("wall", square_uv(0, 0.5), 3.0)], texel_density=10)
    assert atlas.pages[0].resolution == 60
    assert atlas.pages[0].density == pytest.approx(10)
