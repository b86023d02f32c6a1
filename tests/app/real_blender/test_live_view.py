"""The viewport brightens while a bake solves, and is as before afterwards, however the bake ends."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.app.conftest import read_pixels
from tests.app.real_blender.installed import PICTURES, Installed

pytestmark = pytest.mark.real_blender


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session saw; its photographs lie in `out/ci`."""
    return installed.drive("drive_live_view.py", cornell_blend, "live")


def photograph(seen: dict[str, Any], name: str) -> np.ndarray:
    """What the viewport showed, (height, width, 3) in [0, 1]; its header and gizmos are left out."""
    picture = read_pixels(PICTURES / name)
    x, y, across, down = seen["viewport"]
    pixels = picture[::-1]
    return pixels[y + down // 8 : y + down, x : x + int(across * 0.9)]


def test_every_shot_came_to_the_window_and_each_added_light(seen: dict[str, Any]) -> None:
    light = np.array(seen["brightening"])
    assert len(light) >= 30
    assert (np.diff(light) >= -1e-6 * light[-1]).all()
    # The walls emit nothing: it begins in the dark.
    assert light[0] < 0.01 * light[-1]


def test_the_viewport_brightens_everywhere(seen: dict[str, Any]) -> None:
    shots = [photograph(seen, name) for name in seen["shots"]]
    assert len(shots) == 5
    # Single pixels: the mouse pointer and letters that come and go.
    for before, after in pairwise(shots):
        assert (after < before - 2 / 255).any(axis=2).mean() < 1e-3
    means = [shot.mean() for shot in shots]
    assert means == sorted(means)
    assert means[-1] > means[0] + 0.01


@pytest.mark.parametrize("name", ["live-undone.png", "live-escaped.png"])
def test_afterwards_the_viewport_looks_as_before(seen: dict[str, Any], name: str) -> None:
    difference = np.abs(photograph(seen, name) - photograph(seen, "live-before.png")).max(axis=2)
    assert (difference > 2 / 255).mean() < 1e-3
    solved = photograph(seen, seen["shots"][-1]) - photograph(seen, "live-before.png")
    assert (np.abs(solved).max(axis=2) > 2 / 255).mean() > 0.2


def test_nothing_is_left_of_it_in_the_file(seen: dict[str, Any]) -> None:
    assert seen["after_undo"] == []
    assert seen["after_escape"] == []


def test_it_ends_with_the_bake(seen: dict[str, Any]) -> None:
    assert seen["active_before_escape"]
    assert not seen["active_after_finish"]
    assert not seen["active_after_escape"]


def test_it_can_be_switched_off(seen: dict[str, Any]) -> None:
    assert not seen["active_when_not_wanted"]


def test_opening_a_file_ends_the_bake_and_it(seen: dict[str, Any]) -> None:
    assert not seen["active_after_opening"]
    assert not seen["running_after_opening"]


def test_switching_the_extension_off_ends_the_bake_and_it(seen: dict[str, Any]) -> None:
    assert not seen["active_when_switched_off"]
    assert not seen["running_when_switched_off"]
    assert seen["operators_when_switched_off"] == 0
