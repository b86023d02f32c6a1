"""Noise that is shared as it was best for the baked light, under other light."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.relight.kept_bake import KeptBake, relight_pages
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings
from tests.relit_rooms import BAKED, CHANGED, lit_bake

SETTINGS = BakeSettings(resolution=64, quality="draft")
DARK, SKY, EMISSION = (np.isin(np.arange(len(BAKED)), rows)[:, None] for rows in ((1,), (2,), (4, 5)))
"""The lamp that was dark when the room was baked, the sky, and what glows."""


def pixels(pages: tuple[LightmapPage, ...]) -> np.ndarray:
    return np.asarray(pages[0].pixels[pages[0].coverage], dtype=np.float64)


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.sqrt(((found - expected) ** 2).mean()) / expected.mean())


@pytest.fixture(scope="module")
def room() -> KeptBake:
    return bake_and_keep(lit_bake(), SETTINGS)[1]


def test_the_baked_light_gives_the_baked_lightmap() -> None:
    result, kept = bake_and_keep(lit_bake(), SETTINGS)
    assert relative(pixels(relight_pages(kept, BAKED)), pixels(result.pages)) < kept.lit.tolerance


@pytest.mark.parametrize(
    "strengths",
    [CHANGED, 30.0 * DARK * np.ones(3), BAKED * SKY, BAKED * EMISSION],
    ids=["all changed", "dark lamp alone", "sky alone", "emission alone"],
)
def test_relit_light_is_as_near_to_a_full_bake_as_another_seed(room: KeptBake, strengths: np.ndarray) -> None:
    found = pixels(relight_pages(room, strengths))
    expected, other = (
        pixels(bake(lit_bake(strengths), BakeSettings(resolution=64, quality="draft", seed=seed)).pages)
        for seed in (0, 7)
    )
    assert relative(found, expected) < relative(other, expected)
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.005)


def test_light_of_several_strengths_adds_up(room: KeptBake) -> None:
    first, second = (pixels(relight_pages(room, each)) for each in (CHANGED, BAKED * SKY))
    found = pixels(relight_pages(room, 0.5 * CHANGED + 0.25 * BAKED * SKY))
    assert relative(found, 0.5 * first + 0.25 * second) < 1e-3
