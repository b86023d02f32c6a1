"""The panel in a window: each frame is whole, the first after a bake too. Screenshots stay in `out/ci`."""

from __future__ import annotations

import json
import shutil
from itertools import pairwise
from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.app.real_blender.installed import Installed

pytestmark = pytest.mark.real_blender

PICTURES = Path(__file__).resolve().parents[3] / "out" / "ci"

CHANGES = ("opened", "baking", "canceled", "baked", "interrupted", "recovered", "restored")


def pixels(name: str) -> np.ndarray:
    """A photograph's colors [sRGB], (height, width, 3), without the tabs, and the frame around the mouse."""
    image = bpy.data.images.load(str(PICTURES / f"frames-{name}.png"))
    width, height = image.size
    values = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(height, width, 4)[10:-10, 15:250, :3]


def differing(one: str, other: str) -> float:
    """The share of pixels in which two photographs differ."""
    return float((np.abs(pixels(one) - pixels(other)).max(axis=2) > 2 / 255).mean())


def test_nothing_is_drawn_over_each_other_after_a_change(installed: Installed, cornell_blend: Path) -> None:
    answer = cornell_blend.with_name("frames.json")
    done = installed.run(
        cornell_blend,
        "--enable-event-simulate",
        "--window-geometry",
        *("0", "0", "1280", "800"),
        "--python",
        installed.folder / "drive_panel_frames.py",
        "--",
        answer,
        window=True,
        timeout=300,
    )
    PICTURES.mkdir(parents=True, exist_ok=True)
    for picture in answer.parent.glob("frames-*.png"):
        shutil.copy(picture, PICTURES)
    assert answer.exists(), done.stdout
    told = json.loads(answer.read_text())
    assert told["failure"] is None, f"{told['failure']}\n{done.stdout}"
    assert "Traceback" not in done.stdout, done.stdout
    assert tuple(told["changes"]) == CHANGES
    # The panel does change: without these there would be nothing to draw wrongly.
    for before, after in pairwise(CHANGES[1:]):
        assert differing(f"{before}-last", f"{after}-last") > 0.05
    # A few pixels are the view's, which shines through, and is drawn more finely each time.
    unlike = {name: differing(f"{name}-first", f"{name}-last") for name in CHANGES}
    # The mouse was over the progress bar, which Blender would show again as another part of the panel.
    unlike["opened, canceled"] = differing("opened-last", "canceled-last")
    assert max(unlike.values()) < 0.003, unlike  # with a part in the wrong place, 0.01 to 0.2
