"""Skies that differ by direction: what a plane receives, patches against sums, and turning."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lights.environment import (
    SKY_CELLS,
    EnvironmentImage,
    SkyPatch,
    bright_patches,
    cell_directions,
    cell_of,
    even_part,
    pixel_bounds,
    solid_angles,
)
from radiosity_addon.lights.sun_and_sky import EnvironmentLight, Light
from radiosity_addon.numerics.sampling import stratified_square
from radiosity_addon.solver import SolverSettings, solve
from tests.rooms import gray_scene, rectangle

SHAPE = (128, 256)


def a_sky() -> np.ndarray:
    """A colored sky with a bright sun, a window, and dark ground."""
    rng = np.random.default_rng(3)
    pixels = 0.2 + 0.1 * rng.random((*SHAPE, 3))
    pixels[64:] += (0.2, 0.4, 0.8)
    pixels[100:102, 30:33] = (900.0, 700.0, 500.0)
    pixels[80:92, 180:195] = (9.0, 4.0, 2.0)
    return pixels * (1.0 + 0.1 * rng.random((*SHAPE, 1)))  # no two pixels are equally bright


def lights_of(pixels: np.ndarray) -> list[Light]:
    excess, patches = bright_patches(pixels)
    bounds = pixel_bounds(SHAPE)
    lights: list[Light] = list(even_part(pixels - excess.reshape(pixels.shape)))
    for rows in patches:
        power = excess[rows] * solid_angles(bounds[rows])[:, None]
        lights.append(SkyPatch(power.sum(axis=0), bounds[rows], power.mean(axis=1)))
    return lights


def received(pixels: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """∫ L cosθ dω, pixel by pixel."""
    bounds = pixel_bounds(SHAPE)
    cosines = np.maximum(cell_directions(SHAPE) @ normal, 0.0)
    return (cosines * solid_angles(bounds)) @ pixels.reshape(-1, 3)


def test_cells_cover_the_sphere_and_know_their_directions() -> None:
    assert solid_angles(pixel_bounds(SHAPE)).sum() == pytest.approx(4 * np.pi, rel=1e-12)
    np.testing.assert_array_equal(cell_of(cell_directions(SHAPE), SHAPE), np.arange(SHAPE[0] * SHAPE[1]))
    # As in an equirectangular picture: +x in the middle, +y a quarter to the left, +z on top.
    ways = np.array([(1, -1e-9, 0.001), (0, 1, 0.001), (-1, 1e-9, 0.001), (0, 0, 1.0)])
    rows, columns = np.divmod(cell_of(ways, SHAPE), SHAPE[1])
    assert rows.tolist() == [64, 64, 64, 127]
    assert columns[:3].tolist() == [128, 64, 0]


@pytest.mark.parametrize("normal", [(0, 0, 1.0), (0.6, 0, 0.8), (0, -1.0, 0), (0, 0, -1.0)])
def test_parts_and_patches_add_up_to_the_sky(normal: tuple[float, float, float]) -> None:
    pixels, facing = a_sky(), np.array(normal)
    lights = lights_of(pixels)
    total = np.zeros(3)
    for light in lights:
        if isinstance(light, SkyPatch):
            total += light.unit_irradiance(np.zeros((1, 3)), facing[None])[0] * light.strength
        else:
            assert isinstance(light, EnvironmentImage)
            toward, angle = cell_directions(SKY_CELLS), solid_angles(pixel_bounds(SKY_CELLS))
            share = light.relative(toward) * np.maximum(toward @ facing, 0.0)
            total += light.strength * float(share @ angle)
    assert sum(isinstance(light, SkyPatch) for light in lights) >= 2
    np.testing.assert_allclose(total, received(pixels, facing), rtol=2e-3)


def test_a_plane_under_the_sky_receives_all_of_it() -> None:
    """Through the solver's own rays: ∫ L cosθ dω to 0.5 %."""
    plane = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    pixels = a_sky()
    scene = gray_scene(plane, 0.0, lights=lights_of(pixels))
    points = np.stack([*np.random.default_rng(0).uniform(0.1, 0.9, (2, 64)), np.zeros(64)], axis=1)
    up = np.broadcast_to([0, 0, 1.0], (64, 3))
    solution = solve(scene, SolverSettings(error=1e-2))
    expected = received(pixels, np.array([0, 0, 1.0]))
    np.testing.assert_allclose(solution.irradiance(points, up).mean(axis=0), expected, rtol=5e-3)


@pytest.mark.parametrize("quarter", [1, 2, 3])
def test_a_turned_sky_turns_its_light(quarter: int) -> None:
    pixels = a_sky()
    turned = np.roll(pixels, -quarter * SHAPE[1] // 4, axis=1)  # azimuths grow to the left
    before, after = (
        [light for light in lights_of(sky) if isinstance(light, SkyPatch)] for sky in (pixels, turned)
    )
    cosine, sine = np.cos(quarter * np.pi / 2), np.sin(quarter * np.pi / 2)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    for one, other in zip(before, after, strict=True):
        np.testing.assert_allclose(other.direction, turn @ one.direction, atol=1e-9)
        np.testing.assert_allclose(other.strength, one.strength, rtol=1e-9)


def test_rays_to_a_patch_integrate_to_its_irradiance() -> None:
    patch = next(light for light in lights_of(a_sky()) if isinstance(light, SkyPatch))
    normals = np.array([(0, 0, 1.0), -patch.direction, (1.0, 0, 0)])
    u = stratified_square(np.arange(3), 4096)
    directions, distances, weights = patch.shadow_rays(np.zeros((3, 3)), normals, u)
    np.testing.assert_allclose(
        weights.sum(axis=1), patch.unit_irradiance(np.zeros((3, 3)), normals), rtol=1e-3
    )
    np.testing.assert_allclose(np.linalg.norm(directions, axis=2), 1.0, rtol=1e-12)
    assert np.isinf(distances).all()


def test_an_even_sky_is_one_light_and_a_gray_one_too() -> None:
    (plain,) = even_part(np.broadcast_to((0.2, 0.3, 0.4), (*SHAPE, 3)))
    assert type(plain) is EnvironmentLight
    np.testing.assert_allclose(plain.strength, (0.2, 0.3, 0.4), rtol=1e-12)
    ramp = np.broadcast_to(np.linspace(0, 1, SHAPE[0])[:, None, None], (*SHAPE, 3))
    assert len(even_part(ramp)) == 1
    assert even_part(np.zeros((*SHAPE, 3))) == []
