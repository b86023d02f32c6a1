"""Ticks, scales, and where the curves of a history lie."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest

from radiosity_addon.blender.overlays.plot_layout import (
    BLUE,
    GREEN,
    HEIGHT,
    ORANGE,
    WIDTH,
    Axis,
    Drawing,
    draw_history,
    linear_axis,
    linear_ticks,
    log_axis,
    log_ticks,
    round_above,
    round_below,
    tick_label,
)

KEYS = ("seconds", "iteration", "residual", "elements", "links")


def entry(*values: float | None) -> dict[str, Any]:
    return dict(zip(KEYS, values, strict=True))


HALVING = [entry(0.1 * i, i, 2.0**-i, 100, 1000 * (i + 1)) for i in range(11)]


def curves(drawing: Drawing, colour: tuple) -> list[tuple]:
    """Points of the curves of a colour; a legend's sample is as wide as a curve, but level and short."""
    lines = [line.points for line in drawing.lines if line.colour == colour]
    return [points for points in lines if len(points) > 2]


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (0, 1, (0, 0.2, 0.4, 0.6, 0.8, 1)),
        (0, 1.04 * 23, (0, 5, 10, 15, 20)),
        (0, 6.9, (0, 1, 2, 3, 4, 5, 6)),
        (0, 7.1, (0, 2, 4, 6)),
        (0, 3e-5, (0, 5e-6, 1e-5, 1.5e-5, 2e-5, 2.5e-5, 3e-5)),
        (0, 41600, (0, 10000, 20000, 30000, 40000)),
    ],
)
def test_linear_ticks_are_round_and_few(low: float, high: float, ticks: tuple) -> None:
    assert linear_ticks(low, high) == pytest.approx(ticks)


@pytest.mark.parametrize("exponent", range(-9, 10))
@pytest.mark.parametrize("mantissa", [1.0, 1.3, 1.9999, 2.5, 3.7, 5.0, 6.8, 7.0, 9.99])
def test_linear_ticks_of_any_length(mantissa: float, exponent: int) -> None:
    high = mantissa * 10.0**exponent
    ticks = linear_ticks(0.0, high)
    assert 3 <= len(ticks) <= 8
    assert 0 == ticks[0] < ticks[-1] <= high * (1 + 1e-9)
    assert high - ticks[-1] <= (ticks[1] - ticks[0]) * (1 + 1e-9)


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (1e-4, 1.0, (1e-4, 1e-3, 1e-2, 1e-1, 1.0)),
        (2e-4, 0.5, (1e-3, 1e-2, 1e-1)),
        (1e-15, 1.0, (1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0)),
        (200, 5000, (200, 500, 1000, 2000, 5000)),
        (5e5, 2e6, (5e5, 1e6, 2e6)),
        (1, 10, (1, 2, 5, 10)),
    ],
)
def test_log_ticks_are_decades_or_finer_where_those_are_few(low: float, high: float, ticks: tuple) -> None:
    assert log_ticks(low, high) == ticks


@pytest.mark.parametrize(
    ("value", "below", "above"),
    [(1, 1, 1), (3, 2, 5), (0.07, 0.05, 0.1), (999, 500, 1000), (1e-3, 1e-3, 1e-3), (2.0000001e5, 2e5, 5e5)],
)
def test_round_numbers_around_a_value(value: float, below: float, above: float) -> None:
    assert (round_below(value), round_above(value)) == (below, above)


@pytest.mark.parametrize(
    ("value", "label"),
    [
        (0, "0"),
        (0.25, "0.25"),
        (20, "20"),
        (1000, "1k"),
        (1500, "1.5k"),
        (200_000, "200k"),
        (5e6, "5M"),
        (1e9, "1G"),
        (0.01, "0.01"),
        (1e-3, "1e-3"),
        (5e-12, "5e-12"),
        (1.5e-5, "1.5e-5"),
    ],
)
def test_labels_are_short(value: float, label: str) -> None:
    assert tick_label(value) == label


def test_a_linear_axis_runs_through_its_ends_and_middle() -> None:
    axis = Axis(2.0, 6.0, 100.0, 300.0, log=False)
    assert [axis(value) for value in (2, 4, 6)] == pytest.approx([100, 200, 300])


def test_iterations_are_marked_at_whole_numbers() -> None:
    assert linear_axis([3], 0, 100, whole=True).ticks() == (0, 1, 2, 3)
    assert linear_axis([3], 0, 100).ticks() == pytest.approx((0, 0.5, 1, 1.5, 2, 2.5, 3))
    assert linear_axis([0], 0, 100, whole=True).ticks() == (0, 1)


def test_a_log_axis_gives_each_decade_the_same_length() -> None:
    axis = log_axis([1e-3, 1.0], 0.0, 300.0)
    assert (axis.low, axis.high) == (1e-3, 1.0)
    assert [axis(10.0**-k) for k in range(4)] == pytest.approx([300, 200, 100, 0])


@pytest.mark.parametrize("values", [[], [0.0], [5.0], [1e-9]])
def test_axes_of_nothing_or_of_one_value_have_a_length(values: list[float]) -> None:
    for axis in (linear_axis(values, 0, 10), log_axis([v for v in values if v > 0], 0, 10)):
        assert axis.low < axis.high
        assert all(0 <= axis(value) <= 10 for value in values if value > 0)


def test_geometric_decay_is_a_straight_line_against_iterations() -> None:
    against_seconds, against_iterations = curves(draw_history("t", "s", HALVING), BLUE)
    for points in (against_seconds, against_iterations):
        steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(points)]
        for step in steps:
            assert step == pytest.approx(steps[0])
        assert steps[0][0] > 0 > steps[0][1]


def test_growth_and_constants_are_drawn_as_such() -> None:
    drawing = draw_history("t", "s", HALVING)
    for points in curves(drawing, GREEN):
        assert {y for _, y in points} == {points[0][1]}
    for points in curves(drawing, ORANGE):
        heights = [y for _, y in points]
        assert heights == sorted(set(heights))


def test_everything_lies_on_the_paper_and_apart() -> None:
    drawing = draw_history("A title", "A subtitle", HALVING)
    places = [point for line in drawing.lines for point in line.points] + [dot.centre for dot in drawing.dots]
    places += [text.at for text in drawing.texts]
    assert all(0 < x < WIDTH and 0 < y < HEIGHT for x, y in places)
    words = [text.words for text in drawing.texts]
    for expected in ("A title", "A subtitle", "seconds", "iterations", "elements", "links"):
        assert expected in words
    # No two texts at about the same place.
    at = sorted((round(text.at[1]), text.at[0]) for text in drawing.texts)
    assert all(b[0] - a[0] > 8 or b[1] - a[1] > 25 for a, b in pairwise(at))


def test_a_single_entry_is_a_dot_in_each_frame() -> None:
    drawing = draw_history("t", "s", [entry(2.0, 0, 1e-16, 500, 250_000)])
    assert [dot.colour for dot in drawing.dots] == [BLUE, BLUE, GREEN, ORANGE, GREEN, ORANGE]
    assert curves(drawing, BLUE) == []


def test_long_curves_have_no_dots() -> None:
    history = [entry(i, i, 0.99**i, 10, 10) for i in range(200)]
    drawing = draw_history("t", "s", history)
    assert drawing.dots == []
    assert [len(points) for points in curves(drawing, BLUE)] == [200, 200]


@pytest.mark.parametrize("residual", [0.0, None, math.nan, math.inf])
def test_what_a_log_axis_cannot_show_is_left_out(residual: float | None) -> None:
    history = [entry(i, i, value, 9, 0) for i, value in enumerate((1.0, residual, 0.5, 0.2))]
    assert [len(points) for points in curves(draw_history("t", "s", history), BLUE)] == [3, 3]


@pytest.mark.parametrize("history", [[], [entry(0.0, 0, 0.0, 0, 0)]])
def test_an_empty_history_says_so_in_each_frame(history: list) -> None:
    drawing = draw_history("t", "s", history)
    assert drawing.dots == []
    assert [text.words for text in drawing.texts].count("nothing above 0") == 4
