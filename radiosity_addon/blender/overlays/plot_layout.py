"""Where everything in the picture of a bake's history goes: lines, dots and words, in pixels.

Plain numbers only. What draws them knows nothing of residuals or logarithms.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

WIDTH, HEIGHT = 1200, 800
"""Pixels of the picture."""

Point = tuple[float, float]
Colour = tuple[float, float, float]
"""sRGB, 0 to 1."""

INK: Colour = (0.13, 0.13, 0.13)
FRAME: Colour = (0.55, 0.55, 0.55)
GRID: Colour = (0.87, 0.87, 0.87)
# Okabe and Ito's colours: told apart by the colour-blind, too.
BLUE: Colour = (0.0, 0.447, 0.698)
GREEN: Colour = (0.0, 0.620, 0.451)
ORANGE: Colour = (0.835, 0.369, 0.0)

MAX_DOTS = 40
"""A curve of more points is drawn without dots."""

_STEPS = (1.0, 2.0, 5.0, 10.0)
"""Mantissas of round numbers."""

_COLUMNS = ((95.0, 555.0), (690.0, 1165.0))
_ROWS = ((440.0, 665.0), (80.0, 305.0))
"""Left and right, bottom and top of the four frames."""


@dataclass(frozen=True)
class Line:
    """A polyline through points (x, y), in pixels from the lower left corner."""

    points: tuple[Point, ...]
    colour: Colour
    width: float = 1.0


@dataclass(frozen=True)
class Dot:
    """A filled circle."""

    centre: Point
    colour: Colour
    radius: float = 4.0


@dataclass(frozen=True)
class Text:
    """A line of words; `at` is the middle of its height, and the end that `align` names."""

    at: Point
    words: str
    size: float = 17.0
    align: str = "CENTER"
    colour: Colour = INK


@dataclass
class Drawing:
    """All that is to be drawn, the first of a kind below the later ones."""

    lines: list[Line] = field(default_factory=list)
    dots: list[Dot] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)
    width: int = WIDTH
    height: int = HEIGHT


@dataclass(frozen=True)
class Axis:
    """Values from `low` to `high` laid over pixels from `start` to `end`."""

    low: float
    high: float
    start: float
    end: float
    log: bool
    whole: bool = False
    """Whether only whole numbers are marked."""

    def __call__(self, value: float) -> float:
        """Return where a value lies [pixels]."""
        share = (self._measure(value) - self._measure(self.low)) / (
            self._measure(self.high) - self._measure(self.low)
        )
        return self.start + share * (self.end - self.start)

    def ticks(self) -> tuple[float, ...]:
        """Return the values to mark."""
        ticks = log_ticks(self.low, self.high) if self.log else linear_ticks(self.low, self.high)
        return tuple(tick for tick in ticks if not self.whole or tick == round(tick))

    def _measure(self, value: float) -> float:
        return math.log10(value) if self.log else value


@dataclass(frozen=True)
class _Curve:
    """What is drawn against what: keys of a history's entries."""

    key: str
    colour: Colour


_RESIDUAL = (_Curve("residual", BLUE),)
_SIZE = (_Curve("elements", GREEN), _Curve("links", ORANGE))


def draw_history(title: str, subtitle: str, history: Sequence[Mapping[str, Any]]) -> Drawing:
    """Lay out residual, elements and links against the seconds and the iterations of a solve.

    Parameters
    ----------
    title, subtitle : str
    history : sequence of mappings
        "seconds", "iteration", "residual", "elements", "links" of each entry, as the report
        has them; a residual may be None.

    Returns
    -------
    drawing : Drawing
        Residual above, elements and links below, on logarithmic axes.
    """
    drawing = Drawing()
    drawing.texts.append(Text((WIDTH / 2, 765.0), title, 26.0))
    drawing.texts.append(Text((WIDTH / 2, 728.0), subtitle, 17.0))
    rows = (("residual, as a share of the light's power", _RESIDUAL), ("elements and links", _SIZE))
    for (bottom, top), (name, curves) in zip(_ROWS, rows, strict=True):
        values = [value for curve in curves for value in _numbers(history, curve.key) if value > 0]
        up = log_axis(values, bottom, top)
        for (left, right), along in zip(_COLUMNS, ("seconds", "iteration"), strict=True):
            across = linear_axis(_numbers(history, along), left, right, whole=along == "iteration")
            _frame(drawing, across, up)
            _curves(drawing, across, up, curves, along, history)
            if not values:
                middle = ((left + right) / 2, (bottom + top) / 2)
                drawing.texts.append(Text(middle, "nothing above 0", colour=FRAME))
        drawing.texts.append(Text((_COLUMNS[0][0], top + 20.0), name, 18.0, "LEFT"))
        _legend(drawing, curves, top + 20.0)
    bottom = _ROWS[-1][0]
    for (left, right), name in zip(_COLUMNS, ("seconds", "iterations"), strict=True):
        drawing.texts.append(Text(((left + right) / 2, bottom - 55.0), name, 18.0))
    return drawing


def linear_axis(values: Sequence[float], start: float, end: float, whole: bool = False) -> Axis:
    """Return an axis from 0 to a little over the largest value."""
    largest = max(values, default=0.0)
    return Axis(0.0, 1.04 * largest if largest > 0 else 1.0, start, end, log=False, whole=whole)


def log_axis(values: Sequence[float], start: float, end: float) -> Axis:
    """Return a logarithmic axis between round numbers around positive values."""
    if not values:
        return Axis(1.0, 10.0, start, end, log=True)
    low, high = round_below(min(values)), round_above(max(values))
    if low == high:
        low, high = round_below(0.9 * low), round_above(1.1 * high)
    return Axis(low, high, start, end, log=True)


def round_below(value: float) -> float:
    """Return the largest of … 0.1, 0.2, 0.5, 1, 2, 5, 10 … that is not above a positive value."""
    decade = math.floor(math.log10(value))
    return max(
        (number for number in _round_numbers(decade - 1, decade + 1) if number <= value * (1 + 1e-12)),
    )


def round_above(value: float) -> float:
    """Return the smallest of … 0.1, 0.2, 0.5, 1, 2, 5, 10 … that is not below a positive value."""
    decade = math.floor(math.log10(value))
    return min(
        (number for number in _round_numbers(decade - 1, decade + 1) if number >= value * (1 - 1e-12)),
    )


def linear_ticks(low: float, high: float, most: int = 7) -> tuple[float, ...]:
    """Return multiples of a round step within [low, high], at most `most` of them."""
    decade = math.floor(math.log10((high - low) / most))
    steps = [float(f"{step:g}e{decade}") for step in _STEPS]
    step = next(step for step in (*steps, 20 * steps[0]) if (high - low) / step < most)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return tuple(number * step for number in range(first, last + 1))


def log_ticks(low: float, high: float, most: int = 7) -> tuple[float, ...]:
    """Return round numbers within [low, high]: powers of ten, fewer of many, more than them if few."""
    first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
    if last - first < 2:
        finer = _round_numbers(first - 1, last)
        return tuple(number for number in finer if low * (1 - 1e-9) <= number <= high * (1 + 1e-9))
    every = math.ceil((last - first + 1) / most)
    return tuple(float(f"1e{decade}") for decade in range(first, last + 1, every))


def tick_label(value: float) -> str:
    """Return a number in few characters: 0.25, 20, 5k, 2M, 1e-4."""
    for unit, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if unit <= abs(value) < 1000 * unit:
            return f"{value / unit:g}{letter}"
    if value and not 1e-2 <= abs(value) < 1e4:
        mantissa, exponent = f"{value:.2e}".split("e")
        return f"{float(mantissa):g}e{int(exponent)}"
    return f"{value:g}"


def _round_numbers(first: int, last: int) -> list[float]:
    """1, 2 and 5 in each decade from 10^first to 10^last; written as decimals, they are exact."""
    return [float(f"{step:g}e{decade}") for decade in range(first, last + 1) for step in _STEPS[:3]]


def _numbers(history: Iterable[Mapping[str, Any]], key: str) -> list[float]:
    """What the entries have under a key, those without a finite number left out."""
    values = [entry.get(key) for entry in history]
    return [float(value) for value in values if value is not None and math.isfinite(value)]


def _frame(drawing: Drawing, across: Axis, up: Axis) -> None:
    """Draw a frame with its grid and the numbers along it."""
    for value in across.ticks():
        x = across(value)
        drawing.lines.append(Line(((x, up.start), (x, up.end)), GRID))
        drawing.texts.append(Text((x, up.start - 20.0), tick_label(value), 15.0))
    for value in up.ticks():
        y = up(value)
        drawing.lines.append(Line(((across.start, y), (across.end, y)), GRID))
        drawing.texts.append(Text((across.start - 12.0, y), tick_label(value), 15.0, "RIGHT"))
    left, right, bottom, top = across.start, across.end, up.start, up.end
    corners = ((left, bottom), (right, bottom), (right, top), (left, top), (left, bottom))
    drawing.lines.append(Line(corners, FRAME, 1.5))


def _curves(
    drawing: Drawing,
    across: Axis,
    up: Axis,
    curves: Sequence[_Curve],
    along: str,
    history: Sequence[Mapping[str, Any]],
) -> None:
    """Draw curves into a frame, with dots where they do not crowd."""
    for curve in curves:
        entries = [entry for entry in history if _positive(entry, curve.key) and _number(entry, along)]
        points = tuple((across(entry[along]), up(entry[curve.key])) for entry in entries)
        if len(points) > 1:
            drawing.lines.append(Line(points, curve.colour, 2.5))
        if len(points) <= MAX_DOTS:
            drawing.dots += [Dot(point, curve.colour) for point in points]


def _legend(drawing: Drawing, curves: Sequence[_Curve], y: float) -> None:
    """Name the curves' colours at the right above a row, if there are several."""
    if len(curves) < 2:
        return
    x = _COLUMNS[-1][1]
    for curve in reversed(curves):
        drawing.texts.append(Text((x, y), curve.key, 16.0, "RIGHT"))
        x -= 10.0 + 8.0 * len(curve.key)
        drawing.lines.append(Line(((x - 40.0, y), (x, y)), curve.colour, 2.5))
        x -= 65.0


def _number(entry: Mapping[str, Any], key: str) -> bool:
    return bool(_numbers((entry,), key))


def _positive(entry: Mapping[str, Any], key: str) -> bool:
    return any(value > 0 for value in _numbers((entry,), key))
