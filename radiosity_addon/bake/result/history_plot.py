"""The history of a solve as an SVG picture: residual, elements and links against seconds and iterations."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from ...base import linear_ticks, tick_label
from ...options import METHODS
from ...publishing import write_text

WIDTH, HEIGHT = 1200, 800
COLUMNS = (("seconds", "seconds", 95, 555), ("iteration", "iterations", 690, 1165))
"""What each column is drawn against: key of a history's entries, its name, left and right [pixels]."""

ROWS = (
    ("residual, as a share of the light's power", ("residual",), 135, 360),
    ("elements and links", ("elements", "links"), 495, 720),
)
"""What each row shows: its name, keys of a history's entries, top and bottom [pixels]."""

COLORS = {"residual": "#0072b2", "elements": "#009e73", "links": "#d55e00"}
"""Those of Okabe and Ito, which the color-blind can distinguish."""

MAX_DOTS = 40
"""A curve of more points is drawn without dots."""

STYLE = "text{font:15px sans-serif;fill:#222}.grid{stroke:#ddd}.frame{fill:none;stroke:#888}"


def write_history(report: Mapping[str, Any], path: Path) -> None:
    """Draw a report's history of residual, elements and links to an SVG file, over an older one.

    Raises
    ------
    BakeError
        If it cannot be written.
    """
    solver = report["solver"]
    parts = [f"{solver[key]:,} {key}" for key in ("elements", "links", "iterations") if solver.get(key)]
    if solver.get("residual") is not None:
        parts.append(f"residual {solver['residual']:.1e}")
    title = f"{METHODS[solver['method']].label}: how it was solved"
    write_text(path, history_svg(title, ", ".join(parts), solver.get("history", ())))


def history_svg(title: str, subtitle: str, history: Sequence[Mapping[str, Any]]) -> str:
    """Return the picture: linear axes from left to right, logarithmic ones from bottom to top."""
    parts = [_text(WIDTH / 2, 35, title, size=26), _text(WIDTH / 2, 72, subtitle)]
    for name, keys, top, bottom in ROWS:
        values = [value for key in keys for value in _finite(history, key) if value > 0]
        low = math.floor(math.log10(min(values, default=1.0)) + 1e-9)
        high = max(math.ceil(math.log10(max(values, default=1.0)) - 1e-9), low + 1)
        every = math.ceil((high - low + 1) / 7)
        parts.append(_text(COLUMNS[0][2], top - 20, name, "start"))
        for along, label, left, right in COLUMNS:
            end = 1.04 * max(_finite(history, along), default=0.0) or 1.0
            for tick in linear_ticks(0.0, end):
                if along == "seconds" or tick == round(tick):
                    x = left + (right - left) * tick / end
                    parts += [_line(x, top, x, bottom), _text(x, bottom + 24, tick_label(tick))]
            for decade in range(low, high + 1, every):
                y = bottom - (bottom - top) * (decade - low) / (high - low)
                parts += [
                    _line(left, y, right, y),
                    _text(left - 10, y + 5, tick_label(float(f"1e{decade}")), "end"),
                ]
            parts.append(
                f'<rect class="frame" x="{left}" y="{top}" width="{right - left}" height="{bottom - top}"/>'
            )
            if not values:
                parts.append(_text((left + right) / 2, (top + bottom) / 2, "nothing above 0"))
            parts.append(_text((left + right) / 2, bottom + 52, label))
            for key in keys:
                points = [
                    (
                        left + (right - left) * entry[along] / end,
                        bottom - (bottom - top) * (math.log10(entry[key]) - low) / (high - low),
                    )
                    for entry in history
                    if _finite((entry,), along) and any(value > 0 for value in _finite((entry,), key))
                ]
                parts += _curve(points, COLORS[key])
        for number, key in enumerate(keys if len(keys) > 1 else ()):
            parts.append(_text(1165 - 90 * number, top - 20, key, "end", color=COLORS[key]))
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" '
        f'viewBox="0 0 {WIDTH} {HEIGHT}"><style>{STYLE}</style>\n'
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>\n{body}\n</svg>\n'
    )


def _curve(points: Sequence[tuple[float, float]], color: str) -> list[str]:
    """Return a line through points, with dots where they do not crowd."""
    line = " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
    parts = [f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="2.5"/>']
    if len(points) <= MAX_DOTS:
        parts += [f'<circle cx="{x:.2f}" cy="{y:.2f}" r="4" fill="{color}"/>' for x, y in points]
    return parts


def _line(x: float, y: float, x_end: float, y_end: float) -> str:
    return f'<line class="grid" x1="{x:.1f}" y1="{y:.1f}" x2="{x_end:.1f}" y2="{y_end:.1f}"/>'


def _text(
    x: float, y: float, words: str, anchor: str = "middle", *, size: int = 17, color: str = "#222"
) -> str:
    style = f"font-size:{size}px;fill:{color}"
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" style="{style}">{escape(words)}</text>'


def _finite(history: Iterable[Mapping[str, Any]], key: str) -> list[float]:
    """Return what the entries have under a key, without those that have no finite number."""
    values = [entry.get(key) for entry in history]
    return [float(value) for value in values if value is not None and math.isfinite(value)]
