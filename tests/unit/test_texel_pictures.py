"""Pictures of a lightmap in the making: nearer to the result the later they come, and no part of it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.bake.result import texel_pictures
from radiosity_addon.bake.result.pictures import TexelPicture
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.bake.result.texel_pictures import TexelPictures, coarser
from radiosity_addon.base.progress import Status
from radiosity_addon.lightmap.texels.states import ENCLOSED, NO_TEXEL_HERE
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import PointLight
from tests.rooms import box_room, gray_scene, solid_box
from tests.unit.texel_scenes import bake_scene
from tests.watched import noting

SETTINGS = BakeSettings(quality="draft", resolution=48, quantity="radiosity", threads=1)


def room() -> BakeScene:
    """A room with a box that stands on its floor, lit by two lamps."""
    walls, _ = box_room((2, 2, 1.5))
    triangles = np.concatenate([walls, solid_box((0.8, 0.8, 0.0), (1.3, 1.2, 0.6))])
    lamps = [PointLight((0.4, 0.5, 1.2), (8.0, 6.0, 3.0)), PointLight((1.6, 1.7, 1.1), 4.0, radius=0.1)]
    scene = gray_scene(triangles, 0.6, lights=lamps)
    return bake_scene(scene, ("Room", 12), ("Box", 12))


def run() -> tuple[BakeResult, list[TexelPicture]]:
    seen: list[Status] = []
    result = bake(room(), SETTINGS, noting(seen))
    return result, [status.picture for status in seen if isinstance(status.picture, TexelPicture)]


@pytest.fixture(scope="module")
def watched() -> tuple[BakeResult, list[TexelPicture]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(texel_pictures, "SECONDS", 0.0)
        patch.setattr(texel_pictures, "SHARE", 1e9)
        return run()


def errors(result: BakeResult, pictures: list[TexelPicture]) -> np.ndarray:
    """RMS of each picture's difference from the result, relative to its mean."""
    found = []
    for picture in pictures:
        index = picture.surfaces.texels[0]
        final = result.pages[0].pixels[index >= 0]
        difference = picture.radiosity[index[index >= 0]] - final
        found.append(np.sqrt((difference**2).mean()) / final.mean())
    return np.array(found)


def test_each_stage_is_nearer_to_the_result(watched: tuple[BakeResult, list[TexelPicture]]) -> None:
    result, pictures = watched
    off = errors(result, pictures)
    # The hierarchy; two lamps; three strides of gather points, in the open and at rims; sweeps.
    assert len(off) >= 7
    assert off[0] > 0.05
    assert off[2] < off[0]
    # What seams' stitching and the last sweep change is left.
    assert off[-1] < 0.02
    assert off[-1] < 0.2 * off[2]


def test_watching_changes_nothing(watched: tuple[BakeResult, list[TexelPicture]]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TexelPictures, "next", lambda *_: None)
        unwatched, seen = run()
    assert seen == []
    np.testing.assert_array_equal(unwatched.pages[0].pixels, watched[0].pages[0].pixels)


def test_pictures_take_their_share_of_the_time_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]

    def radiosity() -> np.ndarray:
        now[0] += 0.3
        return np.zeros((0, 3), dtype=np.float32)

    monkeypatch.setattr(texel_pictures, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    monkeypatch.setattr(texel_pictures, "lit_surfaces", lambda _: None)
    so_far: Any = SimpleNamespace(geometry=object(), version=1, radiosity=radiosity)
    pictures, began, made = TexelPictures(so_far), now[0], 0
    while now[0] < began + 1000.0:
        now[0] += 0.01
        so_far.version += 1
        made += pictures.next() is not None
    assert made > 10
    assert 0.3 * made / (now[0] - began) < 1.2 * texel_pictures.SHARE


def test_nothing_new_is_no_picture() -> None:
    so_far: Any = SimpleNamespace(geometry=None, version=0)
    assert TexelPictures(so_far).next() is None


@pytest.mark.parametrize("size", [7, 64, 100])
def test_a_coarser_page_has_a_texel_wherever_one_was(size: int) -> None:
    index = np.where(np.random.default_rng(3).random((size, size)) < 0.1, 5, -1).astype(np.int32)
    found, stretch = coarser(index, 32)
    assert len(found) <= 32
    row, column = np.nonzero(index >= 0)
    for corner in (1e-6, 1.0 - 1e-6):
        at = np.stack([row + corner, column + corner]) / size * stretch * len(found)
        assert (found[tuple(at.astype(int))] == 5).all()


def test_the_report_and_the_details_agree(watched: tuple[BakeResult, list[TexelPicture]]) -> None:
    result, _ = watched
    assert result.details is not None
    floor, box = result.light
    page = result.details.pages[0]
    # What the box stands on is shut in, and does not count: nothing else in the room is so dark.
    assert (page.state == ENCLOSED).sum() > 10
    assert floor["irradiance_W_m2"]["minimum"] > 0.05 * floor["irradiance_W_m2"]["mean"]
    for light in (floor, box):
        watts, lux = light["irradiance_W_m2"], light["illuminance_lx"]
        assert 0 < watts["minimum"] < watts["mean"] < watts["maximum"]
        assert watts["uniformity"] == pytest.approx(watts["minimum"] / watts["mean"])
        # The lamps are reddish: less lumens a watt than white light has.
        assert 0.9 * 683 < lux["mean"] / watts["mean"] < 1.1 * 683
    covered = result.pages[0].coverage
    np.testing.assert_array_equal(page.state != NO_TEXEL_HERE, covered)
    noise = page.unit * page.noise[covered].astype(float)
    irradiance = result.pages[0].pixels[covered].mean() / 0.6
    assert np.sqrt((noise**2).mean()) / irradiance == pytest.approx(
        result.solver["estimated_error"], rel=0.02
    )
    # Elements keep the light of their texels on average, though not on each.
    misfit = page.unit * page.misfit[covered].astype(float)
    assert abs(misfit.mean()) < 0.05 * irradiance
    assert np.abs(misfit).max() > 0.1 * irradiance


def test_an_evenly_lit_room_has_a_uniformity_of_one() -> None:
    """Walls that emit E = 1 and reflect a half: H = 2 everywhere."""
    triangles, _ = box_room()
    scene = bake_scene(gray_scene(triangles, 0.5, 1.0), ("Room", 12))
    result = bake(scene, BakeSettings(quality="draft", resolution=32, threads=1))
    light = result.light[0]["irradiance_W_m2"]
    assert light["mean"] == pytest.approx(2.0, rel=0.01)
    assert light["uniformity"] == pytest.approx(1.0, abs=0.03)
