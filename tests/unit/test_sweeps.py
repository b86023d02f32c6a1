"""Jacobi sweeps along stored hits: their fixed point, the sky, and elements without texels."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.lighting.reconstruction import light_texels
from radiosity_addon.lightmap.points.interpolation import Interpolation
from radiosity_addon.lightmap.texels.texel_geometry import TexelGeometry
from radiosity_addon.lightmap.transport.gather_links import GatherLinks
from radiosity_addon.lightmap.transport.gather_settings import GatherSettings
from radiosity_addon.lightmap.transport.source_means import SourceMeans, mean_of_sources
from radiosity_addon.lightmap.transport.sub_cells import SWEEPS, SubCellLinks, SubCells, SubCellSweeps
from radiosity_addon.lightmap.transport.sweeps import TexelLight, TexelTransport, sweep
from radiosity_addon.solver import EnvironmentLight, PointLight, Scene, SolverSettings, solve
from radiosity_addon.solver.gather.hit_numbers import NOTHING, SKY
from tests.rooms import box_room, gray, gray_scene, rectangle
from tests.unit.texel_scenes import QUAD_UV, texel_geometry


def reconstructed(scene: Scene, geometry: TexelGeometry, **settings: int) -> TexelLight:
    return light_texels(
        scene,
        solve(scene, SolverSettings(error=1e-3)).local_pass,
        geometry,
        GatherSettings(strides=(2, 1), rays=64, **settings),
    )


def room_with_texels(reflectance: float = 0.5, size: int = 18, **changed) -> tuple[Scene, TexelGeometry]:
    """A closed room; its six sides lie in a 3 × 2 pattern of cells on one page."""
    triangles, surface = box_room()
    scene = Scene(triangles, gray(12, reflectance), **{"emission": gray(12, 0.0), **changed})
    cell = np.stack([surface % 3 / 3, surface // 3 / 3], axis=1)[:, None]
    uv = (np.tile(QUAD_UV, (6, 1, 1)) / 3 + cell).astype(np.float32)
    # Both triangles of each rectangle: `rectangle` lists (a, b, c), then (a, c, d).
    return scene, texel_geometry(scene, uv, size)


def identity(count: int) -> Interpolation:
    return Interpolation(np.arange(count), np.arange(count, dtype=np.int32), np.ones(count, dtype=np.float32))


def test_sweeps_converge_to_the_solution_of_the_stored_links() -> None:
    """H = direct + mean of ρ H over the hits, as a dense solve gives it."""
    scene, geometry = room_with_texels(0.5, lights=[PointLight((0.5, 0.5, 0.5), 10.0)])
    local = solve(scene, SolverSettings(error=1e-2)).local_pass
    rng = np.random.default_rng(1)
    count, rays = len(geometry), 8
    sources = rng.integers(0, count, (count, rays)).astype(np.int32)
    sources[rng.uniform(size=sources.shape) < 0.1] = NOTHING
    lamps = rng.uniform(0, 5, (count, 3))
    links = GatherLinks(sources, identity(count))
    transport = TexelTransport(links, SubCells(np.zeros((0, 3)), []), np.full((count, 3), 0.5))
    light = sweep(transport, np.zeros((count, 3)), lamps, local.elements.beyond(), 40, tolerance=0.0)
    matrix = np.zeros((count, count))
    for ray in range(rays):
        hit = sources[:, ray] >= 0
        np.add.at(matrix, (np.flatnonzero(hit), sources[hit, ray]), 0.5 / rays)
    expected = np.linalg.solve(np.eye(count) - matrix, lamps)
    np.testing.assert_array_equal(light.direct, lamps)
    np.testing.assert_allclose(light.direct + light.indirect, expected, rtol=1e-3)


def test_the_skys_share_of_the_rays_is_direct_light() -> None:
    scene, geometry = room_with_texels(0.5, lights=[EnvironmentLight((1.0, 2.0, 0.0))])
    local = solve(scene, SolverSettings(error=1e-2)).local_pass
    count = len(geometry)
    sources = np.full((count, 4), NOTHING, dtype=np.int32)
    sources[:, :3] = SKY
    lamps = np.zeros((count, 3))
    links = GatherLinks(sources, identity(count))
    transport = TexelTransport(links, SubCells(np.zeros((0, 3)), []), np.full((count, 3), 0.5))
    light = sweep(transport, np.zeros((count, 3)), lamps, local.elements.beyond(), sweeps=3)
    np.testing.assert_allclose(light.direct, np.tile([0.75 * np.pi, 1.5 * np.pi, 0.0], (count, 1)), rtol=1e-6)
    assert not light.indirect.any()


@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.9])
def test_a_uniform_enclosure_is_uniform(reflectance: float) -> None:
    """Every side emits 1: H = 1 / (1 − ρ), of which 1 is direct."""
    scene, geometry = room_with_texels(reflectance, emission=gray(12, 1.0))
    light = reconstructed(scene, geometry)
    total = light.direct + light.indirect
    # At edges and corners emitters are seen from within a rounding of their planes.
    np.testing.assert_allclose(light.direct, 1.0, rtol=2e-3)
    np.testing.assert_allclose(total, 1 / (1 - reflectance), rtol=0.01 if reflectance < 0.9 else 0.02)


@pytest.mark.parametrize("reflectance", [0.5, 0.8])
def test_a_closed_room_keeps_its_power(reflectance: float) -> None:
    """A lamp of 12 W in a unit cube: the mean of all light is 2 / (1 − ρ), whatever is lit where."""
    scene, geometry = room_with_texels(reflectance, lights=[PointLight((0.5, 0.4, 0.6), 12.0)], size=48)
    light = reconstructed(scene, geometry, sweeps=40)
    np.testing.assert_allclose(light.direct.mean(axis=0), 2.0, rtol=2e-3)
    np.testing.assert_allclose((light.direct + light.indirect).mean(axis=0), 2 / (1 - reflectance), rtol=0.01)


def test_surfaces_without_texels_reflect_all_the_same() -> None:
    """Texels on the floor only: the walls are elements, and give what they give with texels of their own."""
    lights = [PointLight((0.5, 0.5, 0.6), 10.0)]
    scene, everywhere = room_with_texels(0.7, lights=lights, size=24)
    uv = np.zeros((12, 3, 2), dtype=np.float32)
    uv[:2] = QUAD_UV / 3
    floor_only = texel_geometry(scene, uv, 24, np.array([0, 0] + [-1] * 10))
    alone = reconstructed(scene, floor_only, sweeps=12)
    whole = reconstructed(scene, everywhere, sweeps=12)
    on_floor = everywhere.triangle < 2
    assert on_floor.sum() == len(floor_only)
    assert alone.indirect.mean() == pytest.approx(whole.indirect[on_floor].mean(), rel=0.02)
    np.testing.assert_allclose(alone.indirect, whole.indirect[on_floor], rtol=0.15)


def test_direct_and_indirect_are_apart() -> None:
    """A lit floor and a shadowed wall behind its back: only the bounce reaches it."""
    floor = rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0))
    wall = rectangle((0, 0, 0), (0, 2, 0), (0, 0, 2))  # looks along +x, the lamp stands behind its plane
    triangles = np.concatenate([floor, wall])
    lamp = PointLight((-0.5, 1, 3.0), 100.0)
    scene = gray_scene(triangles, lights=[lamp])
    uv = np.concatenate([QUAD_UV * [0.5, 1], QUAD_UV * [0.5, 1] + np.array([0.5, 0])]).astype(np.float32)
    light = reconstructed(scene, texel_geometry(scene, uv, 16))
    on_wall = texel_geometry(scene, uv, 16).triangle >= 2
    assert not light.direct[on_wall].any()
    assert (light.indirect[on_wall].max(axis=1) > 0).all()
    # The floor gets its second bounce from the wall, which is dark but for the first.
    assert light.direct[~on_wall].mean() > 5 * light.indirect[~on_wall].mean()


def test_only_rows_that_see_a_change_are_computed_again() -> None:
    random = np.random.default_rng(2)
    sources = random.integers(-2, 40, (300, 8)).astype(np.int32)
    table = random.random((42, 3)).astype(np.float32)
    means = SourceMeans(sources, 3, 2)
    means.of(table, np.zeros(42, dtype=bool))
    changed = np.zeros(42, dtype=bool)
    changed[[7, 41]] = True
    stale = table.copy()
    table[[7, 20, 41]] += 1.0
    found = means.of(table, changed)
    sees = changed[sources].any(axis=1)
    assert 0 < sees.sum() < len(sees)
    np.testing.assert_array_equal(found[sees], mean_of_sources(table, sources[sees]))
    np.testing.assert_array_equal(found[~sees], mean_of_sources(stale, sources[~sees]))


def test_light_goes_on_along_parts_where_the_last_sweep_ended() -> None:
    """A chain of parts of which only the first is lit, longer than there are sweeps among parts at once."""
    texels, length = 100, 3 * SWEEPS
    rows = texels + np.arange(length)
    sources = np.concatenate([[NOTHING], rows[:-1]]).astype(np.int32)[:, None]
    lamps = np.zeros((length, 3))
    lamps[0] = 1.0
    links = SubCellLinks(rows, sources, np.full((length, 3), 0.9), lamps)
    sweeps = SubCellSweeps(SubCells(np.zeros((length, 3)), [links]), texels, 1)
    table = np.zeros((texels + length + 2, 3), dtype=np.float32)
    for _ in range(length // SWEEPS):
        sweeps.sweep(table, np.zeros(len(table), dtype=bool), 1e-6)
    np.testing.assert_allclose(table[rows, 0], 0.9 ** np.arange(1, length + 1), rtol=1e-5)
