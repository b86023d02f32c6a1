"""Lighting kept bakes anew: what full bakes give for the same lights, without a ray."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.relight.kept_bake import KeptBake, relight_pages
from radiosity_addon.bake.relight.source_strengths import strengths_in
from radiosity_addon.base.errors import SceneError, UsageError
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.lightmap.points import smoothing
from radiosity_addon.lightmap.transport import ray_runs
from radiosity_addon.lightmap.transport.warm_start import WarmStart
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import PointLight, Scene
from tests.cornell import cornell_box
from tests.relit_rooms import BAKED, CHANGED, NAMES, lit_bake
from tests.rooms import box_room, gray_scene
from tests.textured_rooms import furnace
from tests.unit.texel_scenes import bake_scene

SETTINGS = BakeSettings(resolution=64, quality="draft")

DARK = 1
"""The row of the lamp that was dark when the room was baked."""


def pixels(pages: tuple[LightmapPage, ...]) -> np.ndarray:
    """The (n, 3) covered texels of the first page."""
    return np.asarray(pages[0].pixels[pages[0].coverage], dtype=np.float64)


def full(scene: BakeScene, **settings: Any) -> np.ndarray:
    changed = BakeSettings(**{"resolution": 64, "quality": "draft", **settings})
    return pixels(bake(scene, changed).pages)


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    """Root mean square of the difference, relative to the mean."""
    return float(np.sqrt(((found - expected) ** 2).mean()) / expected.mean())


def only(*rows: int) -> np.ndarray:
    return np.isin(np.arange(len(BAKED)), rows)[:, None]


@pytest.fixture(scope="module", autouse=True)
def _noise_is_not_shared() -> Iterator[None]:
    """How noise is shared, and where rays go, depends on the light of the bake (`test_relit_noise.py`)."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(smoothing, "PASSES", ())
        patch.setattr(ray_runs, "EVEN", 1.0)
        yield


@pytest.fixture(scope="module")
def room() -> KeptBake:
    _, kept = bake_and_keep(lit_bake(), SETTINGS)
    return kept


def test_sources_are_lamps_sky_and_emissive_materials(room: KeptBake) -> None:
    assert room.names == NAMES
    np.testing.assert_array_equal(room.strengths, BAKED)


@pytest.mark.parametrize(
    "strengths",
    [CHANGED, BAKED + 30.0 * only(DARK), 30.0 * only(DARK) * np.ones(3), BAKED * only(2), BAKED * only(4, 5)],
    ids=["all changed", "dark lamp switched on", "dark lamp alone", "sky alone", "emission alone"],
)
def test_other_strengths_give_what_a_full_bake_gives(room: KeptBake, strengths: np.ndarray) -> None:
    """Measured 0.01 to 0.6 %, where bakes of two seeds differ by 1 to 3 %."""
    caster = room.solved.local.caster
    before = caster.rays
    found = pixels(relight_pages(room, strengths))
    assert caster.rays == before
    assert relative(found, full(lit_bake(strengths))) < 0.01


def test_a_faint_lamp_alone_has_the_noise_of_a_bake_at_most(room: KeptBake) -> None:
    """In the full bake of all light the sun was asked with few rays; it is alone now."""
    strengths = BAKED * only(3)
    expected = full(lit_bake(strengths))
    noise = relative(full(lit_bake(strengths), seed=7), expected)
    assert relative(pixels(relight_pages(room, strengths)), expected) < noise


def test_the_same_strengths_give_the_same_lightmap() -> None:
    """To where the sweeps end, started from what was solved or from nothing but the hierarchy."""
    result, kept = bake_and_keep(lit_bake(), SETTINGS)
    expected = pixels(result.pages)
    assert relative(pixels(relight_pages(kept, BAKED)), expected) < kept.lit.tolerance
    table = np.zeros((len(expected) + len(kept.lit.transport.cells.start), 3), dtype=np.float32)
    nothing = WarmStart(np.zeros_like(BAKED), table)
    anew = replace(kept, lit=replace(kept.lit, warm_start=nothing))
    assert relative(pixels(relight_pages(anew, BAKED)), expected) < kept.lit.tolerance


def test_light_is_linear_and_what_was_solved_before_is_not_solved_again(room: KeptBake) -> None:
    first, second = relight_pages(room, CHANGED), relight_pages(room, BAKED * only(0))
    mixture = 0.5 * CHANGED + 0.25 * BAKED * only(0)
    assert room.lit.warm_start.mixed(mixture) is not None
    found = pixels(relight_pages(room, mixture))
    assert relative(found, 0.5 * pixels(first) + 0.25 * pixels(second)) < 1e-3


def test_the_cornell_box_in_another_color() -> None:
    """Measured 0.1 %; bakes of two seeds differ by 2 %."""
    box = cornell_box()
    _, kept = bake_and_keep(bake_scene(box, ("Box", len(box))), SETTINGS)
    before = kept.solved.local.caster.rays
    strengths = np.array([(5.0, 40.0, 30.0)])
    found = pixels(relight_pages(kept, strengths))
    assert kept.solved.local.caster.rays == before
    emission = box.emission.copy()
    emission[-2:] = strengths
    changed = Scene(box.triangles, box.reflectance, emission)
    assert relative(found, full(bake_scene(changed, ("Box", len(box))))) < 0.003


def test_a_room_baked_in_the_dark_can_be_lit() -> None:
    triangles, _ = box_room()

    def lit(power: float) -> BakeScene:
        lamp = PointLight((0.5, 0.4, 0.6), power, radius=0.05)
        return bake_scene(gray_scene(triangles, 0.6, lights=[lamp]), ("Room", 12))

    _, kept = bake_and_keep(lit(0.0), SETTINGS)
    found = pixels(relight_pages(kept, np.full((1, 3), 12.0)))
    assert relative(found, full(lit(12.0))) < 0.01


def test_radiosity_shows_the_new_emission() -> None:
    _, kept = bake_and_keep(lit_bake(), BakeSettings(resolution=64, quality="draft", quantity="radiosity"))
    found = pixels(relight_pages(kept, CHANGED))
    assert relative(found, full(lit_bake(CHANGED), quantity="radiosity")) < 0.01


def test_strengths_are_read_from_a_changed_scene(room: KeptBake) -> None:
    np.testing.assert_array_equal(strengths_in(room, lit_bake(CHANGED)), CHANGED)
    painted = lit_bake(CHANGED)
    painted.scene.emission[0] = 1.0
    with pytest.raises(SceneError, match="new somewhere"):
        strengths_in(room, painted)
    other = lit_bake(CHANGED)
    lights = other.scene.lights
    other.scene.lights = (PointLight((2.2, 0.6, 1.4), 5.0, radius=0.05, name="Bulb"), *lights[1:])
    with pytest.raises(SceneError, match=r"'Bulb'.*strength"):
        strengths_in(room, other)


@pytest.mark.parametrize(
    "strengths", [BAKED[:-1], -BAKED, np.full(BAKED.shape, np.nan)], ids=["too few", "negative", "no number"]
)
def test_impossible_strengths_are_refused(room: KeptBake, strengths: np.ndarray) -> None:
    with pytest.raises(SceneError):
        relight_pages(room, strengths)


def test_methods_without_links_are_refused() -> None:
    settings = BakeSettings(resolution=16, quality="draft", method="shooting")
    with pytest.raises(UsageError, match="hierarchical"):
        bake_and_keep(lit_bake(), settings)
    with pytest.raises(UsageError, match="residual"):
        bake_and_keep(lit_bake(), BakeSettings(resolution=16, quantity="residual"))


GROUPS = (("Lamps", ("Bulb", "Window light")), ("Outside", ("World",)), ("Panel", ("Panel",)))


@pytest.mark.parametrize("light", ["all", "direct", "indirect"])
def test_light_groups_sum_to_the_bake(light: str) -> None:
    """What is in no group is one of its own; none is below 0, and each is what relighting it alone gives."""
    settings = BakeSettings(resolution=64, quality="draft", groups=GROUPS, light=light)
    result = bake(lit_bake(), settings)
    assert [group.name for group in result.groups] == ["Lamps", "Outside", "Panel", "others"]
    parts = np.stack([pixels(group.pages) for group in result.groups])
    whole = pixels(result.pages)
    assert (parts >= 0).all()
    assert relative(parts.sum(axis=0), whole) < 1e-6
    np.testing.assert_allclose(parts.sum(axis=0), whole, rtol=1e-4, atol=1e-4 * whole.mean())
    # A red sign: the others' blue is nobody's.
    assert parts[3][:, 0].any()
    assert not parts[3][:, 1:].any()


def test_groups_add_up_before_what_sweeps_leave_is_shared_out(room: KeptBake) -> None:
    """To the sweeps' tolerance, 8e-4 of the mean at most at single texels."""
    rows = [only(0, 1), only(2, 3), only(4), only(5)]
    total = sum(pixels(relight_pages(room, BAKED * some)) for some in rows)
    assert relative(np.asarray(total), pixels(relight_pages(room, BAKED))) < 8e-4


def test_groups_that_cannot_be_are_refused() -> None:
    with pytest.raises(UsageError, match="'Moon'"):
        bake(lit_bake(), BakeSettings(resolution=16, quality="draft", groups=(("Night", ("Moon",)),)))
    with pytest.raises(UsageError, match="'Sun' is given twice"):
        BakeSettings(groups=(("Day", ("Sun",)), ("Noon", ("Sun",))))
    with pytest.raises(UsageError, match="shooting keeps no links"):
        BakeSettings(groups=(("Day", ("Sun",)),), method="shooting")


def test_a_textured_furnace_scales_with_its_emission() -> None:
    """E(x) = (1 − ρ(x)) c, textured: radiosity is c everywhere, in each channel as it is scaled."""
    settings = BakeSettings(resolution=48, quality="draft", quantity="radiosity")
    _, kept = bake_and_keep(bake_scene(furnace(3.0), ("Room", 12)), settings)
    found = pixels(relight_pages(kept, kept.strengths * (1.0, 2.0, 0.0)))
    np.testing.assert_allclose(found.mean(axis=0), (3.0, 6.0, 0.0), rtol=0.005)
    assert not found[:, 2].any()
    assert np.sqrt(((found[:, 1] / 6.0 - 1) ** 2).mean()) < 0.03
