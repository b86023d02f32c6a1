"""The check that comes before a first bake, the time left, Esc: in a window, with mouse and keys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session saw; its photographs lie in `out/ci`."""
    return installed.drive("drive_working.py", cornell_blend, "working")


def test_an_odd_scene_is_shown_before_it_is_baked_first(seen: dict[str, Any]) -> None:
    assert not seen["baked_unlooked"]
    assert any("hidden in the viewport" in finding for finding in seen["findings"])
    assert any("8 × 8 texels" in finding for finding in seen["findings"])
    assert seen["after_check"] == []


def test_the_second_press_bakes_and_reports_the_time_left(seen: dict[str, Any]) -> None:
    assert seen["baking_after_check"]
    assert 0.0 < seen["seconds_left"] < 600.0


def test_escape_leaves_everything_as_before(seen: dict[str, Any]) -> None:
    assert seen["after_escape"] == []
