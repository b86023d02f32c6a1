"""Several pages, texel scales, padding for mip levels, and meshes that take too long to unwrap."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.lightmap.charts.box_charts import box_charts
from radiosity_addon.lightmap.texels.rasterization import coverage_sum, rasterize
from radiosity_addon.lightmap.unwrap.atlas import Atlas, AtlasInput, run_atlas
from radiosity_addon.lightmap.unwrap.packing import Limits, padding_for

from .lightmap_meshes import area_uv, box, uv_sphere

pytest.importorskip("xatlas")


def inputs(*meshes) -> list[AtlasInput]:
    return [AtlasInput(f"object {k}", *mesh) for k, mesh in enumerate(meshes)]


def densities(atlas: Atlas, objects: list[AtlasInput]) -> list[float]:
    """Texels per meter of each object, by area."""
    found = []
    for laid, source in zip(atlas.objects, objects, strict=True):
        edges = source.triangles[:, 1:] - source.triangles[:, :1]
        surface = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum()
        flat = area_uv(laid.uv).sum() * atlas.pages[laid.page].resolution ** 2
        found.append(float(np.sqrt(flat / surface)))
    return found


@pytest.mark.parametrize("density", [None, 40.0])
def test_an_objects_scale_is_its_share_of_texels_a_meter(density):
    objects = [AtlasInput(f"box {scale}", *box((1, 1, 1)), scale=scale) for scale in (1.0, 0.5, 2.0)]
    atlas = run_atlas(objects, 256, density)
    found = densities(atlas, objects)
    np.testing.assert_allclose(np.array(found) / found[0], (1.0, 0.5, 2.0), rtol=1e-3)
    np.testing.assert_allclose(atlas.pages[0].density, found[0], rtol=1e-3)


def test_a_density_that_needs_more_than_the_largest_page_makes_more_pages():
    objects = inputs(*[box((1, 1, 1))] * 9)
    atlas = run_atlas(objects, texel_density=50, limits=Limits(largest=256))
    # Two boxes fit on a page, three do not.
    assert run_atlas(objects[:3], texel_density=50).pages[0].resolution > 256
    assert len(atlas.pages) == 5
    assert all(page.resolution <= 256 for page in atlas.pages)
    np.testing.assert_allclose(densities(atlas, objects), 50, rtol=1e-3)
    per_page = np.bincount([laid.page for laid in atlas.objects])
    assert per_page.max() - per_page.min() <= 1
    with pytest.raises(BakeError, match="lower the density"):
        run_atlas(objects, texel_density=50, limits=Limits(largest=64))


@pytest.mark.parametrize("density", [None, 40.0])
def test_objects_are_on_the_pages_they_name(density):
    wanted = (2, 0, 3, 2, 0, 1, 0)
    objects = [AtlasInput(f"box {k}", *box((1, 1, 1)), page=page) for k, page in enumerate(wanted)]
    atlas = run_atlas(objects, 256, density, pages=3)
    assert len(atlas.pages) == 3
    for laid, page in zip(atlas.objects, wanted, strict=True):
        assert page in (0, laid.page + 1)
    assert np.bincount([laid.page for laid in atlas.objects]).tolist() == [3, 2, 2]


def test_pages_without_objects_are_left_out():
    objects = [AtlasInput(f"box {page}", *box((1, 1, 1)), page=page) for page in (4, 2)]
    atlas = run_atlas(objects, 64, pages=4)
    assert [laid.page for laid in atlas.objects] == [1, 0]
    (note,) = atlas.warnings
    assert (note.name, note.is_note) == ("scene", True)
    assert note.message == "only 2 of 4 pages are used: all of an object lies on one page"
    assert not run_atlas(objects, 64, pages=2).warnings


def test_what_does_not_fit_on_the_page_it_names_is_an_error():
    limits = Limits(largest=256)
    objects = [AtlasInput(f"box {k}", *box((1, 1, 1)), page=min(k, 1)) for k in range(9)]
    with pytest.raises(BakeError, match="lower the density"):
        run_atlas(objects, texel_density=50, limits=limits)
    free = [replace(each, page=int(k < 2)) for k, each in enumerate(objects)]
    atlas = run_atlas(free, texel_density=50, limits=limits)
    assert [laid.page for laid in atlas.objects[:2]] == [0, 0]
    assert max(np.bincount([laid.page for laid in atlas.objects])) == 2


@pytest.mark.parametrize("mip_levels", [0, 1, 2, 3])
def test_down_to_the_mip_level_requested_no_texel_shows_two_charts(mip_levels):
    """Bilinear filtering at level L reads whole texels of that level; one may hold one chart only."""
    triangles, polygon = box((1, 1, 1))
    # Far apart in space, so that every polygon is a chart.
    triangles = triangles + 10.0 * polygon[:, None, None]
    atlas = run_atlas(inputs((triangles, polygon)), 256, limits=Limits(padding=padding_for(mip_levels)))
    texels = rasterize(atlas.objects[0].uv, 256)
    assert not atlas.warnings
    owner = polygon[texels.triangle]
    size = 2**mip_levels
    reads = set()
    for row, column, chart in zip(texels.row.tolist(), texels.column.tolist(), owner.tolist(), strict=True):
        # A point of this texel reads its coarse texel and its neighbor on the nearer side.
        for down in {int((row + at) / size + side) for at in (0.01, 0.99) for side in (-0.5, 0.5)}:
            for right in {int((column + at) / size + side) for at in (0.01, 0.99) for side in (-0.5, 0.5)}:
                reads.add((down, right, chart))
    holds = {(r // size, c // size, o) for r, c, o in zip(texels.row, texels.column, owner, strict=True)}
    foreign = {(r, c) for r, c, o in reads for other in range(6) if other != o and (r, c, other) in holds}
    assert foreign == set()


def test_box_charts_lie_front_side_up_and_hang_together():
    triangles, _ = uv_sphere(24, 32)
    vertices, index = np.unique(triangles.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    uv, chart = box_charts(vertices, faces)
    assert chart.max() + 1 == 6
    edges = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    signed = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = signed[0][:, 0] * signed[1][:, 1] - signed[0][:, 1] * signed[1][:, 0]
    np.testing.assert_allclose(area, np.abs(edges).max(axis=1), atol=1e-12)


def test_an_object_that_takes_too_long_is_cut_more_simply_and_named():
    triangles, polygon = uv_sphere(24, 32)
    atlas = run_atlas(inputs((triangles, polygon)), 256, unwrap_seconds=0.0)
    assert [(w.name, "took more than 0 s" in w.message) for w in atlas.warnings] == [("object 0", True)]
    uv = atlas.objects[0].uv
    assert (area_uv(uv) > 0).all()
    assert coverage_sum(uv, 256).max() < 1.01
    assert atlas.pages[0].utilisation > 0.4


def test_a_layout_of_tiny_objects_is_kept_bit_for_bit() -> None:
    """Objects smaller than a texel lie on its center; a later bake that keeps UVs finds them there."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    quad = corners[[[0, 1, 2], [0, 2, 3]]]
    polygon = np.zeros(2, dtype=np.int32)
    objects = [AtlasInput("Floor", 20.0 * quad, polygon)]
    objects += [AtlasInput(f"Chip {n}", 0.01 * quad + (n, 0, 1), polygon) for n in range(100)]
    laid = run_atlas(objects, 64)
    assert any(np.ptp(placed.uv.reshape(-1, 2), axis=0).max() == 0 for placed in laid.objects)
    again = run_atlas([replace(o, uv=p.uv) for o, p in zip(objects, laid.objects, strict=True)], 64)
    assert again.warnings == ()
    for first, second in zip(laid.objects, again.objects, strict=True):
        np.testing.assert_array_equal(first.uv, second.uv)
