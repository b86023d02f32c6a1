"""The panel in a window, worked with mouse and keys; the screenshots stay in `out/ci`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session at the panel saw."""
    answer = cornell_blend.with_name("panel.json")
    done = installed.run(
        cornell_blend,
        "--enable-event-simulate",
        "--window-geometry",
        *("0", "0", "1280", "800"),
        "--python",
        installed.folder / "drive_panel.py",
        "--",
        answer,
        window=True,
        timeout=400,
    )
    pictures = ROOT / "out" / "ci"
    pictures.mkdir(parents=True, exist_ok=True)
    for picture in answer.parent.glob("panel*.png"):
        shutil.copy(picture, pictures)
    assert answer.exists(), done.stdout
    told = json.loads(answer.read_text())
    assert told["failure"] is None, f"{told['failure']}\n{done.stdout}"
    return told


def test_the_bake_button_runs_a_modal_operator_to_its_end(seen: dict[str, Any]) -> None:
    assert seen["modal"]
    # The window's own timer came to its turn while the bake ran.
    assert seen["asked_while_baking"] > 3
    assert seen["lit"] == seen["objects"]
    assert seen["images"]


def test_the_result_is_shown(seen: dict[str, Any]) -> None:
    assert seen["shading"] == "MATERIAL"


def test_one_undo_takes_the_whole_bake_back_and_redo_brings_it(seen: dict[str, Any]) -> None:
    assert seen["after_undo"] == []
    assert seen["lit_after_redo"] == seen["objects"]


def test_escape_cancels_and_leaves_everything_as_it_was(seen: dict[str, Any]) -> None:
    assert seen["baking_before_escape"]
    assert seen["after_escape"] == []


def test_the_restore_button_brings_everything_back(seen: dict[str, Any]) -> None:
    assert seen["lit_before_restore"] == seen["objects"]
    assert seen["after_restore"] == []


def test_the_window_was_photographed(seen: dict[str, Any]) -> None:
    assert (ROOT / "out" / "ci" / "panel.png").stat().st_size > 20_000
