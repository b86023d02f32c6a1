"""The history of a solve as an SVG picture."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from radiosity_addon.bake.result.history_plot import COLORS, HEIGHT, WIDTH, history_svg, write_history
from radiosity_addon.base import BakeError

KEYS = ("seconds", "iteration", "residual", "elements", "links")
SVG = "{http://www.w3.org/2000/svg}"


def entry(*values: float | None) -> dict[str, Any]:
    return dict(zip(KEYS, values, strict=True))


HALVING = [entry(0.1 * i, i, 2.0**-i, 100, 1000 * (i + 1)) for i in range(11)]
REPORT = {"solver": {"method": "jacobi", "elements": 10, "links": 16, "residual": 0.5, "history": HALVING}}


def drawn(history: list[dict[str, Any]], title: str = "A title") -> ElementTree.Element:
    return ElementTree.fromstring(history_svg(title, "A subtitle", history))


def curves(picture: ElementTree.Element, key: str) -> list[list[tuple[float, float]]]:
    """Return the points (x, y) of the curves of a key, against seconds and against iterations."""
    lines = [
        line.get("points", "") for line in picture.iter(f"{SVG}polyline") if line.get("stroke") == COLORS[key]
    ]
    return [[(float(x), float(y)) for x, y in (at.split(",") for at in line.split())] for line in lines]


def words(picture: ElementTree.Element) -> list[str]:
    return [text.text or "" for text in picture.iter(f"{SVG}text")]


def test_geometric_decay_is_a_straight_line() -> None:
    for points in curves(drawn(HALVING), "residual"):
        steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(points)]
        assert len(steps) == 10
        for step in steps:
            assert step == pytest.approx(steps[0], abs=0.02)
        assert steps[0][0] > 0  # time goes to the right
        assert steps[0][1] > 0  # and less is lower: y points down


def test_growth_and_constants_are_drawn_as_such() -> None:
    picture = drawn(HALVING)
    for points in curves(picture, "elements"):
        assert {y for _, y in points} == {points[0][1]}
    for points in curves(picture, "links"):
        heights = [-y for _, y in points]
        assert heights == sorted(set(heights))


@pytest.mark.parametrize(
    "history", [HALVING, [entry(2.0, 0, 1e-16, 500, 250_000)], [entry(9.0, 3, 5.0, 1, 2)]]
)
def test_everything_lies_on_the_paper_and_texts_apart(history: list[dict[str, Any]]) -> None:
    picture = drawn(history)
    assert (picture.get("width"), picture.get("height")) == (str(WIDTH), str(HEIGHT))
    for points in (points for key in COLORS for points in curves(picture, key)):
        assert all(0 < x < WIDTH and 0 < y < HEIGHT for x, y in points)
    places = sorted((float(t.get("y", 0)), float(t.get("x", 0))) for t in picture.iter(f"{SVG}text"))
    assert all(0 < x < WIDTH and 0 < y < HEIGHT for y, x in places)
    assert all(b[0] - a[0] > 8 or b[1] - a[1] > 25 for a, b in pairwise(places))


def test_axes_and_curves_are_named() -> None:
    found = words(drawn(HALVING, "Jacobi & <others>"))
    for expected in ("Jacobi & <others>", "A subtitle", "seconds", "iterations", "elements", "links"):
        assert expected in found
    # Decades of the residual; whole numbers of iterations.
    assert {"1e-3", "0.01", "0.1", "1", "10"} <= set(found)


def test_iterations_are_marked_at_whole_numbers() -> None:
    history = [entry(0.1 * i, i, 0.5, 9, 9) for i in range(3)]
    row = [text for text in drawn(history).iter(f"{SVG}text") if float(text.get("x", 0)) >= 690]
    numbers = [text.text for text in row if (text.text or "").replace(".", "").isdigit()]
    assert numbers == ["0", "1", "2"] * 2


def test_long_curves_have_no_dots_and_short_ones_one_a_point() -> None:
    long = [entry(i, i, 0.99**i, 10, 10) for i in range(200)]
    assert list(drawn(long).iter(f"{SVG}circle")) == []
    assert [len(points) for points in curves(drawn(long), "residual")] == [200, 200]
    assert len(list(drawn(HALVING[:1]).iter(f"{SVG}circle"))) == 6


@pytest.mark.parametrize("residual", [0.0, None, math.nan, math.inf])
def test_what_a_log_axis_cannot_show_is_left_out(residual: float | None) -> None:
    history = [entry(i, i, value, 9, 0) for i, value in enumerate((1.0, residual, 0.5, 0.2))]
    assert [len(points) for points in curves(drawn(history), "residual")] == [3, 3]


@pytest.mark.parametrize("history", [[], [entry(0.0, 0, 0.0, 0, 0)]])
def test_an_empty_history_says_so_in_each_frame(history: list[dict[str, Any]]) -> None:
    assert words(drawn(history)).count("nothing above 0") == 4


def test_an_older_plot_is_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    (tmp_path / "plot.svg").write_text("old")
    write_history(REPORT, tmp_path / "plot.svg")
    assert ElementTree.parse(tmp_path / "plot.svg").getroot().tag == f"{SVG}svg"
    assert [path.name for path in tmp_path.iterdir()] == ["plot.svg"]


def test_a_plot_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(BakeError, match=r"file.plot\.svg"):
        write_history(REPORT, tmp_path / "file" / "plot.svg")
