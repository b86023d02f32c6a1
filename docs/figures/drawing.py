"""Style of the figures, and writing them to files."""

from __future__ import annotations

import datetime
import io
import os
import platform
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

BLUE, ORANGE, GREEN, RED, VIOLET, BROWN = "#2166ac", "#e08214", "#1b9e77", "#c51b29", "#7b3294", "#8c6d31"
GRAY = "0.55"
CYCLE = (BLUE, ORANGE, GREEN, RED, VIOLET, BROWN, "0.2", "#17a2b8")

DPI = 130

plt.rcParams.update(
    {
        "font.size": 9,
        "axes.titlesize": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.color": "0.9",
        "grid.linewidth": 0.6,
        "axes.prop_cycle": mpl.cycler(color=CYCLE),
        "lines.linewidth": 1.5,
        "legend.frameon": False,
        "figure.constrained_layout.use": True,
        "axes.axisbelow": True,
    }
)


def axes(columns: int = 1, width: float = 6.0, height: float = 3.2) -> tuple[Figure, list[Axes]]:
    """Return a figure of `columns` panels side by side, and its panels."""
    drawn, panels = plt.subplots(1, columns, figsize=(width, height), squeeze=False)
    return drawn, list(panels[0])


def slope(panel: Axes, x: tuple[float, float], y: float, order: float, text: str) -> None:
    """Draw a gray line of `order` in a doubly logarithmic panel, from (x[0], y)."""
    end = y * (x[1] / x[0]) ** order
    panel.plot(x, (y, end), color=GRAY, linewidth=1, linestyle="--")
    panel.annotate(text, (x[1], end), xytext=(4, 0), textcoords="offset points", color="0.4", fontsize=8)


def machine() -> str:
    """Return the machine and date of a time measurement."""
    return f"{datetime.date.today().isoformat()}, {os.cpu_count()} cores of {platform.machine()}"


def finish(drawn: Figure, path: Path | None) -> str:
    """Draw, and write with few colors if there is a path; return what was done."""
    buffer = io.BytesIO()
    drawn.savefig(buffer, dpi=DPI if path else 40, metadata={"Software": None})
    plt.close(drawn)
    if path is None:
        return "holds"
    image = Image.open(buffer).convert("RGB").quantize(256, method=Image.Quantize.MEDIANCUT, dither=0)
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path, optimize=True)
    return f"{path.name}, {path.stat().st_size // 1024} kB"
