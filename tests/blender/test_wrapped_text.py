"""Hints in panels are broken where the interface's font needs it: labels that are too long are cut off."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import blf
import pytest

from radiosity_addon.blender.panels.bake_panel import SOLID, WORKBENCH
from radiosity_addon.blender.panels.wrapped_text import draw_text, wrapped


class Lines:
    """A layout that notes its labels."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def column(self, **_: Any) -> Lines:
        return self

    def label(self, text: str, **_: Any) -> None:
        self.texts.append(text)


def drawn(text: str, region: int, scale: float, width: float | None = None) -> list[str]:
    styles = [SimpleNamespace(widget=SimpleNamespace(points=11))]
    system = SimpleNamespace(ui_scale=scale)
    context: Any = SimpleNamespace(
        region=SimpleNamespace(width=region),
        preferences=SimpleNamespace(system=system, ui_styles=styles),
    )
    lines = Lines()
    draw_text(lines, text, "INFO", context, width)
    return lines.texts


@pytest.mark.parametrize("text", [WORKBENCH, SOLID])
@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_a_hint_fits_the_sidebar(text: str, scale: float) -> None:
    """A sidebar 283 pixels wide has 194 for text, between the icon and the tabs."""
    lines = drawn(text, int(283 * scale), scale)
    assert " ".join(lines) == text
    blf.size(0, 11.0 * scale)
    assert max(blf.dimensions(0, line)[0] for line in lines) <= 194 * scale
    assert len(lines) <= 4


def test_a_pop_up_without_tabs_has_more_room() -> None:
    long = 10 * f"{WORKBENCH}. "
    assert len(drawn(long, 283, 1.0, 480)) < len(drawn(long, 480, 1.0))


def test_a_word_is_never_broken() -> None:
    assert wrapped("a verylongword b", 3, len) == ["a", "verylongword", "b"]
