"""What pages need of the memory limit: large ones are refused before any work, all others are baked."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.bake import estimate, layout, texel_memory
from radiosity_addon.bake.estimate import LightmappedObject, estimate_bake
from radiosity_addon.bake.pipeline import bake
from radiosity_addon.bake.texel_memory import least_bytes, pages_of, refuse_large_pages
from radiosity_addon.base.errors import UsageError
from radiosity_addon.options.bake_settings import BakeSettings
from tests.rooms import box_room, gray_scene
from tests.unit.texel_scenes import bake_scene

ROOT = Path(__file__).resolve().parents[2]

ON_8_GB = 30_000_000
"""Pixels of the largest pages that fitted into 8 GB when nothing was tiled: at least 250 bytes each."""

PEAK = """
import os, sys
from radiosity_addon.bake.pipeline import bake
from radiosity_addon.options.bake_settings import BakeSettings
from tests.rooms import FLOOR, box_room, gray
from tests.unit.texel_scenes import bake_scene
from radiosity_addon.solver import PointLight, Scene

def peak():
    return int(open("/proc/self/status").read().split("VmHWM:")[1].split()[0]) * 1024

triangles, _ = box_room()
scene = Scene(triangles, gray(12, 0.1), gray(12, 0.0), lights=[PointLight((0.5, 0.4, 0.6), 10.0)])
limit = float(sys.argv[1])
settings = dict(quality="draft", threads=2, memory_limit=limit)
bake(bake_scene(scene, ("Room", 12)), BakeSettings(resolution=int(sys.argv[2]), **settings))
print(peak())
sys.stdout.flush()
os._exit(0)
"""


@pytest.mark.parametrize("limit", [None, 4.0])
def test_no_bake_that_fitted_into_eight_gigabytes_is_refused(limit: float | None) -> None:
    settings = BakeSettings(memory_limit=limit, threads=8)
    for pages in ([5477], [4096], [1024] * 28, [8]):
        assert sum(size**2 for size in pages) <= ON_8_GB
        refuse_large_pages(pages, settings)


def test_what_cannot_be_done_is_refused_with_the_figure() -> None:
    with pytest.raises(UsageError) as caught:
        refuse_large_pages([16384], BakeSettings(resolution=16384))
    message = str(caught.value)
    assert "\n" not in message
    figure = least_bytes([16384], BakeSettings()) / 2**30
    assert f"{figure:.1f} GiB" in message
    assert "limit of 4 GiB" in message
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("size", [12_000, 12_300, 12_600, 12_900, 16_384])
def test_the_limit_that_is_named_is_the_least_that_suffices(
    size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the tenth of a GiB that it is named with."""
    monkeypatch.setattr(texel_memory, "process_bytes", lambda: 0.3e9)
    with pytest.raises(UsageError) as caught:
        refuse_large_pages([size], BakeSettings(resolution=size))
    raised = float(str(caught.value).split("to ")[-1])
    refuse_large_pages([size], BakeSettings(resolution=size, memory_limit=raised))
    with pytest.raises(UsageError):
        refuse_large_pages([size], BakeSettings(resolution=size, memory_limit=raised - 0.1))


@pytest.mark.parametrize("size", [{"resolution": 16384}, {"texel_density": 20_000.0}])
def test_a_bake_is_refused_before_anything_is_unwrapped(
    size: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:

    def unwrapped(*_: object) -> None:
        raise AssertionError("it was unwrapped")

    monkeypatch.setattr(layout, "build_atlas", unwrapped)
    triangles, _ = box_room()
    scene = bake_scene(gray_scene(triangles), ("Room", 12))
    with pytest.raises(UsageError, match="memory limit"):
        bake(scene, BakeSettings(**size))  # type: ignore[arg-type]


def test_settings_alone_tell_the_pages_of_a_shared_atlas() -> None:
    assert pages_of(BakeSettings(resolution=64, pages=3)) == (64,) * 3
    assert pages_of(BakeSettings(texel_density=3.0)) is None
    assert pages_of(BakeSettings(atlas="per-object")) is None


def test_a_bake_stays_within_the_limit_by_what_is_foreseen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond the limit it is files that grow."""
    for module in (estimate, texel_memory):
        monkeypatch.setattr(module, "process_bytes", lambda: 0.3e9)
    ground = [LightmappedObject("Ground", 2, 250_000.0)]
    plans = [estimate_bake(ground, 2, BakeSettings(texel_density=density)) for density in (1.0, 8.0)]
    assert plans[0].files == 0
    assert plans[1].files > 0
    assert 0.3e9 < plans[0].memory < plans[1].memory <= 4 * 2**30


@pytest.mark.full  # a page of a megapixel; `test_memory_per_texel` counts what each stage takes on small ones
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no peak of a process to read")
def test_the_peak_of_a_process_stays_within_the_limit() -> None:
    """1024² texels, for which 0.9 GB were needed once."""
    limit = 0.45
    run = subprocess.run(
        [sys.executable, "-c", PEAK, str(limit), "1024"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert run.returncode == 0, run.stderr
    assert 0.1 < float(run.stdout) / 2**30 <= limit


def test_working_memory_does_not_refuse_small_pages() -> None:
    assert np.isfinite(least_bytes([32], BakeSettings(threads=64)))
    refuse_large_pages([32], BakeSettings(memory_limit=0.01, threads=64))
