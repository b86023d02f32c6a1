"""Arrays in memory and in files: the same values, within the budget."""

from __future__ import annotations

import gc
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from radiosity_addon.bake import pipeline
from radiosity_addon.bake.pipeline import bake
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.base.errors import BakeError
from radiosity_addon.numerics import scratch as module
from radiosity_addon.numerics.scratch import MIN_FILE_BYTES, Scratch, is_in_file, row_numbers
from radiosity_addon.options.bake_settings import BakeSettings
from tests.cornell import cornell_box
from tests.unit.texel_scenes import bake_scene

ROOT = Path(__file__).resolve().parents[2]

COUNT = MIN_FILE_BYTES // 4
"""Numbers of four bytes that are just counted."""


def test_arrays_go_to_files_when_the_budget_is_used_up() -> None:
    scratch = Scratch(1.5 * MIN_FILE_BYTES)
    first = scratch.empty(COUNT, np.int32)
    second = scratch.zeros((COUNT, 1), np.int32)
    assert (is_in_file(first), is_in_file(second)) == (False, True)
    assert (scratch.in_memory, scratch.in_files) == (MIN_FILE_BYTES, MIN_FILE_BYTES)
    assert not second.any()
    second[:] = 7
    module.trim()
    assert (second == 7).all()
    del first
    gc.collect()
    assert scratch.in_memory == 0
    assert not is_in_file(scratch.empty(COUNT, np.int32))


@pytest.mark.parametrize(("in_files", "free", "given"), [(0, 1e6, 1), (1, 1e6, 0), (1, 0.0, 1)])
def test_freed_memory_is_given_back_unless_arrays_would_take_it(
    in_files: int, free: float, given: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[None] = []
    monkeypatch.setattr(module, "give_back", lambda: calls.append(None))
    scratch = Scratch()
    scratch.in_files, scratch.free = in_files, lambda: free
    scratch.give_back()
    assert len(calls) == given


def test_small_arrays_stay_in_memory() -> None:
    assert not is_in_file(Scratch(0.0).empty(COUNT - 1, np.int32))


@pytest.mark.parametrize("budget", [0.0, 3.0 * MIN_FILE_BYTES, np.inf])
def test_rows_are_the_same_wherever_they_are(budget: float) -> None:
    """Blocks that begin in memory and go on in a file."""
    table = Scratch(budget).rows(3, np.int32)
    blocks = []
    for number, count in enumerate([5, 0, COUNT // 3, COUNT, 17]):
        block = table.more(count)
        block[:] = number
        blocks.append(np.full((count, 3), number, np.int32))
    table.extend(np.full((9, 3), 8, np.int32))
    table.extend(np.full((2, 3), 9, np.int32))
    expected = np.concatenate([*blocks, np.full((9, 3), 8), np.full((2, 3), 9)])
    found = table.all()
    assert is_in_file(found) == (budget < np.inf)
    np.testing.assert_array_equal(found, expected)


JOINED = """
import os
from radiosity_addon.numerics.scratch import Scratch

def held(key):
    try:
        return int(open("/proc/self/status").read().split(key)[1].split()[0]) / 2**10
    except OSError:
        os._exit(3)

table = Scratch().rows(1 << 10, "i4")
for _ in range(64):
    table.more(1 << 10)[:] = 1
before = held("VmRSS:")
joined = table.all()
print(joined.nbytes / 2**20, held("VmHWM:") - before, held("VmRSS:") - before, flush=True)
os._exit(0)
"""


def test_rows_are_joined_without_a_second_copy() -> None:
    """256 MiB in blocks of 4: each is freed once it has moved."""
    run = subprocess.run([sys.executable, "-c", JOINED], cwd=ROOT, capture_output=True, text=True, timeout=60)
    if run.returncode == 3:
        pytest.skip("this system does not say how much memory a process takes")
    assert run.returncode == 0, run.stderr
    size, more, in_the_end = (float(word) for word in run.stdout.split())
    assert size == 256
    assert in_the_end < 16
    assert more < 32


def test_a_full_disk_is_said_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module.os, "posix_fallocate", full, raising=False)
    with pytest.raises(BakeError, match=r"no room for 0\.0 GiB .*TMPDIR") as caught:
        Scratch(0.0).empty(COUNT, np.int32)
    assert "\n" not in str(caught.value)


def test_files_leave_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(module.tempfile, "tempdir", None)
    found = Scratch(0.0).zeros(COUNT, np.int32)
    assert is_in_file(found)
    assert list(tmp_path.iterdir()) == []


def test_row_numbers_are_those_of_flatnonzero(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "TILE", 7)
    mask = np.random.default_rng(0).random(100) > 0.5
    np.testing.assert_array_equal(row_numbers(mask), np.flatnonzero(mask))


def test_tiles_give_the_same_bytes_in_a_fraction_of_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """The Cornell box at 64² with all arrays in memory, and with every one of 1 KB or more in a file."""
    whole, most = baked()
    monkeypatch.setattr(module, "MIN_FILE_BYTES", 1 << 10)
    monkeypatch.setattr(pipeline, "texel_scratch", lambda *_: Scratch(0.0))
    monkeypatch.setattr(pipeline, "share_out_memory", lambda *_: None)
    tiled, least = baked()
    assert tiled.pages[0].pixels.tobytes() == whole.pages[0].pixels.tobytes()
    assert tiled.pages[0].coverage.tobytes() == whole.pages[0].coverage.tobytes()
    assert whole.details is not None
    assert tiled.details is not None
    for name in ("state", "noise", "misfit"):
        one, other = (getattr(result.details.pages[0], name) for result in (whole, tiled))
        assert one.tobytes() == other.tobytes()
    assert tiled.light == whole.light
    assert least < most


def baked() -> tuple[BakeResult, int]:
    """Return a bake, and the most memory that it took [bytes]."""
    scene = cornell_box()
    tracemalloc.start()
    try:
        result = bake(bake_scene(scene, ("Box", len(scene))), BakeSettings(resolution=64, quality="draft"))
        return result, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
