"""*Flip Faces* in a window: above the warning, in one step of undo."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session saw; of the panel, which objects can be flipped and which have changed."""
    return installed.drive("drive_faces.py", cornell_blend, "faces")


def test_faces_that_a_bake_found_can_be_flipped_once(seen: dict[str, Any]) -> None:
    assert seen["baked"] == [["Tall Block"], []]
    assert seen["flipped"] == [[], ["Tall Block"]]
    assert seen["baked_again"] == [[], []]


def test_only_the_mesh_changes_and_undo_brings_it_back(seen: dict[str, Any]) -> None:
    assert seen["changed"]
    assert all("Tall Block" in difference for difference in seen["changed"])
    assert seen["after_undo"] == []
    assert seen["undone"] == [["Tall Block"], []]
