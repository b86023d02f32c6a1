"""The panel's methods in a window: each is drawn without an error. Screenshots stay in `out/ci`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender


def test_each_method_is_drawn(installed: Installed, cornell_blend: Path) -> None:
    told = installed.drive("drive_solver_panel.py", cornell_blend, "solver")
    assert len(told["methods"]) == 8
    assert set(told["drawn"]) == set(told["methods"])
