"""Light groups in a window: baked, their panel and their properties drawn. Screenshots stay in `out/ci`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender


def test_groups_and_their_sliders_are_drawn(installed: Installed, cornell_blend: Path) -> None:
    told = installed.drive("drive_light_groups.py", cornell_blend, "light-groups")
    assert told["baked"] == ["FINISHED"]
    assert set(told["drawn"]) == {"sidebar"}
