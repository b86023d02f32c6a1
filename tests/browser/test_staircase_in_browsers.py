"""A real scene as engines draw it: 775 meshes, large images, most of the light indirect."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.blender.command_line.main import main
from tests.browser.browser import bundled, chromium, drawn
from tests.browser.reference import inner_pixels, rendered
from tests.browser.test_exports_in_browsers import Exported, check_validity, errors, is_even

pytestmark = [pytest.mark.one_blender, pytest.mark.full]

SIZE = (234, 416)
"""The format of the scene's camera."""

FINER = 9
"""Wood has several texels of an image in each pixel."""

LEAST = 0.2
"""The share of pixels that count: in the others wood and wallpaper change from one pixel to the next."""

WORDS = ("--resolution", "512", "--quality", "sketch", "--no-preview", "--quiet", "--export", "web")


@pytest.fixture(scope="module")
def staircase(shared_scenes: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Exported]:
    """Bake, export, and render with Cycles."""
    chromium()
    folder = tmp_path_factory.mktemp("staircase")
    radiosity_addon.register()
    scene = shared_scenes / "staircase" / "staircase.blend"
    assert main(["bake", str(scene), "--output", str(folder / "out"), *WORDS]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out" / "baked.blend"))
    inner = inner_pixels(*SIZE)
    images = [rendered(folder, *SIZE, lightmap_only=only) for only in (False, True)]
    programs = {name: bundled(f"{name}_page", folder) for name in ("three", "babylon")}
    yield Exported(folder / "out" / "export", *images, inner, programs, SIZE)
    radiosity_addon.unregister()


@pytest.mark.parametrize(
    ("engine", "form", "largest", "median"),
    [
        ("three", "exr", 0.003, 0.001),
        ("three", "ktx2", 0.006, 0.001),
        ("babylon", "ktx2", 0.006, 0.001),
    ],
)
def test_engines_show_what_cycles_shows(
    staircase: Exported, engine: str, form: str, largest: float, median: float
) -> None:
    pixels = drawn(staircase.folder, staircase.programs[engine], *SIZE, FINER, form=form)
    found = errors(pixels, staircase.cycles, staircase.inner, LEAST)
    assert found[0] < largest
    assert found[1] < median


@pytest.mark.parametrize("engine", ["three", "babylon"])
def test_light_without_lightmaps_is_within_eight_bits(staircase: Exported, engine: str) -> None:
    """Where the base color is even: scene_baked.glb has no details that are finer than a lightmap texel.

    What is brightest there is sixty times as bright as the mean: one white for all surfaces gave 1.04 %.
    """
    light = staircase.cycles_lightmap[..., :3].sum(axis=-1)
    base = staircase.cycles[..., :3].sum(axis=-1) / np.maximum(light, 1e-12)
    even = staircase.inner & is_even(base, 0.01)
    pixels = drawn(staircase.folder, staircase.programs[engine], *SIZE, FINER, form="baked")
    found = errors(pixels, staircase.cycles, even, 0.02)
    assert found[0] < 0.01


def test_the_validator_finds_no_error(staircase: Exported) -> None:
    check_validity(staircase.folder)
