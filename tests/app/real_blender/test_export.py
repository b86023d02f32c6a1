"""Exports from a window: nothing of them stays in the file, and the scene is read only after an edit."""

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
    folder = cornell_blend.parent.parent / "exported"
    folder.mkdir()
    scene = Path(shutil.copy(cornell_blend, folder / "exported.blend"))
    return installed.drive("drive_export.py", scene, "export")


def test_all_files_are_there(seen: dict[str, Any]) -> None:
    assert {"scene.glb", "viewer.html", "lightmap.ktx2", "report.json"} <= set(seen["files"])
    assert not [name for name in seen["files"] if name.startswith(".")]


def test_no_scene_of_an_export_stays(seen: dict[str, Any]) -> None:
    assert len({tuple(names) for names in seen["scenes"]}) == 1
    assert len(seen["scenes"][0]) == 1


def test_the_scene_is_read_only_after_an_edit(seen: dict[str, Any]) -> None:
    """Not right after the bake, but after an object was moved, and not once that is undone."""
    assert seen["reads"] == [0, 1, 0]
