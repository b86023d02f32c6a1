"""What the panel shows of the last bake."""

from __future__ import annotations

import bpy
import pytest

from radiosity_addon.blender.panels.bake_panel import LastBakeSection
from radiosity_addon.blender.session import last_bake
from tests.blender.note_layout import NoteLayout, Notes, labels

pytestmark = pytest.mark.usefixtures("registered")

SOLVER = {
    "method": "hierarchical",
    "elements": 12345,
    "links": 678,
    "rays": 9,
    "power_W": {"emitted": 8.0, "absorbed": 6.0, "escaped": 2.0},
}


def _remember(*warnings: tuple[str, str]) -> None:
    said = [{"name": name, "message": message} for name, message in warnings]
    objects = [{"image": image} for image in ("1.exr", "1.exr", "2.exr")]
    report = {"objects": objects, "solver": SOLVER, "seconds": {"solve": 1.5, "light": 2}, "warnings": said}
    last_bake.remember(bpy.context.scene, report, "")


def _drawn() -> list[str]:
    notes: Notes = []
    LastBakeSection.draw(NoteLayout(notes), bpy.context)
    return labels(notes)


def test_before_a_bake_there_is_nothing_to_show() -> None:
    assert not LastBakeSection.poll(bpy.context)
    _remember()
    assert LastBakeSection.poll(bpy.context)


def test_every_figure_is_shown_with_its_name() -> None:
    _remember()
    drawn = _drawn()
    figures = dict(zip(drawn[::2], drawn[1::2], strict=True))
    assert figures["Time"] == "3.5 s"
    counts = {"Objects": "3", "Images": "2", "Elements": "12,345", "Links": "678", "Rays": "9"}
    assert counts.items() <= figures.items()
    assert figures["Light Kept"] == "75.0%"
    assert tuple(figures.items()) == last_bake.read(bpy.context.scene).figures


def test_warnings_are_shown_below_the_figures() -> None:
    _remember()
    figures = _drawn()
    _remember(("Lamp", "is dark"), ("Wall", "is thin"))
    drawn = _drawn()
    assert drawn[: len(figures)] == figures
    assert " ".join(drawn[len(figures) :]) == "Warnings Lamp: is dark Wall: is thin"
