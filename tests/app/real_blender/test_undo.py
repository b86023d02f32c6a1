"""Undo and redo in a window: the lightmap's picture and the UVs that were made for it belong together."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session saw, of a copy of the scene in a folder of its own."""
    folder = cornell_blend.parent.parent / "undo"
    folder.mkdir()
    scene = Path(shutil.copy(cornell_blend, folder / "undone.blend"))
    return installed.drive("drive_undo.py", scene, "undo")


def test_there_are_states_to_tell_apart(seen: dict[str, Any]) -> None:
    before, first, second, relit, restored = seen["states"]
    assert before == restored == [None, None]
    assert len({first[0], second[0], None}) == 3
    assert relit[0] == second[0]
    assert len({each[1][0] for each in (first, second, relit)}) == 3
    assert len({each[1][1] for each in (first, second, relit)}) == 3


def test_picture_file_and_uvs_belong_together_after_each_undo_and_redo(seen: dict[str, Any]) -> None:
    assert {place for place, _ in seen["walk"]} == {0, 1, 2, 3, 4}
    for number, (place, shown) in enumerate(seen["walk"]):
        assert shown == seen["states"][place], f"step {number}: not as state {place} was"


def test_also_in_a_file_that_is_saved_then_and_opened(seen: dict[str, Any]) -> None:
    assert seen["before_saving"] == seen["states"][2]
    assert seen["opened"] == seen["before_saving"]


def test_edits_of_what_stands_in_for_others_are_refused_at_once(seen: dict[str, Any]) -> None:
    """The session waits until edit mode is left and the object is back, and fails if that does not come."""
    assert seen["entered"] == "EDIT"
    assert seen["same_layers"]
