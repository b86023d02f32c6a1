"""Seams: which there are, and what stitching makes of them; on functions known in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from radiosity_addon.lightmap.images.dilate import dilate
from radiosity_addon.lightmap.images.seams import Seams, find_seams
from radiosity_addon.lightmap.images.stitch import stitch, stitch_in_place
from radiosity_addon.lightmap.texels.texel_geometry import TexelGeometry
from radiosity_addon.lightmap.unwrap.atlas import AtlasInput, run_atlas
from radiosity_addon.rays.caster import BruteForceCaster
from radiosity_addon.solver import Scene
from tests.rooms import gray, gray_scene, rectangle, solid_box
from tests.seam_steps import seam_steps
from tests.unit.lightmap_meshes import quads, uv_sphere
from tests.unit.texel_scenes import QUAD_UV, in_cell, texel_geometry

Field = Callable[[np.ndarray], np.ndarray]


def stitch_pages(pages: list[np.ndarray], geometry: TexelGeometry, seams: Seams) -> list[np.ndarray]:
    stitched = [page.copy() for page in pages]
    stitch_in_place(stitched, geometry, seams)
    return stitched


def two_tiles(
    resolution: int = 40, second: tuple[float, float, float] = (1, 0, 0)
) -> tuple[Scene, TexelGeometry]:
    """Two unit tiles side by side along x, in charts of their own, off the texels' lattice."""
    triangles = np.concatenate(
        [rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), rectangle((1, 0, 0), second, (0, 1, 0))]
    )
    scene = gray_scene(triangles)
    uv = np.concatenate([in_cell((0.06, 0.06), (0.44, 0.44)), in_cell((0.531, 0.547), (0.911, 0.927))])
    return scene, texel_geometry(scene, uv, resolution)


def smooth_sphere() -> tuple[Scene, TexelGeometry]:
    triangles, polygon = uv_sphere(16, 24)
    scene = gray_scene(triangles, normals=triangles / np.linalg.norm(triangles, axis=2, keepdims=True))
    uv = run_atlas([AtlasInput("Sphere", triangles, polygon)], 96).objects[0].uv
    return scene, texel_geometry(scene, uv, 96)


def smooth_cylinder() -> tuple[Scene, TexelGeometry]:
    angle = 2 * np.pi * np.arange(25) / 24
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    up = np.array([0, 0, 2.0])
    triangles, polygon = quads(np.stack([ring[:-1], ring[1:], ring[1:] + up, ring[:-1] + up], axis=1))
    scene = gray_scene(triangles, normals=triangles * [1, 1, 0])
    uv = run_atlas([AtlasInput("Cylinder", triangles, polygon)], 96).objects[0].uv
    return scene, texel_geometry(scene, uv, 96)


def painted(geometry: TexelGeometry, field: Field) -> list[np.ndarray]:
    """Give every texel the field's value where it lies, and dilate."""
    values = field(geometry.position).astype(np.float32)
    pages = []
    for number, index in enumerate(geometry.index):
        page = np.zeros((*index.shape, 3), dtype=np.float32)
        page[index >= 0] = values[geometry.page == number][index[index >= 0] - geometry.page_start[number]]
        pages.append(dilate(page, index >= 0))
    return pages


def light(position: np.ndarray) -> np.ndarray:
    """Irradiance-like: smooth, positive, three channels apart."""
    x, y, z = np.moveaxis(position, -1, 0)
    return np.stack([2 + np.sin(2 * x + y), 2 + np.cos(3 * z - y), 1.5 + 0.5 * x * z], axis=-1)


def flat_texels(geometry: TexelGeometry) -> np.ndarray:
    """The covered texels with their center on the surface, in the pages' flat numbering."""
    numbers = np.concatenate([page.ravel() for page in geometry.index])
    return np.flatnonzero((numbers >= 0) & geometry.center_inside[numbers])


def test_tiles_have_a_seam_where_they_meet_and_nowhere_else() -> None:
    scene, geometry = two_tiles()
    seams = find_seams(scene, geometry, BruteForceCaster(scene.triangles))
    # 0.38 of 40 texels long, two places a texel.
    assert len(seams) == np.ceil(2 * 0.38 * 40)
    assert seams.length.sum() == pytest.approx(0.38 * 40)
    np.testing.assert_allclose(seams.weight.sum(axis=2), 1)
    x, y = seams.texel % 40, seams.texel // 40
    # What is read lies around x = 0.44 and 0.531 of the page.
    at = (seams.weight * (x + 0.5)).sum(axis=2) / 40
    np.testing.assert_allclose(at, [[0.44, 0.531]] * len(seams), atol=1e-6)
    along = (seams.weight * (y + 0.5)).sum(axis=2) / 40
    np.testing.assert_allclose(along[:, 1] - along[:, 0], 0.547 - 0.06, atol=1e-6)


def test_a_wall_on_the_seam_keeps_its_sides_apart() -> None:
    """A third triangle on the edge, and a wall that only stands there without sharing a corner."""
    scene, geometry = two_tiles()
    for wall in (
        rectangle((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        rectangle((1, -0.3, 0), (0, 2, 0), (0, 0, 1)),
    ):
        triangles = np.concatenate([scene.triangles, wall])
        uv = np.concatenate([geometry.uv, np.zeros((2, 3, 2), np.float32)])
        walled = gray_scene(triangles)
        texels = texel_geometry(walled, uv, 40, np.array([0, 0, 0, 0, -1, -1]))
        assert len(find_seams(walled, texels, BruteForceCaster(triangles))) == 0


@pytest.mark.parametrize("second", [(0, 0, 1), (np.cos(0.3), 0, np.sin(0.3)), (np.cos(2.8), 0, np.sin(2.8))])
def test_a_crease_is_no_seam(second: tuple[float, float, float]) -> None:
    scene, geometry = two_tiles(second=second)
    assert len(find_seams(scene, geometry)) == 0


def test_a_flat_shaded_box_has_no_seams() -> None:
    triangles = solid_box((0, 0, 0), (1, 1, 1))
    scene = gray_scene(triangles)
    uv = run_atlas([AtlasInput("Box", triangles, np.arange(12) // 2)], 64).objects[0].uv
    geometry = texel_geometry(scene, uv, 64)
    seams = find_seams(scene, geometry)
    assert len(seams) == 0
    pages = painted(geometry, light)
    assert stitch_pages(pages, geometry, seams)[0].tobytes() == pages[0].tobytes()
    values = pages[0].reshape(-1, 3)
    np.testing.assert_array_equal(stitch(values, np.ones(len(values)), seams), values)


def test_backs_next_to_fronts_are_no_seam() -> None:
    scene, geometry = two_tiles()
    turned = scene.triangles.copy()
    turned[2:] = turned[2:, ::-1]
    assert len(find_seams(gray_scene(turned), geometry)) == 0


def test_only_texels_read_on_seams_change() -> None:
    scene, geometry = smooth_sphere()
    seams = find_seams(scene, geometry, BruteForceCaster(scene.triangles))
    assert len(seams) > 100
    before = painted(geometry, light)[0]
    after = stitch_pages([before], geometry, seams)[0]
    elsewhere = np.ones(96 * 96, dtype=bool)
    elsewhere[seams.texel] = False
    np.testing.assert_array_equal(after.reshape(-1, 3)[elsewhere], before.reshape(-1, 3)[elsewhere])
    assert (after.reshape(-1, 3)[~elsewhere] != before.reshape(-1, 3)[~elsewhere]).mean() > 0.5


@pytest.mark.parametrize("shape", [smooth_sphere, smooth_cylinder, two_tiles])
def test_a_step_over_a_seam_becomes_smaller_than_between_neighbors(shape: Callable[[], tuple]) -> None:
    """And what is read on the seam comes closer to the truth than it was."""
    scene, geometry = shape()
    seams = find_seams(scene, geometry, BruteForceCaster(scene.triangles))
    before = painted(geometry, light)
    after = stitch_pages(before, geometry, seams)
    across, inside, _ = seam_steps(geometry, seams, before).medians()
    stitched, same, _ = seam_steps(geometry, seams, after).medians()
    assert stitched < 0.3 * across
    assert stitched < 0.5 * inside
    assert same == pytest.approx(inside, rel=0.03)
    # Texels on the surface keep what they have, to a fraction of what a step inside is.
    mine = flat_texels(geometry)
    change = np.abs(after[0] - before[0]).reshape(-1, 3)[mine]
    assert change.mean() < 0.1 * inside * before[0].mean()
    truth = seams_truth(scene, seams, geometry)
    errors = [
        np.abs(seams.sides(pages[0].reshape(-1, 3)) - truth[:, None]).mean() for pages in (before, after)
    ]
    assert errors[1] < errors[0]


def seams_truth(scene: Scene, seams: Seams, geometry: TexelGeometry) -> np.ndarray:
    """(s, 3) the field on the seams themselves: at the places' own barycentric coordinates."""
    size = len(geometry.index[0])
    spot = np.stack([seams.texel[:, 0] % size + 0.5, seams.texel[:, 0] // size + 0.5], axis=2)
    spot = np.einsum("sa,sak->sk", seams.weight[:, 0], spot) / size
    corners = geometry.uv[seams.triangle[:, 0]].astype(float)
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    weights = np.linalg.solve(edges, (spot - corners[:, 0])[:, :, None])[..., 0]
    world = scene.triangles[seams.triangle[:, 0]]
    return light(world[:, 0] + np.einsum("sk,skc->sc", weights, world[:, 1:] - world[:, :1]))


def test_a_constant_stays_what_it_is() -> None:
    scene, geometry = smooth_sphere()
    seams = find_seams(scene, geometry)
    pages = painted(geometry, lambda at: np.full((len(at), 3), 0.7))
    np.testing.assert_array_equal(stitch_pages(pages, geometry, seams)[0], pages[0])


def test_a_shadow_over_a_seam_stays_sharp_and_black() -> None:
    """Half in light, half in shadow: from one texel to the next, and not a glimmer two texels in."""
    scene, geometry = two_tiles()
    seams = find_seams(scene, geometry)

    def shadow(at: np.ndarray) -> np.ndarray:
        return np.repeat((at[:, 1:2] > 0.52).astype(float), 3, axis=1)

    after = stitch_pages(painted(geometry, shadow), geometry, seams)[0].reshape(-1, 3)
    mine = flat_texels(geometry)
    numbers = geometry.index[0].ravel()[mine]
    height, values = geometry.position[numbers, 1] - 0.52, after[mine]
    texel = 1 / (0.38 * 40)
    assert not values[height < -1.5 * texel].any()
    assert np.abs(values - (height > 0)[:, None]).max() < 0.005


def test_sides_that_are_lit_differently_are_left_alone() -> None:
    """A strip in the light of its own keeps it; sides that noise parts are brought together."""
    scene, geometry = two_tiles()
    seams = find_seams(scene, geometry)

    def two_lights(other: float) -> tuple[np.ndarray, np.ndarray]:
        pages = painted(geometry, lambda at: np.where(at[:, :1] > 1.0, other, 1.0).repeat(3, axis=1))
        return pages[0], stitch_pages(pages, geometry, seams)[0]

    apart, left = two_lights(0.5)
    np.testing.assert_array_equal(left, apart)
    near, brought = two_lights(0.8)
    before, after = (np.diff(seams.sides(page.reshape(-1, 3))[..., 0], axis=1) for page in (near, brought))
    assert np.abs(after).max() < 0.75 * np.abs(before).max()


def test_nothing_leaves_the_range_of_what_was_read() -> None:
    """Noise of a factor of a thousand: positive stays positive, and no new extremes."""
    scene, geometry = smooth_sphere()
    seams = find_seams(scene, geometry)
    rng = np.random.default_rng(3)
    before = dilate(
        (10.0 ** rng.uniform(-2, 1, (96, 96, 3))).astype(np.float32), geometry.index[0] >= 0
    ).reshape(-1, 3)
    after = stitch(before, np.full(len(before), 0.1), seams)
    assert after.min() >= before.min()
    assert after.max() <= before.max()
    assert after.dtype == before.dtype


def test_conjugate_gradients_find_the_least_squares() -> None:
    """Against the dense normal equations, where no value needs to be held in its range."""
    scene, geometry = two_tiles(26)
    seams = find_seams(scene, geometry)
    values = painted(geometry, light)[0].reshape(-1, 3).astype(np.float64)
    rng = np.random.default_rng(0)
    hold = rng.uniform(0.2, 2.0, len(values))
    difference = np.zeros((len(seams), len(values)))
    for side, sign in ((0, 1.0), (1, -1.0)):
        np.add.at(
            difference, (np.arange(len(seams))[:, None], seams.texel[:, side]), sign * seams.weight[:, side]
        )
    weighed = difference * seams.length[:, None]
    expected = values - np.linalg.solve(
        difference.T @ weighed + np.diag(hold), difference.T @ (weighed @ values)
    )
    np.testing.assert_allclose(stitch(values, hold, seams), expected, atol=2e-4)


def test_a_seam_may_run_between_pages() -> None:
    triangles = np.concatenate([rectangle((x, 0, 0), (1, 0, 0), (0, 1, 0)) for x in (0, 1)])
    scene = gray_scene(triangles)
    uv = np.concatenate([QUAD_UV * np.float32(0.8), np.float32(0.1) + QUAD_UV * np.float32(0.8)])
    geometry = texel_geometry(scene, uv, 20, np.array([0, 0, 1, 1]))
    seams = find_seams(scene, geometry)
    assert (seams.texel[:, 0] < 400).all()
    assert (seams.texel[:, 1] >= 400).all()
    before = painted(geometry, light)
    after = stitch_pages(before, geometry, seams)
    gaps = []
    for pages in (before, after):
        sides = seams.sides(np.concatenate([page.reshape(-1, 3) for page in pages]))
        gaps.append(np.abs(sides[:, 0] - sides[:, 1]).mean())
    assert gaps[1] < 0.2 * gaps[0]


def test_radiosity_is_stitched_within_one_material_only() -> None:
    scene, geometry = two_tiles()
    seams = find_seams(scene, geometry)
    assert len(seams.of_one_material(scene)) == len(seams) > 0
    painted_tile = Scene(scene.triangles, gray(4, 0.5) * [[1], [1], [0.9], [0.9]], gray(4, 0.0))
    assert len(seams.of_one_material(painted_tile)) == 0
