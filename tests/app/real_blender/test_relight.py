"""Live in a window: a slider relights, undo takes it back, and the viewport follows at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = [pytest.mark.real_blender, pytest.mark.timed]


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session saw; its photographs lie in `out/ci`."""
    return installed.drive("drive_relight.py", cornell_blend, "relight")


def test_a_dragged_slider_relights(seen: dict[str, Any]) -> None:
    assert seen["power_dragged"] != seen["power"]
    ratio = seen["power_dragged"] / seen["power"]
    assert seen["dragged"] == pytest.approx(ratio * seen["baked"], rel=1e-3)


def test_undo_takes_lamp_and_light_back(seen: dict[str, Any]) -> None:
    assert seen["power_undone"] == pytest.approx(seen["power"])
    assert seen["undone"] == pytest.approx(seen["baked"], rel=1e-3)


def test_the_lightmap_follows_within_a_fifth_of_a_second(seen: dict[str, Any]) -> None:
    """The image, at each step; to draw it is the graphics card's part, for which CI has a slow stand-in."""
    assert len(seen["latencies"]) == 4
    assert max(seen["latencies"]) < 0.2


def test_relight_runs_next_to_the_window(seen: dict[str, Any]) -> None:
    assert seen["modal"]
    assert seen["halved"] == pytest.approx(0.5 * seen["baked"], rel=1e-3)


def test_it_rests_when_nothing_changes(seen: dict[str, Any]) -> None:
    assert seen["still_resting"]
    assert seen["on"]
    assert seen["message"] == ""
