"""A scene is lit alike wherever it stands, and however large it is."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from tests.golden.rows.geometry import lit, moved

pytestmark = pytest.mark.one_blender

SETTINGS = BakeSettings(resolution=48, quality="draft", keep_uvs=True)


@pytest.fixture(scope="module")
def at_home() -> np.ndarray:
    return baked((0.0, 0.0, 0.0), 1.0)


SEEDS = 3
"""Bakes that are averaged: rays that graze an edge change the mean of a single one by 1e-4."""


def baked(place: tuple[float, float, float], scale: float) -> np.ndarray:
    """Bake a corner of 4 m with blockers and a soft lamp, put elsewhere and scaled."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    lit(blockers=True)
    moved(place, scale)
    scene = export_scene(bpy.context, SETTINGS).bake_scene
    seeds = [replace(SETTINGS, seed=seed) for seed in range(SEEDS)]
    return np.mean([bake(scene, settings).pages[0].pixels for settings in seeds], axis=0)


@pytest.mark.parametrize(
    ("place", "scale"),
    [
        ((7000.0, -7000.0, 1000.0), 1.0),
        ((0.0, 0.0, 0.0), 2500.0),
        # The next one is as small.
        pytest.param((0.0, 0.0, 0.0), 0.00025, marks=pytest.mark.full),
        ((-0.7, 0.7, 0.1), 0.00025),
    ],
    ids=["10 km away", "10 km wide", "1 mm wide", "1 mm wide and 1 m away"],
)
def test_place_and_size_change_nothing(
    at_home: np.ndarray, place: tuple[float, float, float], scale: float
) -> None:
    elsewhere = baked(place, scale)
    # Where a ray grazes an edge, rounding decides: a shadow's border may differ by a ray.
    error = np.sqrt(np.mean((elsewhere - at_home) ** 2)) / np.sqrt(np.mean(at_home**2))
    assert error < 1e-3
    assert elsewhere.mean() == pytest.approx(at_home.mean(), rel=1e-4)
