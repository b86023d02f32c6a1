"""Bakes of a room with glass: no texels on it, kept bakes, light groups and moves as without."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.rebaking import bake_moved
from radiosity_addon.bake.relight.kept_bake import KeptBake, relight_pages
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.bake.scene_diff import Part, compare, scene_record
from radiosity_addon.bake.sidecar.sidecar import read_sidecar, write_sidecar
from radiosity_addon.lightmap.points import smoothing
from radiosity_addon.lightmap.transport import ray_runs
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from tests.glass_rooms import SCREEN_COLOR, glazed_room, painted_boxes
from tests.relit_rooms import BAKED, CHANGED
from tests.unit.texel_scenes import bake_scene

SETTINGS = BakeSettings(resolution=64, quality="draft")

BOX = slice(16, 28)
"""The triangles of the box."""


@pytest.fixture(scope="module", autouse=True)
def _noise_is_not_shared() -> Iterator[None]:
    """How noise is shared, and where rays go, depends on the light of the bake (`test_relit_noise.py`)."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(smoothing, "PASSES", ())
        patch.setattr(ray_runs, "EVEN", 1.0)
        yield


@pytest.fixture(scope="module")
def room() -> tuple[BakeResult, KeptBake]:
    return bake_and_keep(glazed_room(), SETTINGS)


def pixels(result: BakeResult) -> np.ndarray:
    return np.asarray(result.pages[0].pixels[result.pages[0].coverage], dtype=np.float64)


def relit(kept: KeptBake, strengths: np.ndarray) -> np.ndarray:
    (page,) = relight_pages(kept, strengths)
    return np.asarray(page.pixels[page.coverage], dtype=np.float64)


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    """Root mean square of the difference, relative to the mean."""
    return float(np.sqrt(((found - expected) ** 2).mean()) / expected.mean())


def test_glass_gets_no_texels(room: tuple[BakeResult, KeptBake]) -> None:
    """Of the room all but the window does, the screen has no lightmap."""
    result, kept = room
    assert [item.object.name for item in result.objects] == ["Room", "Panel", "Sign", "Box"]
    counts = kept.geometry.counts
    assert not counts[10:12].any()
    assert not counts[-2:].any()
    assert (counts[:10] > 0).all()
    assert result.solver["glass"] == ["Room", "Screen"]


def test_the_result_does_not_depend_on_threads(room: tuple[BakeResult, KeptBake]) -> None:
    result, _ = room
    again, _ = bake_and_keep(glazed_room(), replace(SETTINGS, threads=1))
    np.testing.assert_array_equal(again.pages[0].pixels, result.pages[0].pixels)


@pytest.mark.parametrize("strengths", [CHANGED, BAKED * (np.arange(len(BAKED)) == 2)[:, None]])
def test_relit_as_a_full_bake_without_a_ray(room: tuple[BakeResult, KeptBake], strengths: np.ndarray) -> None:
    _, kept = room
    before = kept.solved.local.caster.rays
    found = relit(kept, strengths)
    assert kept.solved.local.caster.rays == before
    assert relative(found, pixels(bake(glazed_room(strengths), SETTINGS))) < 0.01


def test_lights_add_up(room: tuple[BakeResult, KeptBake]) -> None:
    """As light groups do."""
    _, kept = room
    parts = [relit(kept, BAKED * (np.arange(len(BAKED)) == row)[:, None]) for row in range(len(BAKED))]
    assert relative(np.sum(parts, axis=0), relit(kept, BAKED)) < 1e-3


def test_a_sidecar_relights_to_the_last_bit(room: tuple[BakeResult, KeptBake], tmp_path: Path) -> None:
    result, kept = room
    write_sidecar(tmp_path / "room.relight", kept, result, "mark")
    fresh = replace(kept, lit=replace(kept.lit, warm_start=kept.lit.warm_start.first()))
    again = read_sidecar(tmp_path / "room.relight").kept(glazed_room())
    np.testing.assert_array_equal(relit(again, CHANGED), relit(fresh, CHANGED))


@pytest.mark.parametrize("boxes", [(0.3,), (0.3, 0.2)], ids=["one box", "two boxes"])
def test_sweeps_converge_where_paint_and_glass_are_added(boxes: tuple[float, ...]) -> None:
    """Under a sky of radiance 1 no irradiance exceeds π, up to the noise of tinted rays.

    Before reflectance was bounded by what passes, blue grew with each sweep between two boxes.
    """
    scene = painted_boxes(*boxes)
    parts = ("Floor", 2), ("Boxes", len(scene) - 2)
    settings = replace(SETTINGS, resolution=16, quality="medium", quantity="irradiance")
    found = pixels(bake(bake_scene(scene, *parts), settings))
    assert found.max() < 1.2 * np.pi
    assert found.mean(axis=0).max() < np.pi


def test_a_sidecar_of_rays_through_many_painted_panes_is_read(tmp_path: Path) -> None:
    """Red passes each surface by a chance of a sixth and with three times its light."""
    scene = painted_boxes(
        *0.04 + 0.03 * np.arange(8), passes=np.array([0.5, 0.0, 0.0]), reflectance=np.full(3, 0.5)
    )
    baked = bake_scene(scene, ("Floor", 2), ("Boxes", len(scene) - 2))
    result, kept = bake_and_keep(baked, replace(SETTINGS, resolution=16))
    tints = kept.lit.transport.links.tints
    assert tints is not None
    assert tints.max() == 3.0**4
    write_sidecar(tmp_path / "boxes.relight", kept, result, "mark")
    again = read_sidecar(tmp_path / "boxes.relight").kept(baked)
    np.testing.assert_array_equal(again.lit.transport.links.tints, tints)


def moved_room(by: float, uv: np.ndarray | None = None) -> BakeScene:
    """The room with its box elsewhere, laid out as an earlier bake."""
    scene = glazed_room()
    scene.scene.triangles[BOX] += (by, 0.0, 0.0)
    if uv is not None:
        objects = tuple(replace(item, uv=uv[item.rows]) for item in scene.objects)
        return replace(scene, objects=objects)
    return scene


def test_after_a_move_as_a_full_bake(room: tuple[BakeResult, KeptBake]) -> None:
    """The box moves from one side of the screen to the other."""
    _, kept = room
    result, after = bake_moved(kept, moved_room(0.7))
    uv = kept.geometry.uv
    full = bake(moved_room(0.7, uv), SETTINGS)
    other = bake(moved_room(0.7, uv), replace(SETTINGS, seed=7))
    assert relative(pixels(result), pixels(full)) < 1.2 * relative(pixels(other), pixels(full))
    assert relative(relit(after, CHANGED), relit(kept, CHANGED)) > 0.01


def test_another_color_is_another_surface() -> None:
    before, now = (scene_record(glazed_room(screen=color)) for color in (SCREEN_COLOR, SCREEN_COLOR[::-1]))
    assert compare(before, scene_record(glazed_room())).parts == set()
    assert compare(before, now)[Part.SURFACE] == ("Screen",)
