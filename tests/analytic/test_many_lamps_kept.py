"""Kept bakes of many lamps: relit for any lamp alone they are near a full bake, for few rays of each."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.bake import pipeline
from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.rebaking import bake_moved
from radiosity_addon.bake.relight.kept_bake import KeptBake, estimated_errors, noise_warnings, relight_pages
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.bake.sidecar.sidecar import read_sidecar, write_sidecar
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import AreaLight, PointLight, Scene
from radiosity_addon.solver.gather.light_gains import CompactGains, LightGains
from radiosity_addon.solver.gather.run_gains import MOST_RUNS, RunGains
from tests.moved_rooms import laid_out_as
from tests.rooms import box_room, gray, rectangle, solid_box
from tests.unit.texel_scenes import bake_scene

SETTINGS = BakeSettings(resolution=64, quality="draft", threads=1)
SIZE = (4.0, 3.0, 2.5)
POWER = 60.0


def lamps(count: int) -> list[PointLight | AreaLight]:
    """Bulbs and squares in turn, spread over a plane below the ceiling, of `POWER` together."""
    random = np.random.default_rng(2)
    places = random.uniform((0.3, 0.3, 2.0), (3.7, 2.7, 2.1), (count, 3))
    power = np.full(3, POWER / count)
    return [
        PointLight(place, power, 0.03, name=f"Bulb {number}")
        if number % 2
        else AreaLight(place, (0.05, 0, 0), (0, -0.05, 0), power, name=f"Square {number}")
        for number, place in enumerate(places)
    ]


def room(count: int, box: float = 1.0, strengths: np.ndarray | None = None) -> BakeScene:
    """A closed room with a wall in it, a box at x = `box`, and lamps, of (count,) parts of their power."""
    walls, _ = box_room(SIZE)
    parts = [walls, rectangle((2.0, 0.6, 0.0), (0, 1.8, 0), (0, 0, 1.8))]
    parts.append(solid_box((box, 1.0, 0.0), (box + 0.5, 1.5, 0.7)))
    triangles = np.concatenate(parts)
    lit = lamps(count)
    if strengths is not None:
        lit = [replace(lamp, power=lamp.power * part) for lamp, part in zip(lit, strengths, strict=True)]
    scene = Scene(triangles, gray(len(triangles), 0.5), gray(len(triangles), 0.0), two_sided=True, lights=lit)
    return bake_scene(scene, ("Room", 12), ("Wall", 2), ("Box", 12))


def pixels(result: BakeResult) -> np.ndarray:
    return np.asarray(result.pages[0].pixels[..., :3], dtype=np.float64)


def relit(kept: KeptBake, parts: np.ndarray) -> np.ndarray:
    wanted = kept.strengths * parts[:, None]
    return np.asarray(relight_pages(kept, wanted)[0].pixels[..., :3], dtype=np.float64)


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.sqrt(((found - expected) ** 2).mean()) / expected.mean())


@pytest.fixture(scope="module")
def baked() -> tuple[BakeResult, KeptBake]:
    return bake_and_keep(room(100), SETTINGS)


def only(lamp: int) -> np.ndarray:
    parts = np.zeros(100)
    parts[lamp] = 1.0
    return parts


def mixed() -> np.ndarray:
    """Lamps that are off, as they were, and ten times as strong."""
    return np.random.default_rng(7).choice([0.0, 1.0, 10.0], 100)


@pytest.mark.parametrize("parts", [only(10), only(43), only(78), mixed()])
def test_any_strengths_are_within_a_percent_of_a_full_bake(
    baked: tuple[BakeResult, KeptBake], parts: np.ndarray
) -> None:
    """Beyond what full bakes of two seeds differ by."""
    found = relit(baked[1], parts)
    full, other = (pixels(bake(room(100, strengths=parts), replace(SETTINGS, seed=seed))) for seed in (0, 7))
    assert relative(found, full) < relative(other, full) + 0.01
    assert found.mean() == pytest.approx(full.mean(), rel=0.01)


def test_the_bake_is_what_a_plain_one_gives(baked: tuple[BakeResult, KeptBake]) -> None:
    plain, other = (pixels(bake(room(100), replace(SETTINGS, seed=seed))) for seed in (0, 7))
    assert relative(pixels(baked[0]), plain) < relative(other, plain) + 0.01
    assert relative(relit(baked[1], np.ones(100)), pixels(baked[0])) < 1e-3


def test_direct_light_is_the_sum_over_lamps(baked: tuple[BakeResult, KeptBake]) -> None:
    kept = baked[1]
    assert isinstance(kept.lit.gains, CompactGains)
    for gains in (kept.lit.gains, *(of.gains for of in kept.lit.transport.cells.links)):
        assert gains is not None
        whole = gains.irradiance(kept.strengths)
        each = sum(gains.of(lamp)[:, None] * kept.strengths[lamp] for lamp in range(100))
        np.testing.assert_allclose(whole, each, rtol=1e-4, atol=1e-4 * whole.mean())


def test_rays_and_links_hardly_grow_with_the_number_of_lamps() -> None:
    """Of four times as many lamps: no links, and of a cell a byte for each run of lamps."""
    few, many = (bake_and_keep(room(count), replace(SETTINGS, resolution=32))[1] for count in (150, 600))
    rays = [kept.solved.local.caster.rays for kept in (few, many)]
    assert rays[1] < 1.5 * rays[0]
    for kept in (few, many):
        assert len(kept.solved.elements.light_links) == 0
        for cells in kept.lit.transport.cells.links:
            assert isinstance(cells.gains, RunGains)
            assert cells.gains.seen.shape == (len(cells.rows), min(16 * cells.sources.shape[1], MOST_RUNS))


def test_lamps_that_are_few_keep_all_their_rays() -> None:
    kept = bake_and_keep(room(20), SETTINGS)[1]
    assert type(kept.lit.gains) is LightGains
    assert np.bincount(kept.solved.elements.light_links.light, minlength=20).all()


def test_a_lamp_that_was_dark_can_be_lit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline, "LAMPS_PER_RAY", 2)
    parts = np.ones(12)
    parts[[3, 8]] = 0.0
    kept = bake_and_keep(room(12, strengths=parts), SETTINGS)[1]
    wanted = np.full((12, 3), POWER / 12)
    found = np.asarray(relight_pages(kept, wanted)[0].pixels[..., :3], dtype=np.float64)
    full, other = (pixels(bake(room(12), replace(SETTINGS, seed=seed))) for seed in (0, 7))
    assert relative(found, full) < relative(other, full) + 0.01


def test_a_sidecar_gives_the_same(baked: tuple[BakeResult, KeptBake], tmp_path: Path) -> None:
    result, kept = baked
    write_sidecar(tmp_path / "a.relight", kept, result, "name")
    read = read_sidecar(tmp_path / "a.relight").kept(kept.bake_scene)
    parts = only(31)
    fresh = replace(kept, lit=replace(kept.lit, warm_start=kept.lit.warm_start.first()))
    np.testing.assert_array_equal(relit(read, parts), relit(fresh, parts))


def test_a_box_that_moved_is_as_in_a_full_bake(baked: tuple[BakeResult, KeptBake]) -> None:
    kept, scene = baked[1], room(100, box=2.6)
    moved, after = bake_moved(kept, scene)
    full = pixels(bake(laid_out_as(scene, kept.geometry.uv), SETTINGS))
    assert relative(pixels(baked[0]), full) > 0.1
    assert relative(pixels(moved), full) < 0.04
    back, _ = bake_moved(after, room(100))
    assert relative(pixels(back), pixels(baked[0])) < 0.04


def test_light_that_rays_were_not_aimed_at_causes_a_warning() -> None:
    """A bulb next to the ceiling, most of whose light comes from a spot that was dark in the bake."""
    scene = room(1)
    bulb = PointLight((1.0, 1.0, 2.45), np.zeros(3), 0.02, name="Bulb")
    scene = replace(scene, scene=scene.scene.with_lights([*scene.scene.lights, bulb]))
    kept = bake_and_keep(scene, SETTINGS)[1]
    assert noise_warnings(*estimated_errors(kept, kept.strengths)) == ()
    wanted = np.array([(0.0, 0.0, 0.0), (POWER, POWER, POWER)])
    relight_pages(kept, wanted)
    (warning,) = noise_warnings(*estimated_errors(kept, wanted))
    assert "bake again" in warning.message


def test_so_many_lamps_that_they_share_rays_cause_a_note(baked: tuple[BakeResult, KeptBake]) -> None:
    notes = [warning for warning in bake_and_keep(room(150), SETTINGS)[0].warnings if warning.is_note]
    assert any("150 lamps" in note.message for note in notes)
    assert not any("100 lamps" in warning.message for warning in baked[0].warnings)


def test_scenes_are_not_changed() -> None:
    scene = room(100)
    before = copy(scene.scene).lights
    bake_and_keep(scene, SETTINGS)
    assert scene.scene.lights == before
