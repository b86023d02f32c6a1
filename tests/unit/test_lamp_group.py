"""Many lamps as one: the same light, and rays that measure it without bias."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake import pipeline
from radiosity_addon.bake.pipeline import bake
from radiosity_addon.lights import AreaLight, Lamp, LampGroup, PointLight, SpotLight, grouped
from radiosity_addon.numerics import stratified_square
from radiosity_addon.options import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import Scene
from tests.unit.texel_scenes import bake_scene

COLOR = np.array([1.0, 0.9, 0.7])


def lamp_of_kind(kind: int, random: np.random.Generator) -> Lamp:
    place, power = random.uniform([0, 0, 2], [6, 5, 3]), random.uniform(0.5, 2.0) * COLOR
    down = random.normal(size=3) - [0, 0, 3]
    return [
        lambda: PointLight(place, power, 0.03),
        lambda: PointLight(place, power, 0.05, soft_falloff=False),
        lambda: SpotLight(place, down, power, 1.2, blend=0.4, radius=0.04),
        lambda: SpotLight(place, down, power, 0.8, blend=0.0),
        lambda: SpotLight(place, down, power, 1.0, round_from_world=np.diag([1.0, 0.6, 1.0])),
        lambda: AreaLight(place, (0.1, 0.05, 0), (0, -0.2, 0.1), power, shape="ellipse"),
        lambda: AreaLight(place, (0.3, 0, 0), (0, -0.2, 0), power),
        lambda: AreaLight(place, (0.3, 0, 0), (0, -0.2, 0), power, spread=1.0),
    ][kind]()


def lamps(count: int, kinds: range = range(8)) -> list[Lamp]:
    random = np.random.default_rng(3)
    return [lamp_of_kind(kinds[number % len(kinds)], random) for number in range(count)]


def one_group(members: list[Lamp]) -> LampGroup:
    (group,) = grouped(members, most=2)
    assert isinstance(group, LampGroup)
    return group


def places(count: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(5)
    normals = random.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return random.uniform([0, 0, 0], [6, 5, 3], (count, 3)), normals


def sum_of(members: list[Lamp], points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    return sum(lamp.unit_irradiance(points, normals) * lamp.strength.mean() for lamp in members)


def test_a_group_gives_what_its_lamps_give() -> None:
    members, at = lamps(80), places(500)
    group, expected = one_group(members), sum_of(members, *at)
    np.testing.assert_allclose(group.unit_irradiance(*at) * group.strength.mean(), expected, rtol=0.01)
    np.testing.assert_allclose(group.strength, sum(lamp.strength for lamp in members))
    np.testing.assert_allclose(group.flux, sum(lamp.flux for lamp in members))


@pytest.mark.parametrize("kind", range(8))
def test_rays_to_lamps_of_each_kind_add_up_to_their_light(kind: int) -> None:
    members, (points, normals) = lamps(12, range(kind, kind + 1)), places(100)
    group = one_group(members)
    unit = stratified_square(np.arange(len(points)), 1024, 1)
    found = group.shadow_rays(points, normals, unit)[2].sum(axis=1)
    spread = group.rays_from(np.broadcast_to(points[:, None], (*unit.shape[:2], 3)), normals, unit)[2]
    expected = group.unit_irradiance(points, normals)
    # Points inside of a beam's edge have few rays that count.
    for sums in (found, spread.sum(axis=1)):
        assert np.mean(sums) == pytest.approx(np.mean(expected), rel=0.01)
        assert np.sqrt(np.mean((sums - expected) ** 2)) < 0.08 * np.mean(expected)


def test_rays_that_correct_what_was_learned_are_unbiased_whatever_that_was() -> None:
    """Of lamps of which each other one is hidden, by a guess of each that is wrong."""
    members, (points, normals) = lamps(40, range(1)), places(200)
    group = one_group(members)
    free = np.arange(40) % 2
    guess = np.broadcast_to(np.linspace(0.1, 0.9, 40), (len(points), 40))
    unit = stratified_square(np.arange(len(points)), 256, 1)
    _, lamp = group.chosen_rays(points, normals, unit)
    first = group.shadow_rays(points, normals, unit)
    aimed = group.learned_rays(points, normals, unit, guess)
    # Which lamp a ray goes to shows in how much of it is taken to be seen.
    to = np.rint((aimed.known - 0.1) / 0.8 * 39).astype(int)
    wrong = np.where(aimed.near, free[to], free[to] - aimed.known)
    far = ~aimed.near
    measured = (aimed.base + (aimed.rays[2] * wrong * far).sum(axis=1)).mean()
    expected = (first[2] * free[lamp]).sum(axis=1).mean()
    assert measured == pytest.approx(expected, rel=0.01)


def test_rays_leave_lamps_by_their_power() -> None:
    members = lamps(40)
    group = one_group(members)
    place, way = (stratified_square(np.zeros(1, int), 1 << 14, seed)[0] for seed in (1, 2))
    origins, directions, shares = group.emit(place, way)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-6)
    apart = np.array([np.linalg.norm(origins - lamp.position, axis=1) for lamp in members])
    sent = np.bincount(apart.argmin(axis=0), shares, len(members)) / shares.sum()
    np.testing.assert_allclose(sent, [lamp.flux.sum() / group.flux.sum() for lamp in members], atol=2e-3)


def test_few_lamps_stay_and_many_colors_are_channels() -> None:
    few = lamps(10)
    assert all(one is other for one, other in zip(grouped(few, most=10), few, strict=True))
    random = np.random.default_rng(1)
    colored = [PointLight(random.uniform(0, 3, 3), random.uniform(0, 1, 3)) for _ in range(40)]
    groups = grouped(colored, most=10)
    assert [np.count_nonzero(group.strength) for group in groups] == [1, 1, 1]
    np.testing.assert_allclose(
        sum(group.strength for group in groups), sum(lamp.strength for lamp in colored)
    )
    at = places(50)
    found = sum(group.unit_irradiance(*at)[:, None] * group.strength for group in groups)
    expected = sum(lamp.unit_irradiance(*at)[:, None] * lamp.strength for lamp in colored)
    np.testing.assert_allclose(found, expected, rtol=1e-4)
    shadowless = PointLight((0, 0, 1), COLOR, casts_shadow=False)
    both = grouped([*few, shadowless, shadowless], most=10)
    assert sorted(group.casts_shadow for group in both) == [False, True]


def quad(corner: tuple, u: tuple, v: tuple) -> np.ndarray:
    corner, u, v = (np.array(each, dtype=float) for each in (corner, u, v))
    return np.array([[corner, corner + u, corner + u + v], [corner, corner + u + v, corner + v]])


def lit_floor(count: int) -> BakeScene:
    """A floor below lamps, of which a wall hides about half from each side, and a table some."""
    parts = [
        quad((0, 0, 0), (6, 0, 0), (0, 5, 0)),
        quad((3, 0.5, 0), (0, 4, 0), (0, 0, 3)),
        quad((1, 1, 0.8), (1, 0, 0), (0, 1.5, 0)),
    ]
    triangles = np.concatenate(parts)
    gray = np.full((6, 3), 0.3)
    scene = Scene(triangles, gray, np.zeros((6, 3)), two_sided=True, lights=lamps(count, range(1)))
    return bake_scene(scene, ("Floor", 2), ("Wall", 2), ("Table", 2))


def pixels(scene: BakeScene, threads: int = 1) -> np.ndarray:
    settings = BakeSettings(resolution=64, quality="draft", threads=threads)
    return bake(scene, settings).pages[0].pixels[..., :3].astype(float)


def test_many_lamps_light_a_floor_as_they_do_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = lit_floor(150)
    together = pixels(scene)
    monkeypatch.setattr(pipeline, "LAMPS_PER_RAY", 1000)
    apart = pixels(scene)
    assert (together != apart).any()
    mean = apart.mean()
    assert together.mean() == pytest.approx(mean, rel=2e-3)
    assert np.sqrt(np.mean((together - apart) ** 2)) < 0.02 * mean


def test_many_lamps_give_the_same_bytes_with_any_number_of_threads() -> None:
    scene = lit_floor(150)
    assert pixels(scene, threads=1).tobytes() == pixels(scene, threads=3).tobytes()
