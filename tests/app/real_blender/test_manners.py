"""The check's dialog, other add-ons' timers and a second window, while a bake runs in a real window."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session saw; its photographs lie in `out/ci`."""
    return installed.drive("drive_manners.py", cornell_blend, "manners")


def test_the_dialogs_button_bakes(seen: dict[str, Any]) -> None:
    assert seen["baking_from_dialog"]
    assert seen["lit"]


def test_an_interrupted_bake_is_recovered_from_the_panel(seen: dict[str, Any]) -> None:
    assert seen["interrupted"]
    assert seen["recovered"]


def test_only_its_own_timer_carries_a_bake_on(seen: dict[str, Any]) -> None:
    foreign, advanced = seen["ticks"]
    assert foreign > 0  # at d331b48 none: they were swallowed
    assert 0 < advanced <= 110  # one every 10 ms


def test_an_edit_in_a_second_window_survives_the_bake_and_the_bake_the_edit(seen: dict[str, Any]) -> None:
    edited = seen["edited"]
    assert edited["while_baking"]
    assert edited["corner"] == 0.0625
    assert edited["lit"] == edited["shows"]


def test_a_deletion_in_a_second_window_stops_the_bake_and_nothing_else(seen: dict[str, Any]) -> None:
    deleted = seen["deleted"]
    assert deleted["windows"] == 2
    assert deleted["while_baking"]
    assert "Tall Block" not in deleted["shows"]
    assert deleted["lit"] == []


def test_an_undo_in_a_second_window_stops_the_bake(seen: dict[str, Any]) -> None:
    undone = seen["undone"]
    assert undone["while_baking"]
    assert undone["lit"] == []


def test_a_bake_goes_on_when_a_second_window_is_closed(seen: dict[str, Any]) -> None:
    closed = seen["closed"]
    assert closed["while_baking"]
    assert closed["windows"] == 1
    assert closed["lit"] == closed["shows"] != []


def test_a_bake_ends_with_its_window_and_leaves_everything_as_it_was(seen: dict[str, Any]) -> None:
    closed = seen["closed_itself"]
    assert closed["while_baking"]
    assert closed["windows"] == 1
    assert closed["lit"] == []
    assert closed["changed"] == []
