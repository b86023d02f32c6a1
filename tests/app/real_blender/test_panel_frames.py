"""The panel in a window: each frame is whole, the first after a bake too. Screenshots stay in `out/ci`."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.app.conftest import read_pixels
from tests.app.real_blender.installed import PICTURES, Installed

pytestmark = pytest.mark.real_blender

CHANGES = ("opened", "baking", "canceled", "baked", "interrupted", "recovered", "restored")


def pixels(name: str) -> np.ndarray:
    """A photograph's colors [sRGB], (height, width, 3), without the tabs, and the frame around the mouse."""
    picture = read_pixels(PICTURES / f"frames-{name}.png")
    return picture[10:-10, 15:250]


def differing(one: str, other: str) -> float:
    """The share of pixels in which two photographs differ."""
    return float((np.abs(pixels(one) - pixels(other)).max(axis=2) > 2 / 255).mean())


def test_nothing_is_drawn_over_each_other_after_a_change(installed: Installed, cornell_blend: Path) -> None:
    told = installed.drive("drive_panel_frames.py", cornell_blend, "frames")
    assert tuple(told["changes"]) == CHANGES
    # The panel does change: without these there would be nothing to draw wrongly.
    for before, after in pairwise(CHANGES[1:]):
        assert differing(f"{before}-last", f"{after}-last") > 0.05
    unlike = {name: differing(f"{name}-first", f"{name}-last") for name in CHANGES}
    # The mouse was over the progress bar, which Blender would show again as another part of the panel.
    unlike["opened, canceled"] = differing("opened-last", "canceled-last")
    assert max(unlike.values()) < 0.001, unlike  # with a part in the wrong place, 0.01 to 0.2
