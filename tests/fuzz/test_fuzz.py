"""Hundreds of random scenes: no crash, no NaN, no light from nothing, and restored exactly."""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.lightmap.images import page_assembly
from radiosity_addon.numerics.arrays import Array

from .checks import check
from .scenes import SCENES

ROOT = Path(__file__).resolve().parents[2]

IN_EVERY_RUN = 10
"""Scenes that every run tries."""

BAKED_SEED = 17
"""Its scene can be baked."""

BRIGHT_SEED = 50
BRIGHT_VARIANTS: tuple[dict[str, int], ...] = ({"seed": 4}, {"padding": 6}, {"resolution": 50})
"""Settings with which light grew from sweep to sweep in the scene of this seed."""

LAYERED = (20017,)
"""Seeds whose faces lie in one another and once made light."""

BLOCKS = [
    (0, IN_EVERY_RUN),
    (IN_EVERY_RUN, 40),
    *((start, min(start + 100, SCENES)) for start in range(40, SCENES, 100)),
]
"""Seeds of each test. Those after the first repeat its checks with other scenes, a minute of both cores
each: they run with `build.py test --full`, and `build.py fuzz` tries more."""

TIMEOUT = 500
"""Seconds; on an idle machine a block takes a seventh of it."""


@pytest.mark.one_blender
@pytest.mark.parametrize(
    ("first", "last"),
    [BLOCKS[0], *(pytest.param(*block, marks=pytest.mark.full) for block in BLOCKS[1:])],
)
def test_random_scenes(first: int, last: int) -> None:
    """Processes share the seeds; one that Blender takes down with it is told by its exit code."""
    workers = max(os.cpu_count() or 1, 1)
    limits = [first + (last - first) * number // workers for number in range(workers + 1)]
    command = [sys.executable, "-m", "tests.fuzz", "--seeds"]
    running = [
        subprocess.Popen(
            [*command, f"{begin}:{end}"],
            cwd=ROOT,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        for begin, end in itertools.pairwise(limits)
    ]
    try:
        told = [process.communicate(timeout=TIMEOUT)[0] for process in running]
    finally:
        for process in running:
            process.kill()
    for process, words in zip(running, told, strict=True):
        assert process.returncode == 0, words[-3000:]
    baked = sum(int(re.findall(r"(\d+) baked", words)[-1]) for words in told)
    # The generator is of no use if many of its scenes are refused.
    assert baked > 0.7 * (last - first)


@pytest.mark.one_blender
@pytest.mark.parametrize("seed", LAYERED)
def test_layers_make_no_light(seed: int) -> None:
    """In one process each: Blender's own end may hang while our classes are registered."""
    command = [sys.executable, "-m", "tests.fuzz", "--seeds", f"{seed}:{seed + 1}"]
    done = subprocess.run(command, cwd=ROOT, text=True, capture_output=True, timeout=TIMEOUT, check=False)
    assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]


@pytest.mark.one_blender
@pytest.mark.parametrize("changed", BRIGHT_VARIANTS, ids=str)
def test_no_texel_runs_away_between_paint_and_glass(changed: dict[str, int]) -> None:
    """Paint that is added to colored transparency once reflected what passed as well."""
    radiosity_addon.register()
    try:
        assert check(BRIGHT_SEED, **changed)
    finally:
        radiosity_addon.unregister()


@pytest.mark.one_blender
def test_a_wrong_bake_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The checks can fail: handed darkness below zero they say so."""
    real = page_assembly.fill

    def darker(pixels: Array, *given: Any) -> None:
        real(pixels, *given)
        pixels -= np.float32(1e6)

    monkeypatch.setattr(page_assembly, "fill", darker)
    radiosity_addon.register()
    try:
        with pytest.raises(AssertionError, match="page 0 holds -"):
            check(BAKED_SEED)
    finally:
        radiosity_addon.unregister()
