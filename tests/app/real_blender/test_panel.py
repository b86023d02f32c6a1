"""The panel in a window, worked with mouse and keys; the screenshots stay in `out/ci`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.app.real_blender.installed import PICTURES, Installed

pytestmark = pytest.mark.real_blender


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session at the panel saw."""
    return installed.drive("drive_panel.py", cornell_blend, "panel")


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
    assert (PICTURES / "panel.png").stat().st_size > 20_000
