"""Overlays in a window: texels while they are baked, each overlay, and nothing left of any."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.app.conftest import read_pixels
from tests.app.real_blender.installed import PICTURES, Installed

pytestmark = pytest.mark.real_blender

FINE = "RADIOSITY_FINE_PICTURES"
"""Set, the photographs are those of the user guide (docs/overlays.py)."""

BLUE, GREEN, CHECKERS = (0.12, 0.30, 0.80), (0.25, 0.75, 0.30), ((0.25, 0.25, 0.27), (0.85, 0.85, 0.82))
DOUBTFUL = (0.95, 0.90, 0.30)


@pytest.fixture(scope="module")
def seen(installed: Installed, cornell_blend: Path) -> dict[str, Any]:
    """What one session saw; its photographs lie in `out/ci`."""
    return installed.drive(
        "drive_overlays.py",
        cornell_blend,
        "overlay",
        *(("256", "medium") if os.environ.get(FINE) else ("96", "draft")),
    )


def photograph(seen: dict[str, Any], name: str) -> np.ndarray:
    """What the viewport showed, (height, width, 3) in [0, 1]; its header and gizmos are left out."""
    picture = read_pixels(PICTURES / f"overlay-{name}.png")
    x, y, across, down = seen["viewport"]
    pixels = picture[::-1]
    return pixels[y + down // 8 : y + down, x : x + int(across * 0.9)]


def share_of(picture: np.ndarray, color: tuple[float, ...]) -> float:
    """What part of the viewport shows a color; it keeps 8 bits of linear light, coarse in the dark."""
    return float((np.abs(picture - np.float32(color)).max(axis=2) < 0.04).mean())


def differing(one: np.ndarray, other: np.ndarray) -> float:
    return float((np.abs(one - other).max(axis=2) > 2 / 255).mean())


def test_texels_came_to_the_window_while_they_were_baked(seen: dict[str, Any]) -> None:
    assert seen["texels"] >= 5
    live, before = photograph(seen, "live"), photograph(seen, "before")
    assert differing(live, before) > 0.15
    # The red wall is red, on the left, the green one green, on the right.
    half = live.shape[1] // 2
    excess = live[..., 0] - live[..., 1]
    assert excess[:, :half].max() > 0.3
    assert excess[:, half:].min() < -0.1


def test_each_overlay_has_its_colors(seen: dict[str, Any]) -> None:
    checker = photograph(seen, "checker")
    for color in CHECKERS:
        assert share_of(checker, color) > 0.05
    assert share_of(photograph(seen, "texels"), DOUBTFUL) > 0.01
    # All is as dense: the color in the middle of the scale, over the whole box.
    assert share_of(photograph(seen, "density"), GREEN) > 0.15
    lux = photograph(seen, "false_color")
    assert share_of(lux, BLUE) > 0.02
    assert share_of(lux, GREEN) > 0.005


def test_lines_are_drawn_over_the_objects(seen: dict[str, Any]) -> None:
    plain = photograph(seen, "none")
    for name, least in (("elements", 0.01), ("links", 0.01)):
        assert differing(photograph(seen, name), plain) > least
    # Edges are dark, on light walls.
    assert (photograph(seen, "elements") < plain - 0.1).all(axis=2).mean() > 0.005


def test_without_an_overlay_the_viewport_looks_as_before(seen: dict[str, Any]) -> None:
    assert differing(photograph(seen, "again"), photograph(seen, "none")) < 1e-3
    assert differing(photograph(seen, "restored"), photograph(seen, "before")) < 1e-3


def test_false_colors_outlast_a_reload_and_links_do_not(seen: dict[str, Any]) -> None:
    assert differing(photograph(seen, "reloaded"), photograph(seen, "false_color")) < 1e-2
    assert seen["missing"]["baked"] == dict.fromkeys(seen["missing"]["baked"], "")
    assert not seen["missing"]["reloaded"]["FALSE_COLOR"]
    assert "memory" in seen["missing"]["reloaded"]["LINKS"]


def test_the_panel_reports_numbers_of_the_active_object(seen: dict[str, Any]) -> None:
    # Whatever a panel's drawing raises is in what Blender printed, which has no traceback.
    assert set(seen["statistics_of"]) == {"Floor"}


def test_restore_leaves_nothing(seen: dict[str, Any]) -> None:
    assert all("ake first" in why for why in seen["missing"]["restored"].values())
    assert not seen["kept"]
    assert seen["after_restore"] == []
