"""The plot is drawn by Blender, shows what it should where it should, and leaves nothing behind."""

from __future__ import annotations

import re
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.command_line.plot import render_drawing, render_plot
from radiosity_addon.blender.overlays.plot_layout import BLUE, Dot, Drawing, Line, Text
from tests.blender.file_dump import differences, dump_file

HISTORY = [
    {"seconds": 0.1 * i, "iteration": i, "residual": 0.5**i, "elements": 10, "links": 9 + i} for i in range(8)
]
REPORT = {"solver": {"method": "jacobi", "elements": 10, "links": 16, "residual": 0.5**7, "history": HISTORY}}


def _pixels(path: Path) -> np.ndarray:
    """sRGB values of a PNG, bottom row first: (height, width, 3) in 0 to 1."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[..., :3]


def _drawn(drawing: Drawing, tmp_path: Path) -> np.ndarray:
    render_drawing(drawing, tmp_path / "drawing.png")
    return _pixels(tmp_path / "drawing.png")


RED, TEAL = (0.8, 0.1, 0.2), (0.1, 0.6, 0.5)


def test_colours_and_places_are_those_of_the_layout(tmp_path: Path) -> None:
    drawing = Drawing(
        lines=[Line(((20.0, 30.0), (180.0, 30.0)), RED, 6.0), Line(((40.0, 50.0), (40.0, 90.0)), TEAL, 6.0)],
        dots=[Dot((120.0, 70.0), TEAL, 10.0)],
        width=200,
        height=100,
    )
    pixels = _drawn(drawing, tmp_path)
    assert pixels.shape == (100, 200, 3)
    for (x, y), colour in (
        ((100, 30), RED),
        ((22, 31), RED),
        ((40, 70), TEAL),
        ((120, 70), TEAL),
        ((126, 74), TEAL),
        ((100, 40), (1, 1, 1)),
        ((0, 0), (1, 1, 1)),
        ((199, 99), (1, 1, 1)),
        ((134, 70), (1, 1, 1)),
        ((190, 30), (1, 1, 1)),
    ):
        np.testing.assert_allclose(pixels[y, x], colour, atol=0.01, err_msg=str((x, y)))
    # As much ink as the line has area: its edges are smoothed evenly, in linear light.
    green = ((pixels[20:40, :, 1] + 0.055) / 1.055) ** 2.4
    ink = (1 - green).sum() / (1 - ((RED[1] + 0.055) / 1.055) ** 2.4)
    assert ink == pytest.approx(160 * 6, rel=0.03)


def test_sharp_turns_leave_a_line_as_wide_as_it_is(tmp_path: Path) -> None:
    zigzag = Line(((20.0, 20.0), (35.0, 80.0), (50.0, 20.0), (65.0, 80.0)), (0.0, 0.0, 0.0), 4.0)
    pixels = _drawn(Drawing(lines=[zigzag], width=100, height=100), tmp_path)[..., 1]
    linear = np.where(pixels > 0.04045, ((pixels + 0.055) / 1.055) ** 2.4, pixels / 12.92)
    ink = (1 - linear).sum(axis=1)
    # A row crosses three strokes, each wider along the row than across itself.
    np.testing.assert_allclose(ink[40:60].mean(), 3 * 4 * np.hypot(15, 60) / 60, rtol=0.03)
    # Round ends at the turns: the tips are not cut off.
    assert ink[80] > 1


def test_words_stand_where_their_alignment_puts_them(tmp_path: Path) -> None:
    drawing = Drawing(
        texts=[
            Text((100.0, 150.0), "HHHH", 40.0),
            Text((10.0, 90.0), "HHHH", 40.0, "LEFT"),
            Text((190.0, 30.0), "HHHH", 40.0, "RIGHT"),
        ],
        width=200,
        height=180,
    )
    dark = _drawn(drawing, tmp_path).mean(axis=2) < 0.5
    extents = []
    for low, high in ((120, 180), (60, 120), (0, 60)):
        rows, columns = np.nonzero(dark[low:high])
        assert abs((rows.min() + rows.max()) / 2 - 30) < 4
        extents.append((columns.min(), columns.max()))
    (centre_left, centre_right), (left, _), (_, right) = extents
    assert abs((centre_left + centre_right) / 2 - 100) < 3
    assert 8 <= left <= 16
    assert 184 <= right <= 192


def test_the_history_is_drawn_and_the_same_each_time(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        render_plot(REPORT, tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    pixels = _pixels(tmp_path / "a.png")
    assert pixels.shape == (800, 1200, 3)
    blue = (np.abs(pixels - BLUE) < 0.02).all(axis=2)
    rows, columns = np.nonzero(blue)
    assert rows.min() > 400  # residuals are in the upper half
    assert columns.min() < 120
    assert columns.max() > 1100
    assert (pixels.mean(axis=2) < 0.5).sum() > 1000  # words
    assert (pixels.mean(axis=2) > 0.99).mean() > 0.8  # paper


def test_the_open_file_stays_as_it_is(tmp_path: Path) -> None:
    def counts() -> dict[str, int]:
        collections = [p.identifier for p in bpy.types.BlendData.bl_rna.properties if p.type == "COLLECTION"]
        return {name: len(getattr(bpy.data, name)) for name in collections}

    text = bpy.data.objects.new("Mine", bpy.data.curves.new("Mine", "FONT"))
    bpy.context.scene.collection.objects.link(text)
    bpy.context.view_layer.update()
    dump_file()
    before, numbers, scene = dump_file(), counts(), bpy.context.scene
    render_plot(REPORT, tmp_path / "plot.png")
    found = differences(before, dump_file())
    # A tag is for tools to use as they like; Blender itself tags while it removes.
    found = [line for line in found if not re.match(r"/objects/.*/tag: ", line)]
    assert found == []
    assert counts() == numbers
    assert bpy.context.scene == scene
    assert [path.name for path in tmp_path.iterdir()] == ["plot.png"]


def test_a_plot_that_cannot_be_written_is_named_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    scenes = len(bpy.data.scenes)
    with pytest.raises(BakeError, match=r"file.plot\.png"):
        render_plot(REPORT, tmp_path / "file" / "plot.png")
    assert len(bpy.data.scenes) == scenes


def test_an_older_plot_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "plot.png").write_text("old")
    render_drawing(Drawing(width=16, height=8), tmp_path / "plot.png")
    assert _pixels(tmp_path / "plot.png").shape == (8, 16, 3)
