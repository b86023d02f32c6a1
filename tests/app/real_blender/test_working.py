"""The check that comes before a first bake, the time left, Esc: in a window, with mouse and keys."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender

PICTURES = Path(__file__).resolve().parents[3] / "out" / "ci"


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session saw; its photographs lie in `out/ci`."""
    answer = cornell_blend.with_name("working.json")
    done = installed.run(
        cornell_blend,
        "--enable-event-simulate",
        "--window-geometry",
        *("0", "0", "1280", "800"),
        "--python",
        installed.folder / "drive_working.py",
        "--",
        answer,
        window=True,
        timeout=400,
    )
    PICTURES.mkdir(parents=True, exist_ok=True)
    for picture in answer.parent.glob("working-*.png"):
        shutil.copy(picture, PICTURES)
    assert answer.exists(), done.stdout
    told = json.loads(answer.read_text())
    assert told["failure"] is None, f"{told['failure']}\n{done.stdout}"
    assert "Traceback" not in done.stdout, done.stdout
    return told


def test_an_odd_scene_is_shown_before_it_is_baked_first(seen: dict[str, Any]) -> None:
    assert not seen["baked_unlooked"]
    assert any("hidden in the viewport" in finding for finding in seen["findings"])
    assert any("8 × 8 texels" in finding for finding in seen["findings"])
    assert seen["after_check"] == []


def test_the_second_press_bakes_and_tells_the_time_left(seen: dict[str, Any]) -> None:
    assert seen["baking_after_check"]
    assert 0.0 < seen["seconds_left"] < 600.0


def test_escape_leaves_everything_as_before(seen: dict[str, Any]) -> None:
    assert seen["after_escape"] == []
