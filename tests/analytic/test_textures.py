"""Textured surfaces and cut-outs: identities, closed forms, and the same cut as geometry."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.form_factors.formulas import point_to_polygon
from radiosity_addon.scene.textures import SurfaceImages
from radiosity_addon.solver import PointLight, Scene, SolverSettings, solve
from radiosity_addon.solver.gather.footprints import Footprints
from tests.rooms import CEILING, box_room, gray, gray_scene, rectangle
from tests.textured_rooms import furnace, image, patterned
from tests.unit.solved_rooms import solved
from tests.unit.texel_scenes import QUAD_UV

FIXED = ("two-level", "shooting", "conjugate-gradient", "gauss-seidel", "jacobi", "dense")


def assert_furnace(scene: Scene, solution, level: float, each: float, mean: float) -> None:
    """H = c on every side of every triangle, and what comes out goes back in."""
    sides = [solution.triangle_irradiance]
    if scene.two_sided.any():
        sides.append(solution.back_irradiance[scene.two_sided])
    for irradiance in sides:
        np.testing.assert_allclose(irradiance, level, rtol=each)
    whole = scene.areas @ solution.triangle_irradiance / scene.areas.sum()
    np.testing.assert_allclose(whole, level, rtol=mean)
    power = solution.report["power_W"]
    assert power["absorbed"] + power["escaped"] == pytest.approx(power["emitted"], rel=mean)
    assert power["escaped"] == pytest.approx(0.0, abs=1e-4 * power["emitted"])
    assert solution.report["closure_area_mean"] == pytest.approx(1.0, abs=mean)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_textured_furnace_is_uniform(seed: int) -> None:
    """E(x) = (1 − ρ(x)) c in a closed room: B = H = c everywhere, for any texture."""
    scene = furnace(3.0, seed=seed)
    solution = solve(scene)
    assert_furnace(scene, solution, 3.0, each=0.02, mean=0.005)
    np.testing.assert_allclose(solution.triangle_radiosity, 3.0, rtol=0.02)
    points = np.random.default_rng(2).uniform(0.1, 0.9, (20, 3)) * (2, 1, 0)
    found = solution.irradiance(points, np.tile([0, 0, 1.0], (20, 1)))
    np.testing.assert_allclose(found, 3.0, rtol=0.06)
    np.testing.assert_allclose(found.mean(axis=0), 3.0, rtol=0.01)


@pytest.mark.parametrize("method", FIXED)
def test_a_textured_furnace_is_uniform_by_any_method(method: str) -> None:
    scene = furnace(3.0)
    solution = solve(scene, SolverSettings(method=method, elements=150, patches=60, tolerance=1e-4))
    assert_furnace(scene, solution, 3.0, each=0.03, mean=0.01)


@pytest.mark.parametrize("assembly", ["collocation", "linear"])
def test_a_textured_furnace_is_uniform_by_any_assembly(assembly: str) -> None:
    scene = furnace(3.0)
    solution = solve(scene, SolverSettings(method="dense", elements=200, assembly=assembly))
    assert_furnace(scene, solution, 3.0, each=0.03, mean=0.02)


@pytest.mark.parametrize("opacity", [0.5, "noise", "holes"])
def test_a_screen_does_not_disturb_the_furnace(opacity) -> None:
    """What a screen lets through, what it emits and what it reflects add up to c on both sides."""
    chance = np.random.default_rng(5)
    noise = chance.random((32, 32))
    opacity = {"noise": noise, "holes": np.round(noise.repeat(4, 0).repeat(4, 1)[:32, :32])}.get(
        opacity, opacity
    )
    scene = furnace(3.0, opacity)
    solution = solve(scene)
    assert_furnace(scene, solution, 3.0, each=0.03, mean=0.01)
    np.testing.assert_allclose(
        solution.triangle_radiosity[12:], 3.0 * scene.opacity[12:, None].repeat(3, 1), rtol=0.03
    )


def test_a_screen_of_many_faces_does_not_disturb_the_furnace() -> None:
    """The same through links to and from clusters."""
    room, _ = box_room((2, 1, 1), 8)
    triangles = np.concatenate([room, rectangle((1, 0, 0), (0, 1, 0), (0, 0, 1), 8)])
    count, screen = len(triangles), np.arange(len(triangles)) >= len(room)
    chance = np.random.default_rng(6)
    reflectance, opacity = patterned(32), chance.random((32, 32))
    values = np.concatenate(
        [image(32, reflectance, 3 - 3 * reflectance), image(32, reflectance, 3 - 3 * reflectance, opacity)]
    )
    # Each triangle shows a patch of its own, the screen's in the upper half of the image.
    corner = np.stack(
        [chance.uniform(0.05, 0.85, count), chance.uniform(0.05, 0.38, count) + 0.5 * screen], 1
    )
    uv = corner[:, None] + QUAD_UV[0] * (0.1, 0.05)
    images = SurfaceImages(values, uv, np.ones(count, bool))
    scene = gray_scene(triangles, 0, two_sided=screen, images=images)
    solution = solve(scene)
    assert solution.report["closure_area_mean"] == pytest.approx(1.0, abs=0.01)
    power = solution.report["power_W"]
    assert power["absorbed"] == pytest.approx(power["emitted"], rel=0.01)
    np.testing.assert_allclose(solution.triangle_irradiance, 3.0, rtol=0.08)
    np.testing.assert_allclose(scene.areas @ solution.triangle_irradiance / scene.areas.sum(), 3.0, rtol=0.01)


@pytest.mark.parametrize("method", ["conjugate-gradient", "shooting", "two-level"])
def test_a_screen_does_not_disturb_the_furnace_by_any_method(method: str) -> None:
    scene = furnace(3.0, 0.5)
    solution = solve(scene, SolverSettings(method=method, elements=150, patches=60, tolerance=1e-4))
    power = solution.report["power_W"]
    assert power["absorbed"] + power["escaped"] == pytest.approx(power["emitted"], rel=0.02)
    np.testing.assert_allclose(scene.areas @ solution.triangle_irradiance / scene.areas.sum(), 3.0, rtol=0.02)


def under_a_screen(opacity: float, light: PointLight) -> Scene:
    """A floor, and a screen between it and a lamp."""
    triangles = np.concatenate(
        [rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0)), rectangle((-9, -9, 1), (18, 0, 0), (0, 18, 0))]
    )
    images = SurfaceImages(
        image(4, 0.0, 0.0, opacity), np.tile(QUAD_UV, (2, 1, 1)), np.array([False, False, True, True])
    )
    return gray_scene(triangles, two_sided=True, lights=[light], images=images)


@pytest.mark.parametrize("opacity", [0.0, 0.25, 0.5, 1.0])
def test_a_veil_lets_its_part_through(opacity: float) -> None:
    """E = (1 − α) I cos³θ / h²: in the elements' means and at points."""
    light = PointLight((0, 0, 2), 100.0)
    solution = solve(under_a_screen(opacity, light))
    clear = solve(under_a_screen(0.0, light))
    np.testing.assert_allclose(
        solution.triangle_irradiance[:2], (1 - opacity) * clear.triangle_irradiance[:2], rtol=0.02, atol=1e-9
    )
    points = np.stack([*np.random.default_rng(1).uniform(-0.9, 0.9, (2, 60)), np.zeros(60)], axis=1)
    up = np.tile([0, 0, 1.0], (60, 1))
    expected = (1 - opacity) * 100.0 * light.unit_irradiance(points, up)
    found = solution.irradiance(points, up)[:, 0]
    np.testing.assert_allclose(found, expected, rtol=0.12, atol=1e-9)
    np.testing.assert_allclose(found.mean(), expected.mean(), rtol=0.01, atol=1e-9)


def test_emission_of_an_image_is_that_of_many_small_emitters() -> None:
    """A ceiling of 4 × 4 fields, from an image and as geometry: the same light on the floor."""
    room, surface = box_room((2, 2, 1))
    kept = room[surface != CEILING]
    fields = np.random.default_rng(3).random((4, 4, 3)) ** 4 * 20.0
    cut = np.concatenate([kept, rectangle((0, 0, 1), (0, 2, 0), (2, 0, 0), 4)])
    # rectangle's grid runs over edge_u first; each field has a triangle in both halves.
    of_fields = np.tile(fields.reshape(-1, 3), (2, 1))
    emission = np.concatenate([gray(len(kept), 0), of_fields])
    reference = solve(gray_scene(cut, 0.5, emission))

    # The image's u runs along edge_u, y in the world; so rows are fields along v.
    values = image(64, 0.5)
    values[..., 3:6] = fields.swapaxes(0, 1).repeat(16, 0).repeat(16, 1)
    whole = np.concatenate([kept, rectangle((0, 0, 1), (0, 2, 0), (2, 0, 0))])
    uv = np.concatenate([np.zeros((len(kept), 3, 2)), QUAD_UV])
    images = SurfaceImages(values, uv, np.arange(len(whole)) >= len(kept))
    textured = solve(gray_scene(whole, images=images))

    np.testing.assert_allclose(textured.triangle_irradiance[:2], reference.triangle_irradiance[:2], rtol=0.01)
    emitted = reference.report["power_W"]["emitted"]
    assert textured.report["power_W"]["emitted"] == pytest.approx(emitted, rel=0.002)
    assert textured.report["power_W"]["absorbed"] == pytest.approx(emitted, rel=0.005)
    points = np.random.default_rng(4).uniform(0.1, 1.9, (40, 3)) * (1, 1, 0)
    up = np.tile([0, 0, 1.0], (40, 1))
    at = Footprints(points, up, np.arange(40))
    direct, exact = (solution.local_pass.direct.at(at) for solution in (textured, reference))
    np.testing.assert_allclose(direct, exact, rtol=0.03)
    assert np.sqrt(((direct / exact - 1) ** 2).mean()) < 0.01


def test_a_bright_spot_in_an_image_of_emission_converges() -> None:
    """A small bright square of a dark image over a floor: the elements find it as they are refined."""
    floor = rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0))
    above = rectangle((-1, -1, 0.5), (0, 2, 0), (2, 0, 0))
    values = image(32)
    values[20:24, 8:12, 3:6] = 100.0
    images = SurfaceImages(
        values, np.concatenate([0 * QUAD_UV, QUAD_UV]), np.array([False, False, True, True])
    )
    scene = gray_scene(np.concatenate([floor, above]), 0, images=images)
    # u runs along y, v along x.
    spot = np.array([[0.25, -0.5, 0.5], [0.25, -0.25, 0.5], [0.5, -0.25, 0.5], [0.5, -0.5, 0.5]])
    steps = (np.arange(64) + 0.5) / 32 - 1
    points = np.stack([*np.meshgrid(steps, steps, indexing="ij"), np.zeros((64, 64))], axis=-1).reshape(-1, 3)
    up = np.tile([0, 0, 1.0], (len(points), 1))
    exact = 100.0 * sum(
        point_to_polygon(points, up, np.tile(half, (len(points), 1, 1)))
        for half in (spot[:3], spot[[0, 2, 3]])
    )
    weights = (points[:, :2] + 1) / 2
    lower = weights[:, 1] <= weights[:, 0]
    barycentric = np.where(
        lower[:, None],
        np.stack([weights[:, 0] - weights[:, 1], weights[:, 1]], 1),
        np.stack([weights[:, 0], weights[:, 1] - weights[:, 0]], 1),
    )
    errors = []
    for error in (1e-3, 1e-4, 1e-5):
        local = solve(scene, SolverSettings(error=error)).local_pass
        found = local.elements.irradiance_at(np.where(lower, 0, 1), barycentric)
        errors.append(float(np.sqrt(((found - exact) ** 2).mean() / (exact**2).mean())))
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > 2 * errors[2]
    assert errors[2] < 0.05
    direct = solve(scene).local_pass.direct.at(Footprints(points, up, np.arange(len(points))))[:, 0]
    assert np.sqrt(((direct - exact) ** 2).mean() / (exact**2).mean()) < 0.03


def test_threads_change_nothing_behind_a_veil() -> None:
    scene = furnace(3.0, np.random.default_rng(0).random((32, 32)))
    one, two = (solve(scene, SolverSettings(threads=threads, error=1e-3)) for threads in (1, 2))
    assert one.triangle_radiosity.tobytes() == two.triangle_radiosity.tobytes()
    points, up = np.full((5, 3), 0.3) * (1, 1, 0), np.tile([0, 0, 1.0], (5, 1))
    assert one.irradiance(points, up).tobytes() == two.irradiance(points, up).tobytes()


def test_patterns_reflect_their_own_colors() -> None:
    """Under uniform light every element's radiosity is the mean of its own part of the image."""
    assert patterned().max() <= 0.95
    scene = furnace(1.0)
    hierarchy = solved(scene).hierarchy
    leaves = hierarchy.leaves
    assert hierarchy.level[leaves].max() > 0
    total = hierarchy.area[leaves] @ hierarchy.reflectance[leaves]
    np.testing.assert_allclose(total / scene.areas.sum(), patterned().mean(axis=(0, 1)), rtol=0.01)
    np.testing.assert_allclose(hierarchy.emission, 1.0 - hierarchy.reflectance, atol=1e-6)
