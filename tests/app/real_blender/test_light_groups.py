"""Light groups in a window: baked, their panel and their properties drawn. Screenshots stay in `out/ci`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender

PICTURES = Path(__file__).resolve().parents[3] / "out" / "ci"


def test_groups_and_their_sliders_are_drawn(installed: Installed, cornell_blend: Path) -> None:
    answer = cornell_blend.with_name("light-groups.json")
    done = installed.run(
        cornell_blend,
        "--enable-event-simulate",
        "--window-geometry",
        *("0", "0", "1280", "800"),
        "--python",
        installed.folder / "drive_light_groups.py",
        "--",
        answer,
        window=True,
        timeout=200,
    )
    PICTURES.mkdir(parents=True, exist_ok=True)
    for picture in answer.parent.glob("light-groups*.png"):
        shutil.copy(picture, PICTURES)
    assert answer.exists(), done.stdout
    told = json.loads(answer.read_text())
    assert told["failure"] is None, f"{told['failure']}\n{done.stdout}"
    assert "Traceback" not in done.stdout, done.stdout
    assert told["baked"] == ["FINISHED"]
    assert set(told["drawn"]) == {"sidebar"}
